"""What stands in front of a bone at its pose: a hand, an instrument, tissue."""

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.box import Box
from navapp.geometry.halves import double, half_box
from navapp.geometry.rectification import RectifiedGeometry
from navapp.geometry.zbuffer import RenderedView
from navapp.tracking.foreground_kernels import vote_on_guesses
from navapp.values import DisparityMap, Foreground, Surroundings

# Nearer than the nearest bone within so many pixels, by so much: chosen on simulated knees
# (`python -m tests.bench.foreground`). A matching window hangs over the bone's rim by about as far.
NEAR_PX, IN_FRONT_MM = 4, 5.0


def find_foreground(
    surroundings: Surroundings,
    measured: DisparityMap,
    view: RenderedView,
    geometry: RectifiedGeometry,
) -> Foreground:
    """A bone's surroundings, and which of them stand in front of it.

    The bone's depth is taken in the resolution of the surroundings.

    Args:
        surroundings: filled, over a box around the bone.
        measured: what it has matched replaces the surroundings.
        view: of the bone at its pose, in the same rectified view.
        geometry: of the rectified pair.
    """
    box, is_half = surroundings.box, surroundings.is_half
    own = half_box(box) if is_half else box
    bone_px, at = _limit_px(view, geometry, is_half)
    here, there = own.shared_slices(at)
    limit_px = np.full((own.height, own.width), np.inf, dtype=np.float32)
    limit_px[here] = bone_px[there]
    is_in_front = surroundings.disparity_px > limit_px
    # Guesses follow what is matched beside them.
    vote_on_guesses(surroundings.picture, surroundings.is_matched, limit_px < np.inf, is_in_front)
    if is_half:
        is_in_front = double(is_in_front.view(np.uint8), box).view(np.bool_)
        limit_px = double(np.float32(2.0) * limit_px, box)
    here, there = box.shared_slices(measured.box)
    is_matched = measured.is_matched[there]
    marks, is_nearer = is_in_front[here], measured.disparity_px[there] > limit_px[here]
    marks ^= (marks ^ is_nearer) & is_matched
    return Foreground(surroundings, measured, is_in_front)


def _limit_px(
    view: RenderedView, geometry: RectifiedGeometry, is_half: bool
) -> tuple[NDArray[np.float32], Box]:
    """Disparity so far in front of the nearest bone around, infinite without any, and its box."""
    import cv2

    step, box = 2 if is_half else 1, view.box
    row, column = box.y % step, box.x % step
    depth_mm = view.depth_mm[row::step, column::step]
    limit_px = geometry.disparity_map_px(depth_mm - np.float32(IN_FRONT_MM)) / np.float32(step)
    if limit_px.size == 0:
        return limit_px, Box(0, 0, 0, 0)
    size = 2 * (NEAR_PX // step) + 1
    around_px = cv2.dilate(cv2.patchNaNs(limit_px, 0.0), np.ones((size, size), np.uint8))
    limit_px = np.where(around_px > 0.0, around_px, np.float32(np.inf))
    height, width = limit_px.shape
    return limit_px, Box((box.x + column) // step, (box.y + row) // step, width, height)
