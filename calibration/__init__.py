"""Calibration of the rig and the display: works on pictures and points, never on devices."""

import navapp  # noqa: F401 (sets the environment before any heavy import)
