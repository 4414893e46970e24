"""A calibration for the eyes of a person who has to decide whether to trust it."""
