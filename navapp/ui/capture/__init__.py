"""The screen of a guided capture."""
