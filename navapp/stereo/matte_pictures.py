"""Pictures without highlights: what a wet face mirrors of a lamp is white, and moves with the eye.

On a sawn face that mirrors a lamp the two cameras see glints in different places, and match the
face beside where it is (`python -m tests.bench.face_highlights`). Light that is mirrored has the
lamp's colour, light from within the bone has the bone's own. In pictures whose white is the lamp's,
red less blue holds nothing of what is mirrored. Where a channel is clipped it means nothing: such
pixels are filled from those around them, so that the windows beside them keep their texture.

Source: the dichromatic model of reflection, Shafer 1985.
"""

from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.rectification import Image, RectifiedPair

# All chosen. This share of the pixels asked for has values up to this one.
_MOST_SHARE, _MOST_VALUE = 0.99, 230.0
# Of linear light, 0 to 1: with less colour there is more noise than texture.
_LEAST_DIFFERENCE = 0.02
# Values from here on may be clipped.
_CLIPPED = 254
# Of the weights by which clipped pixels are filled (standard deviation).
_FILL_PX = 2.0
_LEAST_WEIGHT = 1e-3


def make_matte_pair(
    pair: RectifiedPair, is_asked: NDArray[np.bool_], blue: float = 1.0
) -> RectifiedPair | None:
    """Both pictures as red less blue, (H, W) uint8; None without colour.

    Args:
        pair: BGR in the tone curve of sRGB, or grey.
        is_asked: (h, w) pixels of its box that set the range of values.
        blue: weight of blue: red over blue of the lamp's light in these pictures.
    """
    if pair.left.ndim != 3 or not is_asked.any():
        return None
    left, right = (_red_less_blue(picture, blue) for picture in (pair.left, pair.right))
    most = float(np.quantile(left[pair.box.slices][is_asked], _MOST_SHARE))
    if most < _LEAST_DIFFERENCE:
        return None
    gain = _MOST_VALUE / most
    return replace(pair, left=_scale(left, gain), right=_scale(right, gain))


def find_clipped(picture: Image) -> NDArray[np.bool_]:
    """(H, W) pixels of which a channel is clipped."""
    is_clipped = picture >= _CLIPPED
    return np.asarray(is_clipped if picture.ndim == 2 else is_clipped.any(axis=2))


def _red_less_blue(picture: Image, blue: float) -> NDArray[np.float32]:
    import cv2

    light = _light_of_value()
    red, less = light[picture[:, :, 2]], np.float32(blue) * light[picture[:, :, 0]]
    # Resampling has mixed clipped pixels into their neighbours.
    is_mixed = cv2.dilate(find_clipped(picture).astype(np.uint8), np.ones((3, 3), np.uint8)) > 0
    return _fill(red - less, is_mixed)


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


def _scale(difference: NDArray[np.float32], gain: float) -> Image:
    scaled = np.clip(np.rint(gain * difference), 0.0, 255.0)
    return np.asarray(scaled, dtype=np.uint8)


@lru_cache(maxsize=1)
def _light_of_value() -> NDArray[np.float32]:
    """(256,) linear light of a value (IEC 61966-2-1)."""
    value = np.arange(256) / 255.0
    light = np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)
    return light.astype(np.float32)
