"""Where the two pictures of a surface differ by more than its place explains: highlights.

A highlight moves over a wet surface with the eye that sees it. A window that holds one follows it,
off the surface, and agrees with itself. Against the surroundings it shows: one picture is brighter
there than the other, and no shift by a pixel makes up for it.
"""

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.masks import grow
from navapp.geometry.rectification import RectifiedPair

# Wider than the highlights of a wet bone: its surroundings tell how bright it should be.
_SURROUNDINGS_PX = 41
_NOISE_PX = 3
# Noise and relief stay below the larger of these two.
_N_SIGMA = 6.0
_LEAST_EXCESS = 10.0
# The support may be that wrong: beside an edge of the picture this makes a difference too.
_WRONG_BY_PX = 1.0
_GAINS = (0.5, 2.0)
_THIN = 4


def without_highlights(pair: RectifiedPair, support_px: NDArray[np.float32]) -> NDArray[np.float32]:
    """The support, NaN where the pictures differ too much; one pixel around it too.

    Args:
        pair: rectified grey pictures; the support is over `pair.box`.
        support_px: (h, w) float32 disparity, less than about a pixel from the truth; NaN where
            unknown.
    """
    import cv2

    left, right, is_seen = _facing(pair, support_px)
    if not is_seen.any():
        return support_px
    shown = is_seen.astype(np.float32)
    deviation = [max(float(picture[is_seen].std()), 1.0) for picture in (left, right)]
    gain = np.clip(deviation[0] / deviation[1], *_GAINS)
    difference = (left - np.float32(gain) * right) * shown
    around = (_SURROUNDINGS_PX, _SURROUNDINGS_PX)
    level = cv2.blur(difference, around) / np.maximum(cv2.blur(shown, around), np.float32(1e-3))
    near = (_NOISE_PX, _NOISE_PX)
    excess = np.abs(cv2.blur((difference - level) * shown, near))
    thinned = excess[::_THIN, ::_THIN][is_seen[::_THIN, ::_THIN]]
    sigma = 1.4826 * float(np.median(thinned)) if thinned.size else 0.0
    slope = cv2.blur(np.abs(cv2.Sobel(right, cv2.CV_32F, 1, 0, ksize=1)), near) * np.float32(0.5)
    limit = max(_N_SIGMA * sigma, _LEAST_EXCESS) + _WRONG_BY_PX * slope
    is_bright = is_seen & (excess > limit)
    return np.where(grow(is_bright, 1), np.float32(np.nan), support_px)


def _facing(
    pair: RectifiedPair, support_px: NDArray[np.float32]
) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.bool_]]:
    """(h, w) grey values of the box, what the support says faces them, and where it says so."""
    import cv2

    box = pair.box
    left = pair.left[box.y : box.y + box.height, box.x : box.x + box.width].astype(np.float32)
    rows = np.ascontiguousarray(pair.right[box.y : box.y + box.height]).astype(np.float32)
    x = np.arange(box.x, box.x + box.width, dtype=np.float32) - support_px
    is_seen = (x >= 0.0) & (x <= pair.right.shape[1] - 1)
    x = np.where(is_seen, x, np.float32(0.0))
    y = np.repeat(np.arange(box.height, dtype=np.float32)[:, None], box.width, axis=1)
    return left, np.asarray(cv2.remap(rows, x, y, cv2.INTER_LINEAR), np.float32), is_seen
