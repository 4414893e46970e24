"""Targets: what is printed on them, and where pictures show it."""
