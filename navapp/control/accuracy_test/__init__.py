"""The localisation and tracking test of a pointer, step by step."""
