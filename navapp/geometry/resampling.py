"""Pictures at real places: what a rectified pixel sees in the picture that was taken."""

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.bands import in_row_bands
from navapp.geometry.box import Box
from navapp.geometry.float_lane_kernels import LANES, lanes_for
from navapp.geometry.rectification import TAPS_PX, Image
from navapp.geometry.resample_kernels import Places, resample_rows


def luma_for(picture: Image, places: Places, part: Box) -> Image:
    """The grey picture where a part of its rectified one asks for it; anything elsewhere."""
    import cv2

    if picture.ndim == 2:
        return picture
    grey = np.empty(picture.shape[:2], dtype=np.uint8)
    asked = _reached(places, part)
    if not asked.is_empty:
        rows, columns = (
            slice(asked.y, asked.y + asked.height),
            slice(asked.x, asked.x + asked.width),
        )
        cv2.cvtColor(picture[rows, columns], cv2.COLOR_BGR2GRAY, dst=grey[rows, columns])
    return grey


def _reached(places: Places, part: Box) -> Box:
    """What of the other picture a part of the rectified one is made of."""
    height, width = places.columns.shape
    inside = part.clipped(width, height)
    if inside.is_empty:
        return inside
    low, high = inside.y, inside.y + inside.height - 1
    # Columns grow along a row, but for a lens that folds the picture's ends.
    ends = [places.columns[low : high + 1, x] for x in (inside.x, inside.x + inside.width - 1)]
    begin, end = min(column.min() for column in ends), max(column.max() for column in ends)
    first, last = np.clip([begin - TAPS_PX, end + TAPS_PX], 0, width - 1).astype(int)
    curves = places.rows[[low, high], first : last + 1]
    top, bottom = np.clip([curves.min() - TAPS_PX, curves.max() + TAPS_PX], 0, height - 1).astype(
        int
    )
    return Box(int(first), int(top), int(last - first + 1), int(bottom - top + 1))


def find_places(columns: NDArray[np.float32], rows: NDArray[np.float32]) -> Places:
    """Where to look for pixels (h, w), from smooth maps of both coordinates; columns grow in them.

    The other picture has the same size.
    """
    height, width = columns.shape
    at = np.arange(width)
    crossings = np.empty((height, width), dtype=np.float32)
    for y in range(height):
        # Interpolation looks beyond either end.
        reached, found = (np.pad(line[y], 1, _goes_on) for line in (columns, rows))
        crossings[y] = np.interp(at, np.maximum.accumulate(reached), found)
    is_inside = (rows >= 0.0).all(axis=1) & (rows <= height - 1.0).all(axis=1)
    steps = _blocks(np.floor(columns) - at.astype(np.float32))
    lines = _blocks(np.floor(crossings))
    in_step = ((steps == steps[..., :1]) | (steps == steps[..., -1:])).all(axis=2)
    in_row = (lines == lines[..., :1]).all(axis=2)
    return Places(np.ascontiguousarray(columns), crossings, in_step, in_row, is_inside)


def _goes_on(line: NDArray[np.float32], *_: object) -> None:
    """Straight on at either end of a line, by so many pixels as interpolation asks for."""
    line[0] = line[1] + TAPS_PX * (line[1] - line[2])
    line[-1] = line[-2] + TAPS_PX * (line[-2] - line[-3])


def _blocks(values: NDArray[np.float32]) -> NDArray[np.float32]:
    """(h, blocks, LANES) of (h, w); a cut block is filled up with numbers that are not the same."""
    height, width = values.shape
    full = np.full((height, lanes_for(width)), np.nan, dtype=np.float32)
    full[:, :width] = values
    return full.reshape(height, -1, LANES)


def resampled(picture: Image, places: Places, part: Box | None = None) -> Image:
    """The picture at real places (h, w), cubic over six pixels; 0 outside it, and outside a part.

    Linear interpolation, and less so a cubic over four pixels, blurs by where a pixel falls;
    OpenCV's cubic (a = -0.75) bends a ramp: all tilt a disparity that is measured to a part of a
    pixel.
    """
    if picture.ndim == 3:
        return np.dstack([resampled(picture[..., k], places, part) for k in range(3)])
    picture = np.ascontiguousarray(picture)
    values = np.zeros(places.columns.shape, dtype=np.uint8)
    height, width = places.columns.shape
    inside = Box(0, 0, width, height) if part is None else part.clipped(width, height)
    if inside.is_empty:
        return values
    top, span = inside.y, (inside.x, inside.x + inside.width)
    in_row_bands(
        inside.height,
        lambda first, last: resample_rows(picture, places, (top + first, top + last), span, values),
    )
    return values
