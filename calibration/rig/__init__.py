"""Calibration of a stereo rig from pictures of a target, with acceptance limits."""
