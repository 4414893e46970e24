"""Where a cross is lit first: beside where the corner is expected, as far as that is known."""

import numpy as np
from numpy.typing import NDArray

from calibration.mirror.alignment_fit import Alignments
from calibration.mirror.alignment_start import AlignedDisplay, make_first_model
from navapp.errors import ResultError
from navapp.geometry.display_model import DisplayModel
from navapp.geometry.transform import FloatArray

# A cross stays so far from the rim of the display.
RIM_PX = 30
_FEWEST_FOR_MODEL, _LEAST_SPREAD_MM = 6, 8.0
_WORST_ROUGH_PX = 60.0
# A cross is lit so far from where the corner is expected.
_LEAST_BESIDE_PX, _MOST_BESIDE_PX = 15.0, 40.0


def guess_pixel(
    display: AlignedDisplay, made: Alignments, model: DisplayModel | None, point_mm: FloatArray
) -> tuple[int, int]:
    """The display's pixel for a corner (3,).

    By the model when there is one; else by the affine map that fits the alignments, which is the
    last of them, or the display's middle, when they tell no more.
    """
    size = np.array([display.width_px, display.height_px])
    if model is not None:
        pixel = model.project(point_mm[None])[0]
    elif len(made.pixels) == 0:
        pixel = 0.5 * (size - 1.0)
    else:
        pixel = _map_affine(made, point_mm)
    if not np.isfinite(pixel).all():
        pixel = 0.5 * (size - 1.0)
    inside = np.clip(np.rint(pixel), RIM_PX, size - 1 - RIM_PX)
    return int(inside[0]), int(inside[1])


def light_beside(
    display: AlignedDisplay, pixel: tuple[int, int], rng: np.random.Generator
) -> tuple[int, int]:
    """A pixel some way beside another one, in any direction.

    A cross that is confirmed where it was lit then disagrees with what is known: it cannot make
    a solution seem better than the eye's own alignments make it.
    """
    size = np.array([display.width_px, display.height_px])
    far_px, angle = rng.uniform(_LEAST_BESIDE_PX, _MOST_BESIDE_PX), rng.uniform(0.0, 2.0 * np.pi)
    way = far_px * np.array([np.cos(angle), np.sin(angle)])
    beside = pixel + way
    # Beyond the rim the other way is taken.
    beside = np.where((beside < RIM_PX) | (beside > size - 1 - RIM_PX), pixel - way, beside)
    u, v = np.rint(beside).astype(int).tolist()
    return u, v


def is_on_display(display: AlignedDisplay, pixels: FloatArray) -> NDArray[np.bool_]:
    """(N,) bool of pixels (N, 2): a whole cross can be lit there."""
    last = np.array([display.width_px, display.height_px]) - 1 - RIM_PX
    # What is not a number compares as outside.
    return np.asarray(((pixels >= RIM_PX) & (pixels <= last)).all(axis=1))


def make_rough_model(display: AlignedDisplay, made: Alignments) -> DisplayModel | None:
    """A model from fewer alignments than a solve needs; None when they tell none."""
    if len(made.pixels) < _FEWEST_FOR_MODEL:
        return None
    centred = made.points_mm - made.points_mm.mean(axis=0)
    spread_mm = np.linalg.svd(centred, compute_uv=False)[2] / np.sqrt(len(centred))
    if spread_mm < _LEAST_SPREAD_MM:
        return None
    try:
        model = make_first_model(display, made.pixels, made.points_mm)
    except (ResultError, ValueError):
        return None
    off_px = np.linalg.norm(model.project(made.points_mm) - made.pixels, axis=1)
    return model if float(np.median(off_px)) < _WORST_ROUGH_PX else None


def _map_affine(made: Alignments, point_mm: FloatArray) -> FloatArray:
    """Of least norm: what the alignments do not tell moves nothing."""
    middle_mm, middle_px = made.points_mm.mean(axis=0), made.pixels.mean(axis=0)
    centred = made.points_mm - middle_mm
    largest_mm = max(float(np.linalg.norm(centred, axis=1).max()), 1e-9)
    slopes = np.linalg.pinv(centred, rcond=_LEAST_SPREAD_MM / max(largest_mm, 10.0)) @ (
        made.pixels - middle_px
    )
    mapped: FloatArray = middle_px + (point_mm - middle_mm) @ slopes
    return mapped
