"""Robust least squares of a display model over alignments, and the operator's noise."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibration.mirror.alignment_start import AlignedDisplay
from navapp.geometry.directions import perpendicular_axes
from navapp.geometry.display_model import N_PARAMETERS, DisplayModel
from navapp.geometry.display_model_errors import (
    EYE_NUMBERS,
    pixels_by_parameters,
    pixels_by_points,
)
from navapp.geometry.transform import FloatArray

# No operator aligns better than the first; crosses that were confirmed where they were lit err by
# less than the last.
_LEAST_SD_PX, _MOST_SD_PX = 0.3, 100.0
_HUBER, WORST = 2.0, 4.5
_MOST_STEPS, _SETTLED = 60, 1e-4
# Numbers of `DisplayModel.move` that the pixels cannot tell from others: known beforehand to so
# much. The bulge is held.
_TOLD_SDS = {6: 0.003, 8: 0.3, 9: 0.15, 10: 0.15}
_HELD = (7,)


@dataclass(frozen=True, slots=True, eq=False)
class Alignments:
    """Crosses that were aligned, in their order."""

    pixels: FloatArray  # (N, 2) where the cross was, in the display's picture
    points_mm: FloatArray  # (N, 3) in the left camera's frame
    points_sd_mm: FloatArray  # (N,) standard error of a coordinate

    def only(self, kept: NDArray[np.bool_]) -> "Alignments":
        """Some of them."""
        return Alignments(self.pixels[kept], self.points_mm[kept], self.points_sd_mm[kept])


@dataclass(frozen=True, slots=True, eq=False)
class AlignmentPriors:
    """What is known beforehand of numbers that the pixels hardly tell."""

    start: DisplayModel
    display: AlignedDisplay

    @property
    def free(self) -> NDArray[np.intp]:
        """Numbers of `DisplayModel.move` that are solved for."""
        held = (*_HELD, *(() if self.start.glass is not None else (8, 9, 10)))
        return np.array([k for k in range(N_PARAMETERS) if k not in held])

    def deviations(self, model: DisplayModel) -> FloatArray:
        """(14,) from what is told, 0 where nothing is."""
        off = np.zeros(N_PARAMETERS)
        off[6] = model.screen.pitch_mm / self.display.pitch_mm - 1.0
        if model.glass is not None and self.start.glass is not None:
            off[8] = model.glass.thickness_mm - self.start.glass.thickness_mm
            off[9:11] = _tilt_between(self.start.glass.normal, model.glass.normal)
        return off


def _tilt_between(told: FloatArray, solved: FloatArray) -> FloatArray:
    """(2,) rad by which a normal was tilted, about the two axes of `DisplayModel.move`."""
    across = np.cross(told, solved)
    length = float(np.linalg.norm(across))
    turn = across * (np.arctan2(length, float(told @ solved)) / max(length, 1e-12))
    return np.asarray(perpendicular_axes(solved[None])[0] @ turn, dtype=np.float64)


def spread_out(covariance: FloatArray, priors: AlignmentPriors) -> FloatArray:
    """(14, 14) of all numbers of `DisplayModel.move`, from that of the free ones."""
    whole = np.zeros((N_PARAMETERS, N_PARAMETERS))
    whole[np.ix_(priors.free, priors.free)] = covariance
    return whole


def compute_noise(
    model: DisplayModel,
    points_mm: FloatArray,
    points_sd_mm: FloatArray,
    sd_px: float,
    wander_sd_mm: float,
) -> FloatArray:
    """(N, 2, 2) px^2 of alignments: the operator's, the eye's wandering, the points'."""
    by_eye = pixels_by_parameters(model, points_mm, EYE_NUMBERS)
    by_point = pixels_by_points(model, points_mm)
    noise: FloatArray = sd_px**2 * np.eye(2) + wander_sd_mm**2 * by_eye @ by_eye.transpose(0, 2, 1)
    return noise + points_sd_mm[:, None, None] ** 2 * by_point @ by_point.transpose(0, 2, 1)


def _whiteners(
    model: DisplayModel, given: Alignments, sd_px: float, wander_sd_mm: float
) -> FloatArray:
    """(N, 2, 2) that turn residuals into such of standard deviation one."""
    return _invert_roots(
        compute_noise(model, given.points_mm, given.points_sd_mm, sd_px, wander_sd_mm)
    )


def _invert_roots(noise: FloatArray) -> FloatArray:
    """(N, 2, 2) that turn noise of covariance (N, 2, 2) into such of standard deviation one."""
    return np.asarray(np.linalg.inv(np.linalg.cholesky(noise)), dtype=np.float64)


def compute_lengths(
    model: DisplayModel, given: Alignments, sd_px: float, wander_sd_mm: float
) -> FloatArray:
    """(N,) residuals in units of their standard deviation."""
    residual = given.pixels - model.project(given.points_mm)
    return _whitened_lengths(_whiteners(model, given, sd_px, wander_sd_mm), residual)


def _whitened_lengths(whiteners: FloatArray, residual: FloatArray) -> FloatArray:
    """(N,) of residuals (N, 2) px, in units of their standard deviation."""
    white = (whiteners @ residual[:, :, None])[:, :, 0]
    return np.asarray(np.linalg.norm(white, axis=1))


def scale_of(lengths: FloatArray) -> float:
    """Brings whitened residuals to the spread that two normal coordinates have."""
    return 1.1774 / max(float(np.median(lengths)), 1e-9)


def count_solved(
    model: DisplayModel,
    given: Alignments,
    priors: AlignmentPriors,
    sd_px: float,
    wander_sd_mm: float,
) -> float:
    """How many numbers the alignments fix; one that was told before counts for a part."""
    normal, _ = make_normal(model, given, priors, sd_px, wander_sd_mm)
    told = np.zeros(N_PARAMETERS)
    for k, sd in _TOLD_SDS.items():
        told[k] = 1.0 / sd**2
    return float(len(normal) - np.diag(invert(normal)) @ told[priors.free])


def invert(normal: FloatArray) -> FloatArray:
    """(n, n) covariance of a normal matrix."""
    return np.asarray(np.linalg.inv(normal), dtype=np.float64)


def estimate_sd_px(
    model: DisplayModel, given: Alignments, wander_sd_mm: float, n_solved: float
) -> float:
    """The operator's noise with which the residuals are as large as they should be."""
    aim = max(1.0 - n_solved / (2.0 * len(given.pixels)), 0.1)
    residual = given.pixels - model.project(given.points_mm)
    # The operator's noise is the same in every alignment: it is added below.
    noise_of_rest = compute_noise(model, given.points_mm, given.points_sd_mm, 0.0, wander_sd_mm)
    low, high = _LEAST_SD_PX, _MOST_SD_PX
    for _ in range(24):
        middle = (low * high) ** 0.5
        white = _invert_roots(noise_of_rest + middle**2 * np.eye(2))
        lengths = np.minimum(_whitened_lengths(white, residual), WORST)
        is_larger = 0.5 * float((lengths**2).mean()) > aim
        low, high = (middle, high) if is_larger else (low, middle)
    return high


def make_normal(
    model: DisplayModel,
    given: Alignments,
    priors: AlignmentPriors,
    sd_px: float,
    wander_sd_mm: float,
) -> tuple[FloatArray, FloatArray]:
    """Normal matrix and right side of the free numbers."""
    white = _whiteners(model, given, sd_px, wander_sd_mm)
    residual = (white @ (given.pixels - model.project(given.points_mm))[:, :, None])[:, :, 0]
    slopes = white @ pixels_by_parameters(model, given.points_mm)
    weights = np.minimum(1.0, _HUBER / np.maximum(np.linalg.norm(residual, axis=1), 1e-9))
    weighted = slopes * weights[:, None, None]
    normal = np.tensordot(weighted, slopes, axes=((0, 1), (0, 1)))
    right = np.tensordot(weighted, residual, axes=((0, 1), (0, 1)))
    off = priors.deviations(model)
    for k, sd in _TOLD_SDS.items():
        normal[k, k] += 1.0 / sd**2
        right[k] -= off[k] / sd**2
    return normal[np.ix_(priors.free, priors.free)], right[priors.free]


def _cost(
    model: DisplayModel, given: Alignments, priors: AlignmentPriors, white: FloatArray
) -> float:
    residual = (white @ (given.pixels - model.project(given.points_mm))[:, :, None])[:, :, 0]
    lengths = np.linalg.norm(np.nan_to_num(residual, nan=1e3), axis=1)
    robust = np.where(lengths < _HUBER, 0.5 * lengths**2, _HUBER * (lengths - 0.5 * _HUBER))
    off = priors.deviations(model)
    known = [0.5 * float(off[k] / sd) ** 2 for k, sd in _TOLD_SDS.items()]
    return float(robust.sum()) + sum(known)


def fit_model(
    model: DisplayModel,
    given: Alignments,
    priors: AlignmentPriors,
    sd_px: float,
    wander_sd_mm: float,
) -> DisplayModel:
    """Levenberg's steps from a model."""
    damping = 1e-3
    for _ in range(_MOST_STEPS):
        normal, right = make_normal(model, given, priors, sd_px, wander_sd_mm)
        cost = _cost(model, given, priors, _whiteners(model, given, sd_px, wander_sd_mm))
        damped = normal + damping * np.diag(np.diag(normal))
        step = np.zeros(N_PARAMETERS)
        step[priors.free] = np.linalg.lstsq(damped, right, rcond=None)[0]
        try:
            moved = model.move(step)
        except ValueError:
            # A step so long that the eye would look from behind.
            damping *= 10.0
            continue
        # Under the weights of where it began: a screen far away would explain all by wandering.
        white = _whiteners(model, given, sd_px, wander_sd_mm)
        gain = cost - _cost(moved, given, priors, white)
        if gain <= 0.0:
            if damping > 1e6:
                break
            damping *= 4.0
            continue
        model, damping = moved, max(0.2 * damping, 1e-9)
        if gain < _SETTLED:
            break
    return model
