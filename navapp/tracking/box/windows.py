"""What boxes look like: small windows in nine parts, compared part by part."""

import math

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.rectification import Image
from navapp.tracking.box.picture_box import PictureBox

# (n, parts, values + 2) what n boxes look like. Of every part the grey values without their mean
# and of unit length, zeros where it is flat; then the logarithms of their mean and deviation.
Descriptors = NDArray[np.float32]

# All chosen. A box is looked at as so many pixels square, in parts that overlap a little.
SIZE_PX, PART_PX, _STEP_PX = 26, 10, 8
ORIGINS = [(y, x) for y in range(0, 17, _STEP_PX) for x in range(0, 17, _STEP_PX)]
# A part whose grey values deviate by less is flat (sensor noise of the reduced picture is about a
# half).
LEAST_DEVIATION = 2.5
# Parts of the bone become brighter together: means and deviations within these (log), which leave
# room for its turning under the lamps.
_SAME_MEAN, _SAME_DEVIATION = 0.35, 0.6


def compute_similarity(one: Descriptors, others: Descriptors) -> float:
    """Mean correlation of the parts of one box with those of the nearest of others, 0 to 1.

    Parts count that agree on how much brighter or darker all has become.
    """
    correlation = np.maximum((one[..., :-2] * others[..., :-2]).sum(axis=2), 0.0)
    mean, deviation = np.moveaxis(one[..., -2:] - others[..., -2:], 2, 0)
    # How much brighter one part has become is tried on all: (n, parts that say it, parts). Contrast
    # grows with brightness, so deviations are held against the same.
    is_same = np.abs(mean[:, None] - mean[:, :, None]) < _SAME_MEAN
    is_same &= np.abs(deviation[:, None] - mean[:, :, None]) < _SAME_DEVIATION
    return float((is_same * correlation[:, None]).mean(axis=2).max())


def describe_box(picture: Image, box: PictureBox) -> Descriptors:
    """(1, parts, values + 2) what a box looks like."""
    window = _cut_window(picture, box)
    parts = np.stack([window[y : y + PART_PX, x : x + PART_PX].ravel() for y, x in ORIGINS])
    mean = parts.mean(axis=1, keepdims=True)
    parts = parts - mean
    length = np.linalg.norm(parts, axis=1, keepdims=True)
    is_flat = length < LEAST_DEVIATION * PART_PX
    unit = np.where(is_flat, 0.0, parts / np.maximum(length, 1e-6))
    deviation = np.maximum(length / PART_PX, LEAST_DEVIATION)
    light = np.log(np.hstack([np.maximum(mean, 1.0), deviation]))
    return np.hstack([unit, light]).astype(np.float32)[None]


def _cut_window(picture: Image, box: PictureBox) -> NDArray[np.float32]:
    """(size, size) of a box, however large; the picture's rim goes on beyond it."""
    import cv2

    scale_x, scale_y = box.width / SIZE_PX, box.height / SIZE_PX
    x0, y0 = max(0, math.floor(box.x - 4)), max(0, math.floor(box.y - 4))
    x1, y1 = math.ceil(box.x + box.width + 5), math.ceil(box.y + box.height + 5)
    part = picture[y0 : max(0, y1), x0 : max(0, x1)].astype(np.float32)
    if min(part.shape) < 2:
        return np.zeros((SIZE_PX, SIZE_PX), np.float32)
    # Blurred as by resizing a whole picture, which is the mean of the pixels that become one.
    sigma_x, sigma_y = (
        0.5 * math.sqrt(max(scale * scale - 1.0, 1e-3)) for scale in (scale_x, scale_y)
    )
    part = np.asarray(cv2.GaussianBlur(part, (0, 0), sigma_x, sigmaY=sigma_y))
    corner_x, corner_y = box.x - x0 + 0.5 * scale_x, box.y - y0 + 0.5 * scale_y
    matrix = np.array([[scale_x, 0.0, corner_x], [0.0, scale_y, corner_y]])
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    window = cv2.warpAffine(
        part, matrix, (SIZE_PX, SIZE_PX), flags=flags, borderMode=cv2.BORDER_REPLICATE
    )
    return np.asarray(window, dtype=np.float32)
