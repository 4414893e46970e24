"""The tip of a tracked tool, from poses in which it turned about its tip."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from navapp.errors import ResultError
from navapp.geometry.transform import FloatArray
from navapp.tools.tool import bound_of

_FEWEST_POSES = 10
# Lengths of three-dimensional normal residuals in standard deviations of one component: the
# median, and what one in a thousand exceeds.
_MEDIAN, _RARE = 1.5382, 4.0331
# Nearly all good poses enter with their full weight.
_HUBER = 2.0
_MOST_STEPS = 100
# A pose's error may enter the tip so many times: the tool must lean by some 8 degrees.
_WORST_GAIN = 10.0


@dataclass(frozen=True, slots=True, eq=False)
class PivotFit:
    """A fitted tip and the residual of every pose."""

    tip_mm: FloatArray  # (3,) in the tool's frame
    pivot_mm: FloatArray  # (3,) the place that it stood on, in the tracker's frame
    residuals_mm: FloatArray  # (N, 3) where each pose has the tip, less `pivot_mm`

    @property
    def lengths_mm(self) -> FloatArray:
        """(N,) of the residuals."""
        return np.asarray(np.linalg.norm(self.residuals_mm, axis=1))


@dataclass(frozen=True, slots=True, eq=False)
class Pivot:
    """The tip of a tool, in its tracked frame."""

    linear: PivotFit  # least squares over all poses
    robust: PivotFit  # least squares over the poses that agree with each other
    is_used: NDArray[np.bool_]  # (N,) these poses
    sigma_mm: float  # standard deviation of a component of their residuals
    covariance_mm2: FloatArray  # (3, 3) of the robust tip
    # largest angle of the tool's shaft (from its origin to its tip) to its mean direction.
    half_angle_deg: float
    # how many times the error of one pose enters the tip, along the direction that the motion says
    # least of.
    gain: float

    @property
    def outliers(self) -> list[int]:
        """Poses that were left out, counted from 0."""
        return [int(index) for index in np.flatnonzero(~self.is_used)]

    @property
    def bound_mm(self) -> float:
        """95 % bound of the tip's error, along its least certain direction."""
        return bound_of(self.covariance_mm2)


def solve_pivot(tracker_from_tool: ArrayLike) -> Pivot:
    """Find the point of a tool that stood still.

    Starts from the algebraic solution, takes weight from poses that are far off (Huber), then
    leaves out those that one in a thousand good poses would exceed, until the same ones stay out.
    The scale comes from the median of the lengths, so that nearly half of the poses may be wrong.

    Source: algebraic one-step method in Z. Yaniv, Which Pivot Calibration?, SPIE Medical Imaging
    2015; reweighting after P. J. Rousseeuw, A. M. Leroy, Robust Regression, Wiley 1987.

    Args:
        tracker_from_tool: (N, 4, 4) rigid poses, mm.

    Raises:
        ResultError: too few poses, or the tool was hardly turned.
    """
    poses = np.asarray(tracker_from_tool, dtype=np.float64).reshape(-1, 4, 4)
    if len(poses) < _FEWEST_POSES:
        raise ResultError(
            f"{len(poses)} poses are too few to find a tip",
            remedy=f"give {_FEWEST_POSES} at least; a hundred is usual",
        )
    everything = np.ones(len(poses))
    _check_motion(poses)
    linear = _fit(poses, everything)
    is_used = _agreeing(poses, linear)
    gain = _check_motion(poses[is_used])
    robust = _fit(poses, is_used.astype(np.float64))
    squares = float((robust.residuals_mm[is_used] ** 2).sum())
    sigma_mm = float(np.sqrt(squares / (3 * np.count_nonzero(is_used) - 6)))
    covariance = sigma_mm**2 * np.linalg.inv(_information(poses[is_used]))
    return Pivot(
        linear,
        robust,
        is_used,
        sigma_mm,
        np.asarray(covariance, dtype=np.float64),
        _half_angle_deg(poses[is_used], robust.tip_mm),
        gain,
    )


def _fit(poses: FloatArray, weights: FloatArray) -> PivotFit:
    """Weighted least squares of R tip + t - pivot."""
    n = len(poses)
    rows = np.concatenate([poses[:, :3, :3], np.tile(-np.eye(3), (n, 1, 1))], axis=2)
    scale = np.sqrt(weights)[:, None]
    left, right = rows * scale[:, None], -poses[:, :3, 3] * scale
    found = np.linalg.lstsq(left.reshape(-1, 6), right.reshape(-1), rcond=None)[0]
    residuals = rows @ found + poses[:, :3, 3]
    return PivotFit(found[:3], found[3:], residuals)


def _agreeing(poses: FloatArray, fit: PivotFit) -> NDArray[np.bool_]:
    """(N,) poses that agree."""
    for _ in range(_MOST_STEPS):
        sigma_mm = _sigma_mm(fit)
        weights = np.minimum(1.0, _HUBER * sigma_mm / np.maximum(fit.lengths_mm, 1e-12))
        last, fit = fit, _fit(poses, weights)
        if np.abs(fit.tip_mm - last.tip_mm).max() < 1e-6:
            break
    is_used = fit.lengths_mm <= _RARE * _sigma_mm(fit)
    for _ in range(_MOST_STEPS):
        fit = _fit(poses, is_used.astype(np.float64))
        before, is_used = is_used, fit.lengths_mm <= _RARE * _sigma_mm(fit)
        if np.array_equal(before, is_used):
            break
    return is_used


def _sigma_mm(fit: PivotFit) -> float:
    # Perfect poses leave nothing but rounding, which is no reason to leave one out.
    return max(float(np.median(fit.lengths_mm)) / _MEDIAN, 1e-6)


def _information(poses: FloatArray) -> FloatArray:
    """(3, 3) of the tip, for poses with an error of 1 mm in every component.

    What is left of the normal equations when the pivot is solved for: N (I - M^T M) with the mean
    M of all rotations. Rotations that are all alike, or about one axis, leave nothing.
    """
    mean = poses[:, :3, :3].mean(axis=0)
    information: FloatArray = len(poses) * (np.eye(3) - mean.T @ mean)
    return information


def _check_motion(poses: FloatArray) -> float:
    """How many times a pose's error enters the tip; refused when that is too often."""
    weakest = float(np.linalg.eigvalsh(_information(poses))[0]) / len(poses)
    gain = 1.0 / np.sqrt(max(weakest, 1e-12))
    if gain > _WORST_GAIN:
        raise ResultError(
            f"the tool was hardly turned: an error of its pose enters the tip {gain:.0f}-fold, "
            f"{_WORST_GAIN:.0f}-fold is allowed",
            remedy="lean it by 20 degrees or more to all sides, with its tip in one place",
        )
    return float(gain)


def _half_angle_deg(poses: FloatArray, tip_mm: FloatArray) -> float:
    """Of the cone that the shaft fills; 0 for a tip in the tool's origin, which has no shaft."""
    if np.linalg.norm(tip_mm) < 1e-6:
        return 0.0
    shafts = poses[:, :3, :3] @ (tip_mm / np.linalg.norm(tip_mm))
    middle = shafts.mean(axis=0)
    middle /= max(float(np.linalg.norm(middle)), 1e-12)
    return float(np.degrees(np.arccos(np.clip((shafts @ middle).min(), -1.0, 1.0))))
