"""Draws guides: video, poses and a plan become the picture that is shown."""

from navapp.overlay.composition import compose_video, make_preview, put_mark
from navapp.overlay.depth_marks import DepthMarks
from navapp.overlay.layers import LAYERS
from navapp.overlay.scene import Scene
from navapp.overlay.viewpoints import LeftView, Viewpoint

__all__ = [
    "LAYERS",
    "DepthMarks",
    "LeftView",
    "Scene",
    "Viewpoint",
    "compose_video",
    "make_preview",
    "put_mark",
]
