"""What stands in front of a bone at its pose: a hand, an instrument, tissue."""

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.rectification import RectifiedGeometry
from navapp.geometry.zbuffer import RenderedView
from navapp.values import DisparityMap, Foreground

# Nearer than the nearest bone within so many pixels, by so much: chosen on simulated knees
# (`python -m tests.bench.foreground`). A matching window hangs over the bone's rim by about as far.
NEAR_PX, IN_FRONT_MM = 4, 5.0


def find_foreground(
    surroundings: DisparityMap,
    view: RenderedView,
    geometry: RectifiedGeometry,
    near_px: int = NEAR_PX,
    in_front_mm: float = IN_FRONT_MM,
) -> Foreground:
    """Which of a bone's surroundings stand in front of it.

    Args:
        surroundings: filled, over a box around the bone.
        view: of the bone at its pose, in the same rectified view.
        geometry: of the rectified pair.
        near_px: the nearest bone within so many pixels counts ...
        in_front_mm: ... and what is nearer by so much.
    """
    both = view.box.intersect(surroundings.box)
    there, in_view = (both.relative_to(box).slices for box in (surroundings.box, view.box))
    near_mm = _nearest_bone_mm(view.depth_mm, near_px)[in_view]
    limit_px = geometry.disparity_map_px(near_mm - in_front_mm)
    is_in_front = np.zeros(surroundings.disparity_px.shape, dtype=np.bool_)
    is_in_front[there] = (surroundings.disparity_px[there] > limit_px) & np.isfinite(near_mm)
    return Foreground(surroundings, is_in_front)


def _nearest_bone_mm(depth_mm: NDArray[np.float32], near_px: int) -> NDArray[np.float32]:
    """(h, w) depth of the nearest bone within some pixels, from its depth; infinite without any."""
    import cv2

    depth_mm = np.where(np.isnan(depth_mm), np.float32(np.inf), depth_mm)
    size = (2 * near_px + 1, 2 * near_px + 1)
    # OpenCV's own border is the largest finite number.
    around = cv2.erode(depth_mm, np.ones(size, np.uint8), borderType=cv2.BORDER_REPLICATE)
    return np.asarray(around, dtype=np.float32)
