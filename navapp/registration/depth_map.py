"""Measured depth, and the camera of a scaled or cut picture, as compiled scores read them."""

from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.rectification import RectifiedGeometry
from navapp.values import DisparityMap


class Optics(NamedTuple):
    """Focal length and centre in pixels of a scaled or cut rectified picture, and the baseline."""

    focal_px: float
    centre_x_px: float
    centre_y_px: float
    baseline_mm: float


class DepthMap(NamedTuple):
    """Measured depth (h, w), 0 where unknown, and the optics of its pixels."""

    depth_mm: NDArray[np.float32]
    optics: Optics

    @classmethod
    def of(cls, geometry: RectifiedGeometry, found: DisparityMap) -> Self:
        """The matched pixels of a map of disparity in a rectified pair."""
        is_known = found.is_matched & (found.disparity_px > 0.0)
        depth_mm = np.zeros(found.disparity_px.shape, dtype=np.float32)
        scale = geometry.focal_px * geometry.baseline_mm
        np.divide(scale, found.disparity_px, out=depth_mm, where=is_known)
        centre_px = geometry.centre_x_px - found.x, geometry.centre_y_px - found.y
        return cls(depth_mm, Optics(geometry.focal_px, *centre_px, geometry.baseline_mm))


def scale_optics(geometry: RectifiedGeometry, scale: int) -> Optics:
    """Optics of pictures made `scale` times smaller: u' = (u + 0.5) / scale - 0.5."""
    return Optics(
        geometry.focal_px / scale,
        (geometry.centre_x_px + 0.5) / scale - 0.5,
        (geometry.centre_y_px + 0.5) / scale - 0.5,
        geometry.baseline_mm,
    )
