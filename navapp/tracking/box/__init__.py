"""The box of a bone in the left pictures, followed without a pose."""
