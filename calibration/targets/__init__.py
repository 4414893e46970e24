"""Calibration targets: their geometry, printing them, and finding them in pictures."""
