"""Pictures without highlights: what a wet face mirrors of a lamp is white, and moves with the eye.

On a sawn face that mirrors a lamp the two cameras see glints in different places, and match the
face beside where it is (`python -m tests.bench.face_highlights`). Light that is mirrored has the
lamp's colour, light from within the bone has the bone's own. In pictures whose white is the lamp's,
red less blue holds nothing of what is mirrored. Where a channel is clipped it means nothing: such
pixels are filled from those around them, so that the windows beside them keep their texture.

Source: the dichromatic model of reflection, Shafer 1985.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.masks import grow
from navapp.geometry.rectification import Image, RectifiedPair

# All chosen. This share of the pixels asked for has values up to this one.
_MOST_SHARE, _MOST_VALUE = 0.99, 230.0
# Of linear light, 0 to 1: with less colour there is more noise than texture.
_LEAST_DIFFERENCE = 0.02
# Values from here on may be clipped.
_CLIPPED = 254
# Pixels so far from a clipped one are resampled from it: they are filled too.
RESAMPLED_REACH_PX = 1
# Of the weights by which clipped pixels are filled (standard deviation).
_FILL_PX = 2.0
_LEAST_WEIGHT = 1e-3
# Windows reach beyond a box, which follows the bone by a few pixels.
_AROUND_PX = 24
# (256,) linear light of a value (IEC 61966-2-1).
_VALUE = np.arange(256) / 255.0
_LIGHT_OF_VALUE = np.where(
    _VALUE <= 0.04045, _VALUE / 12.92, ((_VALUE + 0.055) / 1.055) ** 2.4
).astype(np.float32)


def make_matte_pair(
    pair: RectifiedPair, is_asked: NDArray[np.bool_], blue: float = 1.0
) -> RectifiedPair | None:
    """Both pictures as red less blue, (H, W) uint8; None without colour.

    Only in the rows of its box, and some around it; the other rows are 0.

    Args:
        pair: BGR in the tone curve of sRGB, or grey.
        is_asked: (h, w) pixels of its box that set the range of values.
        blue: weight of blue: red over blue of the lamp's light in these pictures.
    """
    import cv2

    if pair.left.ndim != 3 or not is_asked.any():
        return None
    box = pair.box
    first, last = max(box.y - _AROUND_PX, 0), box.y + box.height + _AROUND_PX
    left, right = (_red_less_blue(one[first:last], blue) for one in (pair.left, pair.right))
    inside = left[box.y - first :, box.x :][: box.height, : box.width]
    most = float(np.quantile(inside[is_asked], _MOST_SHARE))
    if most < _LEAST_DIFFERENCE:
        return None
    gain = _MOST_VALUE / most
    pictures = np.zeros((2, *pair.left.shape[:2]), dtype=np.uint8)
    for picture, difference in zip(pictures, (left, right), strict=True):
        # Rounds, and clips to what fits.
        picture[first:last] = cv2.convertScaleAbs(np.maximum(difference, 0.0), alpha=gain)
    return replace(pair, left=pictures[0], right=pictures[1])


def find_near_clipped(picture: Image, reach_px: int) -> NDArray[np.bool_]:
    """(H, W) pixels that are clipped, or up to so far (rows, columns) from one that is."""
    return grow(find_clipped(picture), reach_px)


def find_clipped(picture: Image) -> NDArray[np.bool_]:
    """(H, W) pixels of which a channel is clipped."""
    if picture.ndim == 2:
        return np.asarray(picture >= _CLIPPED)
    blue, green, red = (picture[:, :, channel] >= _CLIPPED for channel in range(3))
    return np.asarray(blue | green | red)


def _red_less_blue(picture: Image, blue: float) -> NDArray[np.float32]:
    import cv2

    red, less = (cv2.LUT(picture[:, :, channel], _LIGHT_OF_VALUE) for channel in (2, 0))
    is_unknown = find_near_clipped(picture, RESAMPLED_REACH_PX)
    return _fill(np.asarray(red - np.float32(blue) * less), is_unknown)


def _fill(values: NDArray[np.float32], is_unknown: NDArray[np.bool_]) -> NDArray[np.float32]:
    """Values (H, W), unknown ones as the weighted mean of those around; 0 where none is near."""
    import cv2

    if not is_unknown.any():
        return values
    weight = (~is_unknown).astype(np.float32)
    around = cv2.GaussianBlur(values * weight, (0, 0), _FILL_PX)
    total = cv2.GaussianBlur(weight, (0, 0), _FILL_PX)
    filled = around / np.maximum(total, np.float32(_LEAST_WEIGHT))
    return np.where(is_unknown, filled, values).astype(np.float32)
