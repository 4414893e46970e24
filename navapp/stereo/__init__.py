"""From a rectified pair to a surface: matching, occlusion filling, reprojection."""

from navapp.stereo.fill import fill_occlusions
from navapp.stereo.refine import RefineSettings, refine
from navapp.stereo.sgbm import SgbmSettings, match_sgbm
from navapp.stereo.surface import reproject

__all__ = [
    "RefineSettings",
    "SgbmSettings",
    "fill_occlusions",
    "match_sgbm",
    "refine",
    "reproject",
]
