"""Median flow: a box follows the median motion of a grid of points inside it.

Source: Kalal, Mikolajczyk, Matas, Forward-backward error: automatic detection of tracking failures
(ICPR 2010), the tracker of tracking-learning-detection.
"""

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.transform import FloatArray
from navapp.tracking.box.picture_box import PictureBox

Grey = NDArray[np.uint8]

_GRID = 12
# Points on the very side see as much of the surroundings as of the box.
_INSET_SHARE = 0.05
# The box moves by less between two pictures.
_REACH_PX, _REACH_SHARE = 16, 0.3
_WINDOW_PX = 9
_LEVELS = 2
# A point that does not come back to within this is not followed (a pixel of the reduced picture);
# half of them must be.
_BACK_PX = 1.0
_LEAST_NCC = 0.5
# Followed points whose motions scatter by more than this share of the box follow different things.
_LARGEST_SCATTER = 0.08
_LEAST_POINTS = 12
# Pictures whose brightness differs by less are left as they are.
_SAME_LIGHT = 0.02
_THINNED = 4


def median_flow(before: Grey, after: Grey, box: PictureBox) -> PictureBox | None:
    """The box in the next picture; None when its points were not followed.

    Args:
        before: (H, W) grey picture.
        after: the next one, of the same size.
        box: in the first one.
    """
    around = _around(box, before.shape)
    after = _match_light(after, before)[around]
    before = before[around]
    corner = np.array([around[1].start, around[0].start])
    near = _flow(before, after, box.move(-corner))
    return None if near is None else near.move(corner)


def _flow(before: Grey, after: Grey, box: PictureBox) -> PictureBox | None:
    start = _grid(box, before.shape)
    if len(start) < _LEAST_POINTS:
        return None
    end, is_there = _follow_points(before, after, start)
    back, is_back = _follow_points(after, before, end)
    error_px = np.linalg.norm(back - start, axis=1)
    ncc = _ncc(before, after, start, end)
    is_good = is_there & is_back & (error_px <= _BACK_PX) & (ncc >= _LEAST_NCC)
    if is_good.sum() < max(_LEAST_POINTS, 0.5 * len(start)):
        return None
    # The better half of them by either measure.
    is_good &= (error_px <= np.median(error_px[is_good])) & (ncc >= np.median(ncc[is_good]))
    if is_good.sum() < _LEAST_POINTS // 2:
        return None
    return _move_box(box, start[is_good], end[is_good])


def _move_box(box: PictureBox, start: FloatArray, end: FloatArray) -> PictureBox | None:
    """The box moved and scaled by medians; None when the points disagree."""
    first, second = np.triu_indices(len(start), 1)
    length, length_after = (
        np.linalg.norm(points[first] - points[second], axis=1) for points in (start, end)
    )
    far = length > 1.0
    scale = float(np.median(length_after[far] / length[far])) if far.any() else 1.0
    middle = box.centre
    shifts = end - middle - scale * (start - middle)
    shift: FloatArray = np.median(shifts, axis=0)
    scatter_px = float(np.median(np.linalg.norm(shifts - shift, axis=1)))
    if scatter_px > _LARGEST_SCATTER * max(box.width, box.height):
        return None
    return box.move(shift, scale)


def _grid(box: PictureBox, shape: tuple[int, ...]) -> FloatArray:
    """(N, 2) points of the part of the box that lies inside the picture."""
    inside = box.clip(shape[1], shape[0])
    share = np.linspace(_INSET_SHARE, 1.0 - _INSET_SHARE, _GRID)
    if inside.width < _GRID or inside.height < _GRID:
        return np.empty((0, 2))
    columns, rows = np.meshgrid(inside.x + share * inside.width, inside.y + share * inside.height)
    return np.column_stack([columns.ravel(), rows.ravel()])


def _around(box: PictureBox, shape: tuple[int, ...]) -> tuple[slice, slice]:
    """Rows and columns of the part of a picture that a box can move in."""
    reach_x, reach_y = (max(_REACH_PX, _REACH_SHARE * side) for side in (box.width, box.height))
    rows, columns = (
        slice(max(0, int(low - reach)), min(size, max(0, int(low + side + reach) + 1)))
        for low, side, reach, size in (
            (box.y, box.height, reach_y, shape[0]),
            (box.x, box.width, reach_x, shape[1]),
        )
    )
    return rows, columns


def _match_light(picture: Grey, other: Grey) -> Grey:
    """A picture as bright as another one: points are followed by their brightness.

    By the median over pixels, which a hand that comes does not change.
    """
    import cv2

    some, others = (one[::_THINNED, ::_THINNED].astype(np.float64) for one in (picture, other))
    gain = float(np.median((others + 1.0) / (some + 1.0)))
    if abs(gain - 1.0) < _SAME_LIGHT:
        return picture
    return np.asarray(cv2.convertScaleAbs(picture, alpha=gain), dtype=np.uint8)


def _follow_points(
    before: Grey, after: Grey, points: FloatArray
) -> tuple[FloatArray, NDArray[np.bool_]]:
    import cv2

    start = points.astype(np.float32).reshape(-1, 1, 2)
    end, is_there, _ = cv2.calcOpticalFlowPyrLK(
        before,
        after,
        start,
        np.empty_like(start),
        winSize=(_WINDOW_PX, _WINDOW_PX),
        maxLevel=_LEVELS,
    )
    return end.reshape(-1, 2).astype(np.float64), is_there.ravel() > 0


def _ncc(before: Grey, after: Grey, start: FloatArray, end: FloatArray) -> FloatArray:
    """(N,) normalised correlation of the windows around both places of every point."""
    first, second = _windows(before, start), _windows(after, end)
    norms = np.linalg.norm(first, axis=1) * np.linalg.norm(second, axis=1)
    correlation: FloatArray = (first * second).sum(axis=1) / np.maximum(norms, 1e-6)
    return correlation


def _windows(picture: Grey, points: FloatArray) -> FloatArray:
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
