"""The display in a mirror from crosses that an eye has aligned with known points.

The operator moves a cross on the screen until it lies on a point at the site; the stereo cameras
know where that point is. The eye wanders from one alignment to the next: its mean place is solved
for, and its wandering is noise that grows with the depth between point and screen.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri

from calibration.mirror.alignment_fit import (
    WORST,
    AlignmentPriors,
    Alignments,
    compute_lengths,
    compute_noise,
    count_solved,
    estimate_sd_px,
    fit_model,
    invert,
    make_normal,
    scale_of,
    spread_out,
)
from calibration.mirror.alignment_start import AlignedDisplay, make_first_model
from navapp.errors import ResultError
from navapp.geometry.display_model import DisplayModel, DisplayQuality
from navapp.geometry.display_model_errors import millimetres_by_pixels, pixels_by_parameters
from navapp.geometry.transform import FloatArray

FEWEST_ALIGNMENTS, MOST_ALIGNMENTS, FEWEST_DEPTHS = 12, 40, 3
# Points nearer to each other along the line of sight are of one depth.
_SAME_DEPTH_MM = 8.0
LEAST_RANGE_MM, ACCEPT_MM = 60.0, 0.60
# Of a head that is held still: 95 % of its places within 3 mm of their mean.
WANDER_SD_MM = 1.07
_FIRST_SD_PX, _N_ROUNDS = 1.0, 3
# Chance that the noise is larger than it is counted.
_SURELY = 0.8


@dataclass(frozen=True, slots=True, eq=False)
class AlignedCalibration:
    """A display solved by alignments."""

    model: DisplayModel  # with its verdict
    is_used: NDArray[np.bool_]  # (N,) which alignments were not dropped as strays
    residuals_px: FloatArray  # (N, 2) aligned less drawn
    alignment_sd_px: float  # of the operator, estimated
    wander_sd_mm: float  # of the eye, assumed
    anatomy_mm: FloatArray  # (n, 3) where the error is judged
    predicted_mm: FloatArray  # (n,) 95 % error there


def solve_alignments(
    display: AlignedDisplay,
    given: Alignments,
    anatomy_mm: FloatArray | None = None,
    wander_sd_mm: float = WANDER_SD_MM,
) -> AlignedCalibration:
    """Solve eye and screen, estimate the operator's noise, and judge.

    Args:
        display: that shows the crosses.
        given: at least twelve alignments.
        anatomy_mm: (n, 3) where the error counts; the aligned points when absent.
        wander_sd_mm: standard deviation of the eye's place, an axis.

    Raises:
        ResultError: too few alignments, or such that tell no screen.
    """
    check_alignments(given)
    model = make_first_model(display, given.pixels, given.points_mm)
    priors = AlignmentPriors(model, display)
    sd_px, is_used = _FIRST_SD_PX, np.ones(len(given.pixels), dtype=bool)
    for _ in range(_N_ROUNDS):
        model = fit_model(model, given.only(is_used), priors, sd_px, wander_sd_mm)
        lengths = compute_lengths(model, given, sd_px, wander_sd_mm)
        n_solved = count_solved(model, given.only(is_used), priors, sd_px, wander_sd_mm)
        sd_px = estimate_sd_px(model, given.only(is_used), wander_sd_mm, n_solved)
        is_used = lengths * scale_of(lengths[is_used]) < WORST
    normal, _ = make_normal(model, given.only(is_used), priors, sd_px, wander_sd_mm)
    freedom = max(2.0 * float(is_used.sum()) - n_solved, 1.0)
    # The noise is estimated from few residuals: it counts as large as it may well be.
    factor = freedom / float(chdtri(freedom, _SURELY))
    covariance = spread_out(invert(normal), priors) * factor
    model = replace(model, quality=DisplayQuality(False, covariance=covariance))
    anatomy = given.points_mm[is_used] if anatomy_mm is None else anatomy_mm
    predicted = model.predict_error(anatomy)
    return AlignedCalibration(
        _judge(model, given, is_used, sd_px, wander_sd_mm, anatomy, predicted), is_used,
        given.pixels - model.project(given.points_mm), sd_px, wander_sd_mm, anatomy, predicted,
    )  # fmt: skip


def check_alignments(given: Alignments) -> None:
    """Refuse fewer alignments than a solve needs.

    Raises:
        ResultError: the sentence says how many are missing.
    """
    n = len(given.pixels)
    if n < FEWEST_ALIGNMENTS:
        raise ResultError(
            f"only {n} alignments were made, {FEWEST_ALIGNMENTS} are needed",
            remedy=f"align {FEWEST_ALIGNMENTS - n} more points",
        )


def compute_gains(found: AlignedCalibration, offered_mm: FloatArray) -> FloatArray:
    """(K,) mm^2 by which each point (K, 3), aligned next, lowers the predicted error's square."""
    model = found.model
    covariance = None if model.quality is None else model.quality.covariance
    if covariance is None:
        raise ValueError("a solved display has a covariance")
    to_mm = millimetres_by_pixels(model, found.anatomy_mm)
    told = to_mm @ pixels_by_parameters(model, found.anatomy_mm)
    slopes = pixels_by_parameters(model, offered_mm)
    noise = compute_noise(model, offered_mm, np.zeros(len(offered_mm)), found.alignment_sd_px,
                   found.wander_sd_mm)  # fmt: skip
    by_point = covariance @ slopes.transpose(0, 2, 1)
    root = np.linalg.cholesky(np.linalg.inv(noise + slopes @ by_point))
    gains = [float(((told @ (by_point[k] @ root[k])) ** 2).sum()) for k in range(len(offered_mm))]
    return np.array(gains)


def choose_next(found: AlignedCalibration, offered_mm: FloatArray) -> int:
    """Which of the points (K, 3) on offer, aligned next, lowers the predicted error most."""
    return int(np.argmax(compute_gains(found, offered_mm)))


def choose_spread(aligned_mm: FloatArray, offered_mm: FloatArray) -> int:
    """Before there is a solution: the point on offer that is farthest from all aligned ones."""
    if len(aligned_mm) == 0:
        return int(np.argmin(np.linalg.norm(offered_mm - offered_mm.mean(axis=0), axis=1)))
    apart = np.linalg.norm(offered_mm[:, None] - aligned_mm[None], axis=2)
    return int(np.argmax(apart.min(axis=1)))


def advise(found: AlignedCalibration, n_alignments: int) -> str:
    """What to do next, one sentence; empty when it is enough."""
    quality = found.model.quality
    if quality is not None and quality.is_accepted:
        return ""
    reasons = () if quality is None else quality.reasons
    reason = reasons[0] if reasons else "it is not accepted"
    if n_alignments < MOST_ALIGNMENTS:
        return f"{reason}: align another point"
    return (
        f"{reason}: begin anew; the {n_alignments} alignments scatter by "
        f"{found.alignment_sd_px:.1f} px"
    )


def _judge(
    model: DisplayModel,
    given: Alignments,
    is_used: NDArray[np.bool_],
    sd_px: float,
    wander_sd_mm: float,
    anatomy_mm: FloatArray,
    predicted_mm: FloatArray,
) -> DisplayModel:
    """The model with its verdict."""
    error_mm = float(np.quantile(predicted_mm, 0.95))
    distances = np.linalg.norm(anatomy_mm - model.eye_mm, axis=1)
    reasons = (*_of_depths(model, given.points_mm[is_used]), *_of_error(error_mm, is_used))
    assert model.quality is not None  # noqa: S101 (for the type checker: it always has one)
    quality = replace(
        model.quality,
        is_accepted=not reasons,
        reasons=reasons,
        error_mm=error_mm,
        error_arcmin=float(60.0 * np.degrees(np.quantile(predicted_mm / distances, 0.95))),
        figures={
            "alignments_used": float(is_used.sum()),
            "alignments_dropped": float((~is_used).sum()),
            "alignment_sd_px": sd_px,
            "eye_wander_sd_mm": wander_sd_mm,
            "depth_range_mm": count_depths(given.points_mm[is_used], model.eye_mm)[1],
        },
    )
    return replace(model, quality=quality)


def count_depths(points_mm: FloatArray, eye_mm: FloatArray) -> tuple[int, float]:
    """How many depths points (N, 3) lie at along the line of sight, and over how many mm."""
    ahead = points_mm.mean(axis=0) - eye_mm
    depths = np.sort((points_mm - eye_mm) @ (ahead / np.linalg.norm(ahead)))
    n_depths, last = 0, -np.inf
    for depth in depths:
        if depth - last >= _SAME_DEPTH_MM:
            n_depths, last = n_depths + 1, float(depth)
    return n_depths, float(np.ptp(depths))


def has_depth(n_depths: int, range_mm: float) -> bool:
    """Whether these are enough depths, over enough mm."""
    return n_depths >= FEWEST_DEPTHS and range_mm >= LEAST_RANGE_MM


def _of_depths(model: DisplayModel, points_mm: FloatArray) -> Sequence[str]:
    n_depths, range_mm = count_depths(points_mm, model.eye_mm)
    if has_depth(n_depths, range_mm):
        return ()
    return (
        f"the points lie at {n_depths} depths over {range_mm:.0f} mm, {FEWEST_DEPTHS} depths over "
        f"{LEAST_RANGE_MM:.0f} mm are needed",
    )


def _of_error(error_mm: float, is_used: NDArray[np.bool_]) -> Sequence[str]:
    reasons = []
    if int(is_used.sum()) < FEWEST_ALIGNMENTS:
        reasons.append(
            f"only {int(is_used.sum())} alignments agree, {FEWEST_ALIGNMENTS} are needed"
        )
    if not error_mm <= ACCEPT_MM:
        reasons.append(
            f"the predicted 95 % error at the anatomy is {error_mm:.2f} mm, {ACCEPT_MM:.2f} mm are "
            "allowed"
        )
    return reasons
