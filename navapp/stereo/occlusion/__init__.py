"""What one camera cannot see: its classes, its filling, and the smoothing of the filled map."""
