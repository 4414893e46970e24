"""Gradient directions of a stereo pair as tables: a view's score becomes look-ups.

Source: the paper's equation 3, with a gate: a gradient that is too weak to have a direction answers
0, because left out it would reward views that project into flat parts. Quantised directions that
are spread over some pixels: Hinterstoisser et al., PAMI 2012.
"""

from functools import partial

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from navapp.geometry.bands import run_both
from navapp.geometry.box import Box
from navapp.geometry.rectification import Image, RectifiedPair
from navapp.registration.score_kernels import N_BINS, EdgeTables, scale_optics

# Chosen; the gate: so much of the box is flat, and what is no steeper than so many sigma of noise.
_BLUR_PX = 0.8
_FLAT_FRACTION = 0.6
_NOISE_SIGMAS = 3.0
# Computed: sigma of a central difference after that blur, of white noise with sigma 1 before it.
_BLURRED_NOISE = 0.222


def make_edge_tables(
    pair: RectifiedPair, scale: int, reach_px: int, largest_disparity_px: float
) -> EdgeTables:
    """Tables of a grey pair made `scale` times smaller; gradients spread by `reach_px` of that.

    What counts as flat is learned inside the pair's box, and where the right picture shows it.
    """
    box = pair.box
    first = max(int(box.x - largest_disparity_px), 0)
    seen_right = Box(first, box.y, box.x + box.width - first, box.height)
    left, right = run_both(
        partial(_compute_responses, pair.left, box, scale, reach_px),
        partial(_compute_responses, pair.right, seen_right, scale, reach_px),
    )
    return EdgeTables(left, right, scale_optics(pair.geometry, scale))


def _compute_responses(picture: Image, box: Box, scale: int, reach_px: int) -> NDArray[np.uint8]:
    """(h, w, N_BINS) of one picture."""
    import cv2

    # Whole blocks of pixels only, so that places scale exactly.
    height, width = (size // scale for size in picture.shape)
    whole = picture[: height * scale, : width * scale]
    small = cv2.resize(whole, (width, height), interpolation=cv2.INTER_AREA).astype(np.float32)
    gy, gx = np.gradient(cv2.GaussianBlur(small, (0, 0), _BLUR_PX))
    x, y = box.x // scale, box.y // scale
    part = np.hypot(gx, gy)[y : y + box.height // scale, x : x + box.width // scale]
    least = _NOISE_SIGMAS * _BLURRED_NOISE * _estimate_noise(picture[box.slices]) / scale
    least = max(least, float(np.quantile(part, _FLAT_FRACTION)) if part.size else 0.0)
    return spread_responses(quantise_gradients(gx, gy, least), reach_px)


def quantise_gradients(
    gx: NDArray[np.float32], gy: NDArray[np.float32], least: float
) -> NDArray[np.uint8]:
    """(h, w) bit k: the gradient is above the least and its direction about k pi / N_BINS.

    The outermost pixels have none: their gradient is one-sided.
    """
    x, y = gx[1:-1, 1:-1].astype(np.float64), gy[1:-1, 1:-1].astype(np.float64)
    k = np.floor(np.arctan2(y, x) * N_BINS / np.pi + 0.5).astype(np.int64) % N_BINS
    bins = np.where(x * x + y * y > least * least, 1 << k, 0).astype(np.uint8)
    return np.pad(bins, 1)


def spread_responses(bins: NDArray[np.uint8], reach_px: int) -> NDArray[np.uint8]:
    """(h, w, N_BINS) the best |cos| of each direction with the bins (h, w) in reach, times 255."""
    bit = np.arange(N_BINS)
    cosine = np.abs(np.cos(np.pi / N_BINS * (bit[:, None] - bit)))
    has_bin = (np.arange(256)[:, None] >> bit) & 1
    answers = np.round(255.0 * (has_bin[:, :, None] * cosine).max(axis=1)).astype(np.uint8)
    size = 2 * reach_px + 1
    around = np.bitwise_or.reduce(
        sliding_window_view(np.pad(bins, reach_px), (size, size)), axis=(2, 3)
    )
    response: NDArray[np.uint8] = answers[around]
    return response


def _estimate_noise(picture: Image) -> float:
    """Sigma of the pixels' noise, grey levels.

    Source: Immerkaer 1996, with the median in place of the mean: edges must not count.
    """
    import cv2

    mask = np.array([[1.0, -2.0, 1.0], [-2.0, 4.0, -2.0], [1.0, -2.0, 1.0]])
    found = cv2.filter2D(picture, cv2.CV_32F, mask)
    return float(np.median(np.abs(found))) / (0.6745 * 6.0)
