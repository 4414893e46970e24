"""The screen of the alignment of crosses in the mirror."""
