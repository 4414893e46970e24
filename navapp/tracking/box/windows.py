"""What boxes look like: small windows in nine parts, compared part by part."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from navapp.tracking.box.median_flow import Grey
from navapp.tracking.box.picture_box import PictureBox

FloatPicture = NDArray[np.float32]

# A box is looked at as so many pixels square, in parts that overlap a little.
SIZE_PX, PART_PX, _STEP_PX = 26, 10, 8
ORIGINS = [(y, x) for y in range(0, 17, _STEP_PX) for x in range(0, 17, _STEP_PX)]
# A part whose grey values deviate by less shows nothing (sensor noise of the reduced picture is
# about a half).
LEAST_DEVIATION = 2.5
# Parts of the bone become brighter together: means and deviations within these factors (log), which
# leave room for its turning under the lamps.
_SAME_MEAN, _SAME_DEVIATION = 0.35, 0.6


@dataclass(frozen=True, slots=True, eq=False)
class Windows:
    """What boxes look like, part by part.

    Attributes:
        parts: (n, parts, values) without their mean and of unit length; zeros where one is flat.
        light: (n, parts, 2) logarithms of the mean and of the deviation of the grey values.
    """

    parts: FloatPicture
    light: FloatPicture

    def __len__(self) -> int:
        return len(self.parts)

    def select(self, which: slice) -> "Windows":
        """Some of them."""
        return Windows(self.parts[which], self.light[which])

    def similarity(self, window: "Windows") -> float:
        """Mean correlation of the parts of one window with those of the nearest; 0 without any.

        Parts count that agree on how much brighter or darker all has become.
        """
        if len(self) == 0:
            return 0.0
        agreement = np.maximum((window.parts * self.parts).sum(axis=2), 0.0)
        brighter = window.light - self.light
        # Every part's opinion is tried; (n, opinions, parts).
        mean_off = np.abs(brighter[:, None, :, 0] - brighter[:, :, None, 0])
        deviation_off = np.abs(brighter[:, None, :, 1] - brighter[:, :, None, 0])
        is_one = (mean_off < _SAME_MEAN) & (deviation_off < _SAME_DEVIATION)
        agreed = (is_one * agreement[:, None]).mean(axis=2)
        return float(agreed.max())


def joined(windows: Sequence[Windows]) -> Windows:
    """All of them, in order."""
    return Windows(
        np.concatenate([some.parts for some in windows]),
        np.concatenate([some.light for some in windows]),
    )


def _window(picture: Grey, box: PictureBox) -> FloatPicture:
    """(size, size) of a box, however large; the picture's rim goes on beyond it."""
    import cv2

    scale = np.array([box.width, box.height]) / SIZE_PX
    # Blurred as by the resizing of a whole picture, which takes the mean of what falls together.
    sigma = 0.5 * np.sqrt(np.maximum(scale**2 - 1.0, 1e-3))
    low = np.floor([box.x - 4, box.y - 4]).astype(int)
    high = np.ceil([box.x + box.width + 5, box.y + box.height + 5]).astype(int)
    (x0, y0), (x1, y1) = np.clip(low, 0, None), np.minimum(high, picture.shape[::-1])
    if x1 - x0 < 2 or y1 - y0 < 2:
        return np.zeros((SIZE_PX, SIZE_PX), np.float32)
    part = picture[y0:y1, x0:x1].astype(np.float32)
    part = np.asarray(cv2.GaussianBlur(part, (0, 0), float(sigma[0]), sigmaY=float(sigma[1])))
    matrix = np.array(
        [
            [scale[0], 0.0, box.x - x0 + 0.5 * scale[0]],
            [0.0, scale[1], box.y - y0 + 0.5 * scale[1]],
        ]
    )
    window = cv2.warpAffine(
        part,
        matrix,
        (SIZE_PX, SIZE_PX),
        flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
        borderMode=cv2.BORDER_REPLICATE,
    )
    return np.asarray(window, dtype=np.float32)


def seen(picture: Grey, box: PictureBox) -> Windows:
    """What a box looks like, as one of `Windows`."""
    window = _window(picture, box)
    parts = np.stack([window[y : y + PART_PX, x : x + PART_PX].ravel() for y, x in ORIGINS])
    mean = parts.mean(axis=1, keepdims=True)
    parts = parts - mean
    length = np.linalg.norm(parts, axis=1, keepdims=True)
    deviation = np.maximum(length / PART_PX, LEAST_DEVIATION)
    shows = length >= LEAST_DEVIATION * PART_PX
    unit = np.where(shows, parts / np.maximum(length, 1e-6), 0.0).astype(np.float32)
    light = np.log(np.hstack([np.maximum(mean, 1.0), deviation]))
    return Windows(unit[None], light[None])
