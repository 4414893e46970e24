"""The least error that the pictures' noise allows a pose."""
