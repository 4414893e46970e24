"""Sub-pixel disparity on a given support, by local least squares.

The support is a disparity that follows the surface's slant, from a rendered model or a coarse map.
Each pixel's window is warped by it as a whole, so slant and curvature cost nothing, and there is no
cost curve whose parabola could lock to whole pixels. A window without texture answers nothing: the
support is never handed back as a measurement.
"""

from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.bands import in_row_bands
from navapp.geometry.box import Box
from navapp.geometry.masks import large_smooth_regions
from navapp.geometry.rectification import RectifiedPair, find_reached
from navapp.geometry.zbuffer import find_known_range
from navapp.stereo.subpixel.refine_kernels import (
    CORRELATION,
    N_QUALITIES,
    SIGMA,
    STEP,
    accept_rows,
    refine_rows,
)
from navapp.values import DisparityMap

# Of the support, to see where it lies.
_SAMPLE_PX = 4
_LEAST_CONFIRMED = 0.1
_SPECKLE_PX2, _SPECKLE_STEP_PX = 60, 1.0


@dataclass(frozen=True, slots=True)
class RefineSettings:
    """How the refinement works."""

    radius_px: int = 5  # of the square window
    n_steps: int = 2  # Gauss-Newton steps, at most
    # no step follows one that moved most windows by no more than they are exact: to find out where
    # a surface is, not to measure it.
    stops_at_rest: bool = False
    min_filled: float = 0.6  # share of a window that must have support
    min_correlation: float = 0.6  # of the two windows after the last step
    last_step_px: float = 0.1  # a larger last step has not settled
    max_sigma_px: float = 0.3  # a window with a larger noise has too little texture
    # a window over which the offsets of the step before differ by more (standard deviation) lies
    # over more than one surface, or over a mismatch.
    max_roughness_px: float = np.inf
    systematic_px: float = 0.1  # error that the residual does not show; enters the claimed sigma


# What the residual of a window does not show is less on the model than on a surface that is
# guessed; at the true poses of simulated knees it is so much (tests.bench.model_noise).
MODEL_REFINEMENT = RefineSettings(systematic_px=0.08)


def refine(
    pair: RectifiedPair,
    support_px: NDArray[np.float32],
    settings: RefineSettings | None = None,
    stride_px: int = 1,
) -> DisparityMap:
    """Measure the disparity near a support.

    Args:
        pair: rectified grey pictures; `pair.box` is measured.
        support_px: (h, w) float32 disparity over the box, NaN where nothing is expected; within
            about half a pixel a step of the truth.
        settings: of the refinement.
        stride_px: only every so many-th pixel each way is measured.

    Returns:
        The map over `pair.box`, of the measured pixels only; those that did not settle, correlate
        or show texture are unknown.

    Raises:
        ValueError: colour pictures, a support of another size than the box, or a box that reaches
            beyond the pictures.

    Source: inverse-compositional image correlation (Pan et al. 2013) with gain and offset, on the
    model's own surface instead of a plane.
    """
    settings = settings or RefineSettings()
    box = pair.box
    if pair.left.ndim != 2 or support_px.shape != (box.height, box.width):
        raise ValueError("refine needs grey pictures and a support of the box's size")
    height, width = pair.left.shape
    if box.clip(width, height) != box:
        raise ValueError(f"the box {box} reaches beyond the picture of {width}x{height}")
    support = np.ascontiguousarray(support_px, dtype=np.float32)
    offset, quality = _steps(pair, support, settings, stride_px)
    thinned = [np.ascontiguousarray(a[::stride_px, ::stride_px]) for a in (support, offset)]
    disparity, sigma = (np.empty_like(thinned[0]) for _ in range(2))
    origin = np.empty(disparity.shape, dtype=np.uint8)
    limits = (
        settings.last_step_px,
        settings.max_sigma_px,
        settings.min_correlation,
        settings.max_roughness_px,
    )
    accept = partial(
        accept_rows, *thinned, quality, limits, settings.systematic_px,
        disparity=disparity, sigma=sigma, is_matched=origin,
    )  # fmt: skip
    in_row_bands(len(disparity), accept)
    return DisparityMap(disparity, sigma, origin, box.x, box.y)


def refine_on_model(pair: RectifiedPair, support_px: NDArray[np.float32]) -> DisparityMap:
    """As `refine`, on a model's own surface: nothing where hardly anything confirms it.

    Chance and repeated texture confirm a few per cent of any support, in specks.
    """
    found = without_specks(refine(pair, support_px, MODEL_REFINEMENT))
    n_expected = np.count_nonzero(np.isfinite(support_px))
    if found.n_matched < _LEAST_CONFIRMED * n_expected:
        return found.only(np.zeros(support_px.shape, dtype=np.bool_))
    return found


def without_specks(found: DisparityMap) -> DisparityMap:
    """The map without small patches that stand alone."""
    return found.only(large_smooth_regions(found.disparity_px, _SPECKLE_PX2, _SPECKLE_STEP_PX))


def _steps(
    pair: RectifiedPair,
    support: NDArray[np.float32],
    settings: RefineSettings,
    stride_px: int,
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """(h, w) offset px from the support, and (h, w, 4) / stride what the last step says of it."""
    box = pair.box
    columns = _find_reached_columns(support, box, pair.right.shape[1])
    seen = pair.left[box.slices]
    # About a middle value, the products of float32 keep their digits.
    centre = np.float32(seen[::_SAMPLE_PX, ::_SAMPLE_PX].mean() if seen.size else 0.0)
    left = np.subtract(seen, centre, dtype=np.float32)
    right = np.subtract(pair.right[box.slices[0], columns], centre, dtype=np.float32)
    radius, offset, refined = settings.radius_px, np.zeros_like(support), np.empty_like(support)
    least = settings.min_filled * (2 * radius + 1) ** 2
    height, width = (-(-length // stride_px) for length in support.shape)
    quality = np.empty((height, width, N_QUALITIES), dtype=np.float32)
    every, middle = 8 * stride_px, _middle(support)
    for _ in range(settings.n_steps):
        step = partial(
            refine_rows, left, right, support, offset, box.x - columns.start,
            (radius, stride_px, least), refined=refined, quality=quality,
        )  # fmt: skip
        in_row_bands(box.height, step, every, middle)
        offset, refined = refined, offset
        if settings.stops_at_rest and _is_at_rest(quality, settings):
            break
    return offset, quality


def _middle(support: NDArray[np.float32]) -> int:
    """Row before which half of the support lies."""
    some = np.isfinite(support[::_SAMPLE_PX, ::_SAMPLE_PX])
    known = np.cumsum(np.count_nonzero(some, axis=1))
    return _SAMPLE_PX * int(np.searchsorted(known, known[-1] // 2)) if some.size else 0


def _is_at_rest(quality: NDArray[np.float32], settings: RefineSettings) -> bool:
    """Whether most windows that tell anything moved by no more than their claimed sigma."""
    sigma, correlation = quality[..., SIGMA], quality[..., CORRELATION]
    tells = (sigma <= settings.max_sigma_px) & (correlation >= settings.min_correlation)
    step, sigma = quality[tells, STEP], sigma[tells]
    is_small = step**2 <= sigma**2 + np.float32(settings.systematic_px**2)
    return bool(2 * np.count_nonzero(is_small) >= len(step))


def _find_reached_columns(support: NDArray[np.float32], box: Box, picture_width: int) -> slice:
    """Columns of the right picture that some pixel's window can ask for."""
    farthest, nearest = find_known_range(support)
    if farthest > nearest:
        return slice(0, 0)
    _, reached = find_reached(box, (farthest, nearest))
    return reached.clip(picture_width, box.y + box.height).slices[1]
