"""From a rectified pair to a surface: matching, occlusion filling, reprojection."""

from navapp.stereo.chains import match_baseline, match_on_support, match_scene, match_surface
from navapp.stereo.coarse import CLIPPED_REACH_PX, CoarseMap, are_swapped, match_coarsely
from navapp.stereo.health import StereoHealth, measure_health
from navapp.stereo.matte_pictures import find_near_clipped
from navapp.stereo.subpixel.refine import MODEL_REFINEMENT, refine, refine_on_model
from navapp.stereo.surroundings import NearerSearch, fill_surroundings, match_nearer

__all__ = [
    "CLIPPED_REACH_PX",
    "MODEL_REFINEMENT",
    "CoarseMap",
    "NearerSearch",
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
]
