"""Sub-pixel disparity on a given support, by local least squares.

The support is a disparity that follows the surface's slant, from a rendered model or a coarse map.
Each pixel's window is warped by it as a whole, so slant and curvature cost nothing, and there is no
cost curve whose parabola could lock to whole pixels. A window without texture answers nothing: the
support is never handed back as a measurement.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.rectification import RectifiedPair
from navapp.stereo.refine_kernels import refine_rows
from navapp.values import DisparityMap, Origin

# Grey values are centred so that the products of float32 keep their digits.
_GREY_CENTRE = np.float32(110.0)


@dataclass(frozen=True, slots=True)
class RefineSettings:
    """How the refinement works.

    Attributes:
        radius_px: of the square window.
        n_steps: Gauss-Newton steps.
        min_filled: share of a window that must have support.
        min_correlation: of the two windows after the last step.
        last_step_px: a larger last step has not settled.
        max_sigma_px: a window with a larger noise has too little texture.
        systematic_px: error that the residual does not show; enters the claimed sigma.
    """

    radius_px: int = 5
    n_steps: int = 2
    min_filled: float = 0.6
    min_correlation: float = 0.6
    last_step_px: float = 0.1
    max_sigma_px: float = 0.3
    systematic_px: float = 0.1


def refine(
    pair: RectifiedPair, support_px: NDArray[np.float32], settings: RefineSettings | None = None
) -> DisparityMap:
    """Measure the disparity near a support.

    Args:
        pair: rectified grey pictures; `pair.box` is measured.
        support_px: (h, w) float32 disparity over the box, NaN where nothing is expected; within
            about half a pixel a step of the truth.
        settings: of the refinement.

    Returns:
        The map over `pair.box`; pixels that did not settle, correlate or show texture are unknown.

    Raises:
        ValueError: colour pictures, or a support of another size than the box.

    Source: inverse-compositional image correlation (Pan et al. 2013) with gain and offset, on the
    model's own surface instead of a plane.
    """
    settings = settings or RefineSettings()
    box = pair.box
    if pair.left.ndim != 2 or support_px.shape != (box.height, box.width):
        raise ValueError("refine needs grey pictures and a support of the box's size")
    rows = slice(box.y, box.y + box.height)
    left = pair.left[rows, box.x : box.x + box.width].astype(np.float32) - _GREY_CENTRE
    right = pair.right[rows].astype(np.float32) - _GREY_CENTRE
    support = np.ascontiguousarray(support_px, dtype=np.float32)
    offset = np.zeros_like(support)
    refined, step, sigma, correlation = (np.empty_like(support) for _ in range(4))
    for _ in range(settings.n_steps):
        refine_rows(
            left, right, support, offset, box.x, settings.radius_px, settings.min_filled,
            0, box.height, refined, step, sigma, correlation,
        )  # fmt: skip
        offset, refined = refined, offset
    disparity = support + offset
    is_matched = (
        (correlation >= settings.min_correlation)
        & (np.abs(step) <= settings.last_step_px)
        & (sigma <= settings.max_sigma_px)
    )
    claimed = np.hypot(sigma, np.float32(settings.systematic_px))
    return DisparityMap(
        np.where(is_matched, disparity, np.nan).astype(np.float32),
        np.where(is_matched, claimed, np.nan).astype(np.float32),
        np.where(is_matched, Origin.MATCHED, Origin.UNKNOWN).astype(np.uint8),
        box.x,
        box.y,
    )
