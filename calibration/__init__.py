"""Calibration of a stereo rig, of a display delay and of a tool tip, from pictures and poses."""

import navapp  # noqa: F401 (sets the environment before any heavy import)
