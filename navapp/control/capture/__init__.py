"""Guided capture of a calibration: what is seen, what is kept, what is wanted next."""
