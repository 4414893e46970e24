"""Least squares over all marks of all views, robust, with what is known beforehand."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibration.mirror.seen_views import KINDS, Marks
from calibration.mirror.view_state import N_LENS, N_SCREEN, N_SHARED, N_VIEW, ViewState, predict
from calibration.rig.equilibration import compute_unit_sizes, equilibrate
from navapp.geometry.directions import perpendicular_axes
from navapp.geometry.rig import StereoRig
from navapp.geometry.transform import FloatArray

# Steps of the differences: px and shares, rad, mm.
_SHARED_STEPS = np.array([1e-3] * 4 + [1e-7] * 4 + [1e-7] * 3 + [1e-5] * 3 + [1e-7, 1e-4, 1e-4]
                         + [1e-6] * 2)  # fmt: skip
_VIEW_STEPS = np.array([1e-7] * 3 + [1e-5] * 3 + [1e-7] * 3 + [1e-5] * 3)
# The cost is half a chi-square: a step that gains less moves no number by a tenth of its error.
_MOST_STEPS, _SETTLED, _FIRST_DAMPING = 60, 0.005, 1e-4
# A mark farther off than so many of its standard errors pulls no harder than one at that place.
_HUBER = 3.0


@dataclass(frozen=True, slots=True, eq=False)
class Priors:
    """What is known of the shared numbers before any view; 0: held as it is, inf: unknown."""

    start: ViewState  # the values that are told
    pitch_sd_share: float = 0.005
    bulge_sd_mm: float = 0.0
    glass_sd_mm: float = 0.5
    normal_sd_rad: float = 0.15
    # has_lens, has_screen: the eye's camera, or screen and glass, are calibrated and held.
    has_lens: bool = False
    has_screen: bool = False

    def sds(self) -> FloatArray:
        """(19,) of every shared number."""
        lens = [0.0 if self.has_lens else np.inf] * N_LENS
        if self.has_screen:
            return np.array([*lens, *[0.0] * (N_SHARED - N_LENS)])
        return np.array(
            [*lens, *[np.inf] * 6, self.pitch_sd_share, self.bulge_sd_mm, self.glass_sd_mm,
             self.normal_sd_rad, self.normal_sd_rad]
        )  # fmt: skip

    def deviations(self, state: ViewState) -> FloatArray:
        """(19,) of a state from what is told; 0 where nothing is."""
        off = np.zeros(N_SHARED)
        off[14] = state.screen.pitch_mm / self.start.screen.pitch_mm - 1.0
        off[15] = state.screen.bulge_mm - self.start.screen.bulge_mm
        off[16] = state.glass.thickness_mm - self.start.glass.thickness_mm
        first, second = perpendicular_axes(state.glass.normal[None])[0]
        leaned = state.glass.normal - self.start.glass.normal
        off[17:] = -second @ leaned, first @ leaned
        return off


@dataclass(frozen=True, slots=True, eq=False)
class Bundle:
    """A solved state."""

    state: ViewState
    residuals_px: dict[str, FloatArray]  # (n, 2) seen less predicted, by kind of mark
    scale: float  # of the residuals over the marks' standard errors, robust; at least 1
    # (n, n) of the free numbers, and which they are of the 19 shared and 12 V numbers of views.
    covariance: FloatArray
    is_free: NDArray[np.bool_]
    is_settled: bool


def solve(
    marks: dict[str, Marks],
    rig: StereoRig,
    start: ViewState,
    priors: Priors,
    shared_held: bool = False,
    kinds: Sequence[str] = KINDS,
) -> Bundle:
    """Solve for all numbers that are free.

    Args:
        marks: tables of all views.
        rig: of the stereo cameras.
        start: where to begin.
        priors: of the shared numbers.
        shared_held: solve for the views' own numbers only.
        kinds: of marks that count.
    """
    used = {kind: marks[kind] for kind in kinds}
    sds = priors.sds()
    is_free = np.r_[(sds > 0.0) & (not shared_held), np.ones(N_VIEW * len(start.eye_shift), bool)]
    state, is_settled = _come_to_rest(used, rig, start, priors, is_free)
    residual, sigma = _residuals(state, used, rig)
    scale = _scale(residual, sigma)
    normal, _ = _normal(state, used, rig, residual, _weights(residual, sigma, scale))
    _add_priors(normal, np.zeros(len(normal)), sds, np.zeros(N_SHARED))
    free = normal[np.ix_(is_free, is_free)]
    sizes = compute_unit_sizes(free)
    covariance = equilibrate(np.linalg.pinv(equilibrate(free, sizes), hermitian=True), sizes)
    return Bundle(state, _by_kind(residual, used), scale, covariance, is_free, is_settled)


def _come_to_rest(
    marks: dict[str, Marks],
    rig: StereoRig,
    state: ViewState,
    priors: Priors,
    is_free: NDArray[np.bool_],
) -> tuple[ViewState, bool]:
    """Damped steps until they gain nothing; whether they came so far."""
    damping, growth = _FIRST_DAMPING, 2.0
    residual, sigma = _residuals(state, marks, rig)
    for _ in range(_MOST_STEPS):
        scale = _scale(residual, sigma)
        normal, right = _normal(state, marks, rig, residual, _weights(residual, sigma, scale))
        _add_priors(normal, right, priors.sds(), priors.deviations(state))
        moved, promised = _descend(normal, right, is_free, damping, state)
        trial, _ = _residuals(moved, marks, rig)
        gain = _cost(residual, sigma, scale, priors, state) - _cost(
            trial, sigma, scale, priors, moved
        )
        if max(gain, promised) < _SETTLED:
            return (moved if gain > 0.0 else state), True
        if gain > 0.0:
            state, residual = moved, trial
            # Nielsen's rule: the better the step was foreseen, the less the next one is damped.
            damping *= max(1.0 / 3.0, 1.0 - (2.0 * gain / promised - 1.0) ** 3)
            growth = 2.0
        else:
            damping, growth = damping * growth, 2.0 * growth
    return state, False


def _residuals(
    state: ViewState, marks: dict[str, Marks], rig: StereoRig
) -> tuple[FloatArray, FloatArray]:
    """(M, 2) seen less predicted over all kinds, and (M,) standard errors."""
    found = predict(state, marks, rig)
    residual = np.vstack([marks[kind].pixels - found[kind] for kind in marks])
    return residual, np.concatenate([table.sigma_px for table in marks.values()])


def _by_kind(residual: FloatArray, marks: dict[str, Marks]) -> dict[str, FloatArray]:
    ends = np.cumsum([len(table.view) for table in marks.values()])[:-1]
    return dict(zip(marks, np.split(residual, ends), strict=True))


def _scale(residual: FloatArray, sigma: FloatArray) -> float:
    """Median of the residuals in standard errors, as a standard deviation."""
    return max(1.0, float(np.nanmedian(np.linalg.norm(residual, axis=1) / sigma)) / 1.1774)


def _lengths(residual: FloatArray, sigma: FloatArray, scale: float) -> FloatArray:
    lengths = np.linalg.norm(residual, axis=1) / (sigma * scale)
    # A mark behind the camera is as bad as can be.
    return np.where(np.isnan(lengths), 1e6, lengths)


def _weights(residual: FloatArray, sigma: FloatArray, scale: float) -> FloatArray:
    lengths = _lengths(residual, sigma, scale)
    weights: FloatArray = np.minimum(1.0, _HUBER / np.maximum(lengths, 1e-12))
    return weights / (sigma * scale) ** 2


def _cost(
    residual: FloatArray, sigma: FloatArray, scale: float, priors: Priors, state: ViewState
) -> float:
    lengths = _lengths(residual, sigma, scale)
    robust = np.where(lengths < _HUBER, 0.5 * lengths**2, _HUBER * (lengths - 0.5 * _HUBER))
    sds = priors.sds()
    known = np.isfinite(sds) & (sds > 0.0)
    off = priors.deviations(state)[known] / sds[known]
    return float(robust.sum() + 0.5 * (off**2).sum())


def _normal(
    state: ViewState,
    marks: dict[str, Marks],
    rig: StereoRig,
    residual: FloatArray,
    weights: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Normal matrix and right side of all numbers, free or not."""
    n_views = len(state.eye_shift)
    view = np.concatenate([table.view for table in marks.values()])
    slopes = _slopes(state, marks, rig, residual)
    weighted = slopes * weights[:, None, None]
    n = N_SHARED + N_VIEW * n_views
    normal, right = np.zeros((n, n)), np.zeros(n)
    for k in range(n_views):
        rows = view == k
        part = np.tensordot(weighted[rows], slopes[rows], axes=((0, 1), (0, 1)))
        aim = np.tensordot(weighted[rows], residual[rows], axes=((0, 1), (0, 1)))
        at = np.r_[0:N_SHARED, N_SHARED + N_VIEW * k : N_SHARED + N_VIEW * (k + 1)]
        normal[np.ix_(at, at)] += part
        right[at] += aim
    return normal, right


def _slopes(
    state: ViewState, marks: dict[str, Marks], rig: StereoRig, residual: FloatArray
) -> FloatArray:
    """(M, 2, 19 + 12) of the predictions, by shared numbers and by those of a mark's own view."""
    n_views = len(state.eye_shift)
    slopes = np.zeros((*residual.shape, N_SHARED + N_VIEW))
    ends = np.cumsum([0, *(len(table.view) for table in marks.values())])
    rows = {kind: slice(ends[k], ends[k + 1]) for k, kind in enumerate(marks)}
    none, still = np.zeros(N_SHARED), np.zeros((n_views, N_VIEW))
    for k, step in enumerate(np.r_[_SHARED_STEPS, _VIEW_STEPS]):
        shared, views = none.copy(), still.copy()
        if k < N_SHARED:
            shared[k] = step
        else:
            views[:, k - N_SHARED] = step
        moved = {kind: marks[kind] for kind in _moved_by(k) if kind in marks}
        found = predict(state.move(shared, views), moved, rig)
        for kind, table in moved.items():
            left = table.pixels - found[kind]
            slopes[rows[kind], :, k] = (residual[rows[kind]] - left) / step
    return slopes


def _moved_by(number: int) -> tuple[str, ...]:
    """Kinds of marks that a number moves: lens, screen, glass; eye's camera, board."""
    if number < N_LENS:
        return ("eye_screen", "eye_site")
    if number < N_SCREEN:
        return ("eye_screen",)
    if number < N_SHARED:
        return ("eye_site",)
    if number < N_SHARED + N_VIEW // 2:
        return ("eye_screen", "eye_site")
    return ("eye_site", "left", "right")


def _add_priors(
    normal: FloatArray, right: FloatArray, sds: FloatArray, deviations: FloatArray
) -> None:
    for k in np.flatnonzero(np.isfinite(sds) & (sds > 0.0)):
        normal[k, k] += 1.0 / sds[k] ** 2
        right[k] -= deviations[k] / sds[k] ** 2


def _descend(
    normal: FloatArray,
    right: FloatArray,
    is_free: NDArray[np.bool_],
    damping: float,
    state: ViewState,
) -> tuple[ViewState, float]:
    """The state after a damped step, and by how much it should lower the cost."""
    free = normal[np.ix_(is_free, is_free)]
    sizes = compute_unit_sizes(free)
    damped = equilibrate(free, sizes) + damping * np.eye(len(free))
    step = np.zeros(len(is_free))
    step[is_free] = sizes * np.linalg.lstsq(damped, sizes * right[is_free], rcond=None)[0]
    promised = float(step @ right - 0.5 * step @ normal @ step)
    return state.move(step[:N_SHARED], step[N_SHARED:].reshape(-1, N_VIEW)), promised
