"""Median flow: a box follows the median motion of a grid of points inside it.

Source: Kalal, Mikolajczyk, Matas, Forward-backward error: automatic detection of tracking failures
(ICPR 2010), the tracker of tracking-learning-detection.
"""

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.rectification import Image
from navapp.geometry.transform import FloatArray
from navapp.tracking.box.picture_box import PictureBox

# All chosen; px of the reduced picture. Points along either side, so far inside, and the window of
# each.
_GRID, _INSET_FRACTION, _WINDOW_PX = 12, 0.05, 9
# The motion is searched over so many halvings of the picture.
_LEVELS = 2
# Between two pictures the box moves by less than the larger of both.
_REACH_PX, _REACH_FRACTION = 16, 0.3
# A point is followed when, followed back, it is no further off, and when its windows look alike;
# so many of all points must be, and so many left of the better ones.
_BACK_PX, _LEAST_NCC = 1.0, 0.5
_LEAST_FRACTION, _LEAST_POINTS = 0.5, 6
# Points whose motions scatter by more than this fraction of the box follow different things.
_LARGEST_SCATTER = 0.08
# Pictures whose brightness differs by less stay as they are; every so many pixels tell it.
_SAME_LIGHT, _LIGHT_STRIDE_PX = 0.02, 4


def median_flow(before: Image, after: Image, box: PictureBox) -> PictureBox | None:
    """The box of a grey picture (H, W) in the next one; None when its points were not followed."""
    near = _reach(box.y, box.height), _reach(box.x, box.width)
    corner = np.array([near[1].start, near[0].start])
    before, after, box = before[near], _match_light(after, before)[near], box.move(-corner)
    inside = box.clip(before.shape[1], before.shape[0])
    if min(inside.width, inside.height) < _GRID:
        return None
    start = _grid(inside)
    end, is_there = _follow_points(before, after, start)
    back, is_back = _follow_points(after, before, end)
    error_px = np.linalg.norm(back - start, axis=1)
    ncc = _correlate(before, after, start, end)
    is_good = is_there & is_back & (error_px <= _BACK_PX) & (ncc >= _LEAST_NCC)
    if is_good.sum() < _LEAST_FRACTION * len(start):
        return None
    # The better half of them by either measure.
    is_good &= (error_px <= np.median(error_px[is_good])) & (ncc >= np.median(ncc[is_good]))
    if is_good.sum() < _LEAST_POINTS:
        return None
    moved = _move_box(box, start[is_good], end[is_good])
    return None if moved is None else moved.move(corner)


def _move_box(box: PictureBox, start: FloatArray, end: FloatArray) -> PictureBox | None:
    """The box moved and scaled by medians; None when the points disagree."""
    first, second = np.triu_indices(len(start), 1)
    length, length_after = (
        np.linalg.norm(points[first] - points[second], axis=1) for points in (start, end)
    )
    far = length > 1.0
    scale = float(np.median(length_after[far] / length[far]))
    shifts = end - box.centre - scale * (start - box.centre)
    shift: FloatArray = np.median(shifts, axis=0)
    scatter_px = float(np.median(np.linalg.norm(shifts - shift, axis=1)))
    if scatter_px > _LARGEST_SCATTER * max(box.width, box.height):
        return None
    return box.move(shift, scale)


def _grid(box: PictureBox) -> FloatArray:
    """(N, 2) points in a box; on its very side they would see as much of what lies around it."""
    along = np.linspace(_INSET_FRACTION, 1.0 - _INSET_FRACTION, _GRID)
    columns, rows = np.meshgrid(box.x + along * box.width, box.y + along * box.height)
    return np.column_stack([columns.ravel(), rows.ravel()])


def _reach(first: float, length: float) -> slice:
    """Rows or columns of a picture that one side of a box can move in."""
    reach = max(_REACH_PX, _REACH_FRACTION * length)
    return slice(max(0, int(first - reach)), max(0, int(first + length + reach) + 1))


def _match_light(picture: Image, other: Image) -> Image:
    """A picture as bright as another one: points are followed by their brightness.

    By the median over pixels, which a hand that comes does not change.
    """
    import cv2

    sparse = np.s_[::_LIGHT_STRIDE_PX, ::_LIGHT_STRIDE_PX]
    gain = float(np.median((other[sparse] + 1.0) / (picture[sparse] + 1.0)))
    if abs(gain - 1.0) < _SAME_LIGHT:
        return picture
    return np.asarray(cv2.convertScaleAbs(picture, alpha=gain), dtype=np.uint8)


def _follow_points(
    before: Image, after: Image, points: FloatArray
) -> tuple[FloatArray, NDArray[np.bool_]]:
    import cv2

    start = points.astype(np.float32).reshape(-1, 1, 2)
    size = (_WINDOW_PX, _WINDOW_PX)
    end, is_there, _ = cv2.calcOpticalFlowPyrLK(
        before, after, start, np.empty_like(start), winSize=size, maxLevel=_LEVELS
    )
    return end.reshape(-1, 2).astype(np.float64), is_there.ravel() > 0


def _correlate(before: Image, after: Image, start: FloatArray, end: FloatArray) -> FloatArray:
    """(N,) normalised correlation of the windows around both places of every point."""
    first, second = _windows(before, start), _windows(after, end)
    norms = np.linalg.norm(first, axis=1) * np.linalg.norm(second, axis=1)
    correlation: FloatArray = (first * second).sum(axis=1) / np.maximum(norms, 1e-6)
    return correlation


def _windows(picture: Image, points: FloatArray) -> FloatArray:
    """(N, window) grey values around every point, without their mean."""
    import cv2

    reach = np.arange(_WINDOW_PX) - _WINDOW_PX // 2
    dx, dy = (offset.ravel() for offset in np.meshgrid(reach, reach))
    columns = (points[:, :1] + dx).astype(np.float32)
    rows = (points[:, 1:] + dy).astype(np.float32)
    values = cv2.remap(picture, columns, rows, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    windows = values.astype(np.float64)
    centred: FloatArray = windows - windows.mean(axis=1, keepdims=True)
    return centred
