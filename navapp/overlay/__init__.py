"""Renders the overlay picture from video, poses and a plan."""

from navapp.overlay.composition import compose_video, make_preview
from navapp.overlay.depth_marks import DepthMarks
from navapp.overlay.layers import LAYERS

__all__ = ["LAYERS", "DepthMarks", "compose_video", "make_preview"]
