"""From a rectified pair to a surface: matching, occlusion filling, reprojection."""

from navapp.stereo.chains import (
    MODEL_REFINEMENT,
    StereoAnswer,
    match_baseline,
    match_on_support,
    match_scene,
    match_surface,
    smoothed,
)
from navapp.stereo.coarse import are_swapped, match_coarsely
from navapp.stereo.health import PictureHealth, StereoHealth, measure_health
from navapp.stereo.subpixel.refine import RefineSettings, refine, refine_samples
from navapp.stereo.surface import reproject

__all__ = [
    "MODEL_REFINEMENT",
    "PictureHealth",
    "RefineSettings",
    "StereoAnswer",
    "StereoHealth",
    "are_swapped",
    "match_baseline",
    "match_coarsely",
    "match_on_support",
    "match_scene",
    "match_surface",
    "measure_health",
    "refine",
    "refine_samples",
    "reproject",
    "smoothed",
]
