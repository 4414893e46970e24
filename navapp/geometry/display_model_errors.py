"""Predicted errors of what is drawn in a mirror, in mm at the point that it is drawn on.

Seen from an eye, what is drawn for a point appears beside it; the error is the distance between the
two, perpendicular to the line of sight, at the point's own depth.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from scipy.special import chdtri

from navapp.geometry.directions import perpendicular_axes
from navapp.geometry.transform import FloatArray

if TYPE_CHECKING:
    from navapp.geometry.display_model import DisplayModel

# Steps of the differences: rad, mm, shares; small against what curves, large against rounding.
_STEPS = np.array(
    [1e-5, 1e-5, 1e-5, 1e-2, 1e-2, 1e-2, 1e-5, 1e-3, 1e-3, 1e-5, 1e-5, 1e-2, 1e-2, 1e-2]
)
EYE_NUMBERS = (11, 12, 13)  # those of the eye's place, of `DisplayModel.move`
_BEYOND = 0.05
EYE_DISTANCE_MM = 63.0  # between the pupils of an adult, the mean


def pixels_by_parameters(
    model: "DisplayModel", points_mm: FloatArray, numbers: Sequence[int] = range(14)
) -> FloatArray:
    """(N, 2, n) px by some numbers of `DisplayModel.move`, for the model's eye."""
    slopes = np.empty((len(points_mm), 2, len(numbers)))
    for k, number in enumerate(numbers):
        step = _STEPS[number]
        change = np.zeros(len(_STEPS))
        change[number] = step
        ahead, back = model.move(change), model.move(-change)
        slopes[:, :, k] = (ahead.project(points_mm) - back.project(points_mm)) / (2.0 * step)
    return slopes


def pixels_by_points(model: "DisplayModel", points_mm: FloatArray) -> FloatArray:
    """(N, 2, 3) px by the points' coordinates, mm, for the model's eye."""
    step = 1e-2
    slopes = np.empty((len(points_mm), 2, 3))
    for k, axis in enumerate(np.eye(3)):
        ahead, back = model.project(points_mm + step * axis), model.project(points_mm - step * axis)
        slopes[:, :, k] = (ahead - back) / (2.0 * step)
    return slopes


def millimetres_by_pixels(model: "DisplayModel", points_mm: FloatArray) -> FloatArray:
    """(N, 2, 2) displacement at the points, perpendicular to the line of sight, by px."""
    across = perpendicular_axes(points_mm - model.eye_mm)
    in_plane = pixels_by_points(model, points_mm) @ across.transpose(0, 2, 1)
    return np.asarray(np.linalg.inv(in_plane), dtype=np.float64)


def predict_error_mm(
    model: "DisplayModel",
    points_mm: FloatArray,
    eye_sd_mm: float,
    point_covariance: FloatArray | None,
    has_calibration: bool,
) -> FloatArray:
    """(N,) that 95 % of the errors at points (N, 3) stay below; see `DisplayModel`."""
    by_points = pixels_by_points(model, points_mm)
    across = perpendicular_axes(points_mm - model.eye_mm)
    to_mm = np.linalg.inv(by_points @ across.transpose(0, 2, 1))
    spread = np.zeros((len(points_mm), 2, 2))
    covariance = None if model.quality is None else model.quality.covariance
    if has_calibration and covariance is not None:
        slopes = to_mm @ pixels_by_parameters(model, points_mm)
        spread += slopes @ covariance @ slopes.transpose(0, 2, 1)
    if eye_sd_mm > 0.0:
        slopes = to_mm @ pixels_by_parameters(model, points_mm, EYE_NUMBERS)
        spread += eye_sd_mm**2 * slopes @ slopes.transpose(0, 2, 1)
    if point_covariance is not None:
        slopes = to_mm @ by_points
        spread += slopes @ np.asarray(point_covariance) @ slopes.transpose(0, 2, 1)
    return bound_of_spread(spread)


def bound_of_spread(spread: FloatArray) -> FloatArray:
    """(N,) that the length of a normal error with covariance (N, 2, 2) stays below in 95 %.

    Its square is taken as a chi-square of matched mean and variance (Welch, Satterthwaite).
    """
    mean = np.trace(spread, axis1=1, axis2=2)
    squares = (spread * spread.transpose(0, 2, 1)).sum(axis=(1, 2))
    safe = np.maximum(mean, 1e-30)
    freedom = np.clip(safe**2 / np.maximum(squares, 1e-60), 1.0, 2.0)
    bound: FloatArray = np.sqrt(mean / freedom * chdtri(freedom, _BEYOND))
    return bound


def error_for_other_eye_mm(model: "DisplayModel", points_mm: FloatArray) -> FloatArray:
    """(N,) how far from points (N, 3) what is drawn for the viewing eye appears to the other."""
    drawn = model.screen.points_mm(model.project(points_mm))
    errors = []
    for other in other_eyes_mm(model):
        seen = points_mm if model.glass is None else model.glass.apparent_mm(points_mm, other)
        lines = drawn - other
        lines = lines / np.linalg.norm(lines, axis=1, keepdims=True)
        errors.append(np.linalg.norm(np.cross(seen - other, lines), axis=1))
    largest: FloatArray = np.max(errors, axis=0)
    return largest


def other_eyes_mm(model: "DisplayModel") -> FloatArray:
    """(n, 3) where the other eye is, or may be: a pupils' distance away along the rows."""
    if model.other_eye_mm is not None:
        return model.other_eye_mm[None]
    aside = EYE_DISTANCE_MM * model.screen.across
    return np.vstack([model.eye_mm - aside, model.eye_mm + aside])


def screen_shift_mm(model: "DisplayModel", points_mm: FloatArray) -> float:
    """By how much the screen must move along its normal, away from the eye, to points (N, 3).

    Then what is drawn on the mean of them is right for both eyes.
    """
    eye = model.eye_mm
    seen = points_mm if model.glass is None else model.glass.apparent_mm(points_mm, eye)
    away = model.screen.normal * np.sign(model.screen.normal @ (model.screen.middle_mm - eye))
    return float(((seen - model.screen.points_mm(model.project(points_mm))) @ away).mean())
