"""Fits the edge of a blurred plate of cortex to density profiles across a bone's surface.

A scanner blurs. The half-maximum of a blurred plate lies at its edge only when the plate is thick;
cortex at the condyles is as thin as the blur is wide: its peak is lower, and the half-maximum lies
outside. So the whole profile is explained: soft tissue, a plate of known density, and what is
inside, blurred by a known width. Edge and thickness are searched; both levels follow linearly.

Source: Treece et al. 2010, cortical thickness below the resolution of CT by a fixed plate density;
Treece and Gee 2015, an inner edge that fades into spongy bone.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from navapp.geometry.transform import FloatArray

# The profile's samples, mm along the outward normal.
INWARD_MM, OUTWARD_MM, STEP_MM = 5.0, 3.0, 0.25
_LEAST_MM, _MOST_MM, _THICKNESS_STEP_MM = 0.3, 6.0, 0.3
_OFFSET_STEP_MM = 0.1
# Soft tissue is about as dense as it is elsewhere: in a narrow gap little of it is seen.
_SOFT_SD_HU = 80.0
# Noise of one sample, for the weight of that: what clinical CTs of bone have.
_NOISE_HU = 25.0
_CHUNK = 4096


@dataclass(frozen=True, slots=True)
class Scan:
    """Densities and blur of one CT."""

    cortex_hu: float  # density of the plate
    soft_hu: float  # of the tissue around
    # blur_in_plane_mm, blur_axial_mm: standard deviations along the slices and across.
    blur_in_plane_mm: float
    blur_axial_mm: float
    # standard deviation of the plate's inner edge, which fades into spongy bone.
    fading_mm: float = 0.0

    def blur_mm(self, axial_fraction: FloatArray) -> FloatArray:
        """(N,) blur along directions whose cosine with the slices' normal is given."""
        plane_squared, axial_squared = self.blur_in_plane_mm**2, self.blur_axial_mm**2
        squared = plane_squared + (axial_squared - plane_squared) * axial_fraction**2
        result: FloatArray = np.sqrt(squared)
        return result


@dataclass(frozen=True, slots=True, eq=False)
class Edges:
    """Edges fitted to N profiles."""

    offset_mm: FloatArray  # (N,) of the edge along the outward normal
    thickness_mm: FloatArray  # (N,) of the plate
    misfit_hu2: FloatArray  # (N,) sum of squares that is left
    # (N,) second derivative of the misfit by the offset, HU2 per mm2: weight.
    sharpness: FloatArray
    is_at_end: np.ndarray  # (N,) the best offset is the first or last that was tried


def sample_positions_mm() -> FloatArray:
    """(n,) where a profile is sampled along the outward normal."""
    return np.arange(-INWARD_MM, OUTWARD_MM + 0.5 * STEP_MM, STEP_MM)


def fit_edges(
    profiles_hu: FloatArray, until_mm: float, blur_mm: float, scan: Scan, reach_mm: float
) -> Edges:
    """The edge in each profile, by search over offset and thickness.

    Args:
        profiles_hu: (N, n) samples at `sample_positions_mm`.
        until_mm: samples further out are of another bone and not looked at.
        blur_mm: standard deviation along these profiles.
        scan: densities.
        reach_mm: offsets within this are tried.
    """
    positions = sample_positions_mm()
    n_used = int((positions <= until_mm + 1e-9).sum())
    model = _model(n_used, round(blur_mm, 3), scan.fading_mm, scan.cortex_hu, reach_mm)
    parts = [
        _fit_model(model, profiles_hu[first : first + _CHUNK, :n_used], scan)
        for first in range(0, len(profiles_hu), _CHUNK)
    ]
    columns = [np.concatenate(column) for column in zip(*parts, strict=True)]
    return Edges(*columns)


@dataclass(frozen=True, slots=True, eq=False)
class _Model:
    """Predicted profiles for every tried pair of offset and thickness, offsets first."""

    offsets_mm: FloatArray  # (m,)
    plates: FloatArray  # (m * t, n + 1) profile of the plate alone
    # first, second: (m * t, n + 1) orthonormal span of the two levels.
    first: FloatArray
    second: FloatArray


@lru_cache(maxsize=64)
def _model(
    n_used: int, blur_mm: float, fading_mm: float, cortex_hu: float, reach_mm: float
) -> _Model:
    from scipy.special import ndtr

    positions = sample_positions_mm()[:n_used]
    n_steps = round(reach_mm / _OFFSET_STEP_MM)
    offsets = _OFFSET_STEP_MM * np.arange(-n_steps, n_steps + 1, dtype=np.float64)
    thickness = np.arange(_LEAST_MM, _MOST_MM + 0.5 * _THICKNESS_STEP_MM, _THICKNESS_STEP_MM)
    inside = ndtr((offsets[:, None, None] - positions) / blur_mm)
    inner_mm = float(np.hypot(blur_mm, fading_mm))
    below = ndtr((offsets[:, None, None] - thickness[:, None] - positions) / inner_mm)
    inside = np.broadcast_to(inside, below.shape)
    # The last row: the soft level is known beforehand to within some HU.
    known = _NOISE_HU / _SOFT_SD_HU
    soft = np.concatenate([1.0 - inside, np.full((*below.shape[:2], 1), known)], axis=2)
    deep = np.concatenate([below, np.zeros((*below.shape[:2], 1))], axis=2)
    plates = np.concatenate([inside - below, np.zeros((*below.shape[:2], 1))], axis=2)
    first = soft / np.linalg.norm(soft, axis=2, keepdims=True)
    second = deep - (first * deep).sum(axis=2, keepdims=True) * first
    second /= np.linalg.norm(second, axis=2, keepdims=True)
    flat = (-1, n_used + 1)
    return _Model(
        offsets, cortex_hu * plates.reshape(flat), first.reshape(flat), second.reshape(flat)
    )


def _fit_model(model: _Model, profiles_hu: FloatArray, scan: Scan) -> tuple[FloatArray, ...]:
    known = np.full((len(profiles_hu), 1), scan.soft_hu * _NOISE_HU / _SOFT_SD_HU)
    values = np.hstack([profiles_hu, known])
    left = (values**2).sum(axis=1)[:, None] - 2.0 * values @ model.plates.T
    left += (model.plates**2).sum(axis=1)
    for basis in (model.first, model.second):
        left -= (values @ basis.T - (model.plates * basis).sum(axis=1)) ** 2
    misfit = left.reshape(len(values), len(model.offsets_mm), -1)
    by_offset = misfit.min(axis=2)
    best = by_offset.argmin(axis=1)
    is_at_end = (best == 0) | (best == len(model.offsets_mm) - 1)
    middle = np.clip(best, 1, len(model.offsets_mm) - 2)
    rows = np.arange(len(values))
    # A thickness off the grid would move the edge: half of what one end is off, the other is.
    beside = [_lowest(misfit[rows, middle + step]) for step in (-1, 0, 1)]
    step, least = _vertex(*(value for value, _ in beside))
    before, here, after = (value for value, _ in beside)
    return (
        model.offsets_mm[middle] + step * _OFFSET_STEP_MM,
        _LEAST_MM + _THICKNESS_STEP_MM * beside[1][1],
        np.maximum(least, 0.0),
        np.maximum(before - 2.0 * here + after, 1e-9) / _OFFSET_STEP_MM**2,
        is_at_end,
    )


def _lowest(values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(N,) how low each of N rows gets between its samples, and where, in steps."""
    rows = np.arange(len(values))
    best = np.clip(values.argmin(axis=1), 1, values.shape[1] - 2)
    step, least = _vertex(*(values[rows, best + beside] for beside in (-1, 0, 1)))
    return least, best + step


def _vertex(
    before: FloatArray, here: FloatArray, after: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """(N,) where parabolas through three values are lowest, at most a step away, and how low."""
    slope, bend = 0.5 * (before - after), before - 2.0 * here + after
    step = np.clip(slope / np.maximum(bend, 1e-9), -1.0, 1.0)
    return step, here - slope * step + 0.5 * bend * step**2
