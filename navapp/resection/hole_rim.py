"""The rim of a hole: a dark disc on the skin, and the circle where brightness rises around it."""

import numpy as np

from navapp.geometry.transform import FloatArray
from navapp.resection.hole_view import Eye, SkinPatch
from navapp.values import DrillAxis

# All chosen. A drill misses its plan by no more; a hole is as wide as its drill within so much.
MOST_OFF_MM, _MOST_WIDER = 4.0, 0.25
# Of the search for the disc; so much of the skin must be seen. Radii of disc and ring, in the
# drill's own; bone is as light as this percentile of what is seen.
_GRID_MM, _LEAST_SEEN, _BONE_PERCENTILE = 0.3, 0.6, 75
_DISC, _RING = 0.85, (1.1, 1.6)
# Of the rim's brightness over the hole's, within a millimetre; noise alone shows no such step.
_LEAST_CONTRAST, _EDGE_MM = 0.25, 1.0
# Rays around the middle, how often they are drawn anew, and steps of a fit between.
_N_RAYS, _ROUNDS, _STEPS = 72, 5, 8
# Along a ray, in the drill's radii; samples, and the blur before the steepest rise is looked for.
_FROM, _TO, _STEP_MM, _BLUR_MM, _TAPS = 0.55, 1.5, 0.1, 0.2, 6
# Width of the kernel of the fit, and how far neighbouring rays go together.
_KERNEL_MM, _SHARING_RAYS = 0.25, 4.0


def find_dark_disc(
    eyes: list[Eye], patch: SkinPatch, planned: DrillAxis
) -> tuple[FloatArray, float] | None:
    """(2,) middle of the darkest disc as wide as the drill, and how light bone is around it."""
    import cv2

    radius_mm = 0.5 * planned.diameter_mm
    reach_mm = MOST_OFF_MM + _RING[1] * radius_mm
    line = np.arange(-reach_mm, reach_mm, _GRID_MM)
    flat_mm = np.stack(np.meshgrid(line, line), axis=-1).reshape(-1, 2)
    points_mm = patch.place(flat_mm)
    seen = np.mean([eye.look(points_mm) for eye in eyes], axis=0).reshape(len(line), len(line))
    is_known = np.isfinite(seen)
    if is_known.mean() < _LEAST_SEEN:
        return None
    seen = np.where(is_known, seen, np.nanmedian(seen)).astype(np.float32)
    cells = int(np.ceil(_RING[1] * radius_mm / _GRID_MM))
    distance = np.hypot(*np.mgrid[-cells : cells + 1, -cells : cells + 1]) * _GRID_MM
    away = distance / radius_mm
    disc, ring = away < _DISC, (away > _RING[0]) & (away < _RING[1])
    dark, light = (
        cv2.filter2D(seen, cv2.CV_32F, (one / one.sum()).astype(np.float32)) for one in (disc, ring)
    )
    bone = float(np.percentile(seen[is_known], _BONE_PERCENTILE))
    contrast = (light - dark) / max(bone, 1.0)
    is_near = np.hypot(flat_mm[:, 0], flat_mm[:, 1]).reshape(seen.shape) <= MOST_OFF_MM
    best = int(np.argmax(np.where(is_near, contrast, -1.0)))
    if contrast.flat[best] < _LEAST_CONTRAST:
        return None
    return flat_mm[best], bone


def fit_circle(
    eyes: list[Eye], patch: SkinPatch, planned: DrillAxis, middle: FloatArray, bone: float
) -> tuple[FloatArray, FloatArray, float] | None:
    """(3,) middle and radius of the rim, (3, 3) covariance of middle and diameter, share seen.

    Weighted least squares under a kernel (Welsch's, as of `fit_disparity_plane`): a drill, blood
    and highlights do not count.
    """
    radius_mm = 0.5 * planned.diameter_mm
    circle = np.array([*middle, radius_mm])
    angles = 2.0 * np.pi * np.arange(_N_RAYS) / _N_RAYS
    rays = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    rows = np.concatenate([np.column_stack([rays, np.ones(_N_RAYS)])] * len(eyes))
    for _ in range(_ROUNDS):
        rims_mm = [
            _find_rim(eye, patch, circle, rays, radius_mm, _LEAST_CONTRAST * bone) for eye in eyes
        ]
        residual_mm = np.concatenate(rims_mm) - circle[2]
        known = np.isfinite(residual_mm)
        if np.count_nonzero(known) < _N_RAYS // 2:
            return None
        step, normal, misfit_mm = _solve(rows[known], residual_mm[known])
        circle = circle + step
        if np.hypot(*circle[:2]) > MOST_OFF_MM:
            return None
    if abs(circle[2] / radius_mm - 1.0) > _MOST_WIDER:
        return None
    share = float(np.count_nonzero(np.abs(misfit_mm) < 2.0 * _KERNEL_MM) / len(rows))
    weight = _weigh(misfit_mm)
    variance = float((weight * misfit_mm**2).sum() / weight.sum())
    covariance = _SHARING_RAYS * variance * np.linalg.inv(normal)
    to_diameter = np.diag([1.0, 1.0, 2.0])
    return circle, to_diameter @ covariance @ to_diameter, share


def _solve(rows: FloatArray, residual_mm: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """(3,) step, (3, 3) its normal matrix and (N,) what is left of the residuals."""
    step = np.zeros(3)
    for _ in range(_STEPS):
        weighted = rows.T * _weigh(residual_mm - rows @ step)
        normal = weighted @ rows
        step = np.asarray(np.linalg.solve(normal, weighted @ residual_mm), dtype=np.float64)
    return step, normal, residual_mm - rows @ step


def _weigh(misfit_mm: FloatArray) -> FloatArray:
    weight: FloatArray = np.exp(-0.5 * (misfit_mm / _KERNEL_MM) ** 2)
    return weight


def _find_rim(
    eye: Eye,
    patch: SkinPatch,
    circle: FloatArray,
    rays: FloatArray,
    radius_mm: float,
    least: float,
) -> FloatArray:
    """(N,) mm from the circle's middle where brightness rises most along each ray; NaN: nowhere."""
    away_mm: FloatArray = np.arange(_FROM * radius_mm, _TO * radius_mm, _STEP_MM)
    flat_mm = circle[:2] + away_mm[None, :, None] * rays[:, None]
    seen = np.asarray(eye.look(patch.place(flat_mm.reshape(-1, 2)))).reshape(len(rays), -1)
    kernel = np.exp(-0.5 * (np.arange(-_TAPS, _TAPS + 1) * _STEP_MM / _BLUR_MM) ** 2)
    smooth = np.apply_along_axis(np.convolve, 1, seen, kernel / kernel.sum(), mode="same")
    slope: FloatArray = np.asarray(np.gradient(smooth, _STEP_MM, axis=1))[:, _TAPS + 1 : -_TAPS - 1]
    slope = np.where(np.isfinite(slope), slope, -np.inf)
    best = np.clip(slope.argmax(axis=1), 1, slope.shape[1] - 2)
    row = np.arange(len(rays))
    before, at, after = slope[row, best - 1], slope[row, best], slope[row, best + 1]
    with np.errstate(invalid="ignore", divide="ignore"):
        shift = 0.5 * (before - after) / (before - 2.0 * at + after)
    is_found = (at > least / _EDGE_MM) & (np.abs(shift) <= 1.0)
    found = away_mm[_TAPS + 1 + best] + shift * _STEP_MM
    return np.where(is_found, found, np.nan)
