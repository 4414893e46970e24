"""From a rectified pair to a surface: matching, occlusion filling, reprojection."""

from navapp.stereo.chains import (
    StereoAnswer,
    match_baseline,
    match_on_support,
    match_scene,
    match_surface,
)
from navapp.stereo.coarse import CoarseMap, are_swapped, find_near_clipped, match_coarsely
from navapp.stereo.health import PictureHealth, StereoHealth, measure_health
from navapp.stereo.subpixel.refine import (
    MODEL_REFINEMENT,
    RefineSettings,
    refine,
    refine_on_model,
    refine_samples,
)
from navapp.stereo.surroundings import NearerSearch, fill_surroundings, match_nearer

__all__ = [
    "MODEL_REFINEMENT",
    "CoarseMap",
    "NearerSearch",
    "PictureHealth",
    "RefineSettings",
    "StereoAnswer",
    "StereoHealth",
    "are_swapped",
    "fill_surroundings",
    "find_near_clipped",
    "match_baseline",
    "match_coarsely",
    "match_nearer",
    "match_on_support",
    "match_scene",
    "match_surface",
    "measure_health",
    "refine",
    "refine_on_model",
    "refine_samples",
]
