"""What stands in front of a bone at its pose: a hand, an instrument, tissue."""

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.box import Box
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
    near_mm = _nearest_bone_mm(_render_over(view, surroundings.box), near_px)
    is_bone = np.isfinite(near_mm)
    limit_px = geometry.disparity_map_px(np.where(is_bone, near_mm - in_front_mm, np.nan))
    return Foreground(surroundings, surroundings.disparity_px > limit_px)


def _nearest_bone_mm(depth_mm: NDArray[np.float32], near_px: int) -> NDArray[np.float32]:
    """(h, w) depth of the nearest bone within some pixels, from its depth; infinite without any."""
    import cv2

    depth_mm = np.where(np.isnan(depth_mm), np.float32(np.inf), depth_mm)
    size = (2 * near_px + 1, 2 * near_px + 1)
    # OpenCV's own border is the largest finite number.
    around = cv2.erode(depth_mm, np.ones(size, np.uint8), borderType=cv2.BORDER_REPLICATE)
    return np.asarray(around, dtype=np.float32)


def _render_over(view: RenderedView, box: Box) -> NDArray[np.float32]:
    """(h, w) depth of a rendered view over another box; NaN beyond the view's."""
    depth_mm = np.full((box.height, box.width), np.nan, dtype=np.float32)
    x, y = view.box.x - box.x, view.box.y - box.y
    height, width = view.depth_mm.shape
    inside = Box(x, y, width, height).clip(box.width, box.height)
    source = Box(inside.x - x, inside.y - y, inside.width, inside.height)
    depth_mm[inside.slices] = view.depth_mm[source.slices]
    return depth_mm
