"""Measured depth, pixel by pixel, for scores that look poses up in it."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.rectification import RectifiedGeometry
from navapp.registration.initial_kernels import Optics
from navapp.values import DisparityMap, Origin


@dataclass(frozen=True, slots=True, eq=False)
class DepthMap:
    """Measured depth.

    Attributes:
        depth_mm: (h, w); 0 where unknown.
        optics: of its pixels.
    """

    depth_mm: NDArray[np.float32]
    optics: Optics

    @classmethod
    def of(cls, geometry: RectifiedGeometry, found: DisparityMap) -> Self:
        """The matched pixels of a map of disparity in a rectified pair."""
        is_known = (found.origin == Origin.MATCHED) & (found.disparity_px > 0.0)
        depth_mm = np.zeros(found.disparity_px.shape, dtype=np.float32)
        scale = geometry.focal_px * geometry.baseline_mm
        np.divide(scale, found.disparity_px, out=depth_mm, where=is_known)
        centre = geometry.centre_x_px - found.x, geometry.centre_y_px - found.y
        return cls(depth_mm, Optics(geometry.focal_px, *centre, geometry.baseline_mm))
