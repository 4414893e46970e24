"""From the density of a CT to named bones."""

from navapp.preop.segmentation.naming import BONES
from navapp.preop.segmentation.segment import (
    DEFAULT_THRESHOLD_HU,
    NO_SEEDS,
    Segmentation,
    segment,
)

__all__ = ["BONES", "DEFAULT_THRESHOLD_HU", "NO_SEEDS", "Segmentation", "segment"]
