"""Guided capture of a calibration: board views, kept pairs, the next view."""
