"""Draws guides: video, poses and a plan become the picture that is shown."""

from navapp.overlay.composition import compose_mirror, compose_video, put_mark
from navapp.overlay.depth_marks import DepthMarks
from navapp.overlay.guide_points import sample_guides
from navapp.overlay.layers import LAYERS
from navapp.overlay.scene import Scene
from navapp.overlay.viewpoints import LeftView, MirrorView, Viewpoint

__all__ = [
    "LAYERS",
    "DepthMarks",
    "LeftView",
    "MirrorView",
    "Scene",
    "Viewpoint",
    "compose_mirror",
    "compose_video",
    "put_mark",
    "sample_guides",
]
