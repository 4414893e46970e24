"""The screen of a tool's calibration."""
