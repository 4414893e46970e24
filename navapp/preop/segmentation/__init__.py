"""Segments a CT of the knee into named bones."""

from navapp.preop.segmentation.bone_naming import BONES
from navapp.preop.segmentation.knee_segmentation import (
    DEFAULT_THRESHOLD_HU,
    NO_SEEDS,
    Segmentation,
    segment,
)

__all__ = ["BONES", "DEFAULT_THRESHOLD_HU", "NO_SEEDS", "Segmentation", "segment"]
