"""Rigs in the files of other programs."""
