"""Disparity to a part of a pixel, on a support."""
