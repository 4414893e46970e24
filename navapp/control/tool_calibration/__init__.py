"""Guided calibration of a hand-held tool: its paper, its tip, its axis."""
