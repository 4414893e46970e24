"""Gradient directions of a stereo pair as tables: a view's score becomes look-ups.

Source: the paper's equation 3, with a gate: a gradient that is too weak to have a direction answers
0, because left out it would reward views that project into flat parts. Quantised directions that
are spread over some pixels: Hinterstoisser et al., PAMI 2012.
"""

from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.bands import in_row_bands
from navapp.geometry.box import Box
from navapp.geometry.rectification import Image, RectifiedPair
from navapp.registration.initial_kernels import (
    N_BINS,
    Optics,
    quantise_gradients,
    spread_responses,
)

_BLUR_PX = 0.8
# So much of the box is taken to be flat; and whatever is no steeper than so many sigma of noise.
_FLAT_SHARE = 0.6
_NOISE_SIGMAS = 3.0
# Sigma of a central difference after that blur, of white noise with sigma 1 before it.
_BLURRED_NOISE = 0.222


@dataclass(frozen=True, slots=True, eq=False)
class EdgeTables:
    """What an edge of each direction finds at each pixel of both pictures, made smaller.

    Attributes:
        left, right: (h, w, 8) uint8, 255 where a gradient is across the edge; the direction of
            the edge's normal is k pi / 8.
        optics: of the smaller pictures.
    """

    left: NDArray[np.uint8]
    right: NDArray[np.uint8]
    optics: Optics


def edge_tables(pair: RectifiedPair, scale: int, reach: int, largest_px: float) -> EdgeTables:
    """Tables of a pair whose pictures are made smaller.

    Args:
        pair: grey pictures; what counts as flat is learned inside its box.
        scale: how many times smaller.
        reach: px of the small picture over which a gradient is spread.
        largest_px: disparity in the box, at most: where the right picture shows the box.
    """
    box = pair.box
    first = max(int(box.x - largest_px), 0)
    seen_right = Box(first, box.y, box.x + box.width - first, box.y + box.height)
    return EdgeTables(
        _responses(pair.left, box, scale, reach),
        _responses(pair.right, seen_right, scale, reach),
        scale_optics(pair, scale),
    )


def scale_optics(pair: RectifiedPair, scale: int) -> Optics:
    """Optics of the pictures when they are made smaller: u' = (u + 0.5) / scale - 0.5."""
    geometry = pair.geometry
    return Optics(
        geometry.focal_px / scale,
        (geometry.centre_x_px + 0.5) / scale - 0.5,
        (geometry.centre_y_px + 0.5) / scale - 0.5,
        geometry.baseline_mm,
    )


def answer_table() -> NDArray[np.uint8]:
    """(256, 8) the best |cos| between a direction and those of a byte of bins, times 255."""
    between = np.arange(N_BINS)[:, None] - np.arange(N_BINS)
    cosine = np.abs(np.cos(np.pi / N_BINS * between))
    has_bin = (np.arange(256)[:, None] >> np.arange(N_BINS)) & 1
    best = (has_bin[:, :, None] * cosine).max(axis=1)
    answers: NDArray[np.uint8] = np.round(255.0 * best).astype(np.uint8)
    return answers


def _responses(picture: Image, inside: Box, scale: int, reach: int) -> NDArray[np.uint8]:
    import cv2

    # Whole blocks of pixels only, so that places scale exactly.
    height, width = (size // scale for size in picture.shape)
    whole = picture[: height * scale, : width * scale]
    small = cv2.resize(whole, (width, height), interpolation=cv2.INTER_AREA).astype(np.float32)
    small = np.ascontiguousarray(cv2.GaussianBlur(small, (0, 0), _BLUR_PX), dtype=np.float32)
    gy, gx = np.gradient(small)
    x, y = inside.x // scale, inside.y // scale
    part = np.hypot(gx, gy)[y : y + inside.height // scale, x : x + inside.width // scale]
    least = _NOISE_SIGMAS * _BLURRED_NOISE * _noise(picture, inside) / scale
    least = max(least, float(np.quantile(part, _FLAT_SHARE)) if part.size else 0.0)
    bins = np.zeros(small.shape, dtype=np.uint8)
    in_row_bands(height, partial(quantise_gradients, small, least, bins=bins))
    response = np.zeros((height, width, N_BINS), dtype=np.uint8)
    answers = answer_table()
    in_row_bands(height, lambda rows: spread_responses(bins, reach, answers, rows, response))
    return response


def _noise(picture: Image, inside: Box) -> float:
    """Sigma of the pixels' noise, grey levels.

    Source: Immerkaer 1996, with the median in place of the mean: edges must not count.
    """
    import cv2

    part = picture[inside.y : inside.y + inside.height, inside.x : inside.x + inside.width]
    if part.size == 0:
        return 0.0
    mask = np.array([[1.0, -2.0, 1.0], [-2.0, 4.0, -2.0], [1.0, -2.0, 1.0]])
    found = cv2.filter2D(part, cv2.CV_32F, mask)
    return float(np.median(np.abs(found))) / (0.6745 * 6.0)
