"""What each part of our method is worth: the same frames without it."""
