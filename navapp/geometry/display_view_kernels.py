"""Compiled projection of points onto a screen in the mirror, through its glass, for one eye."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray


class Optics(NamedTuple):
    """Screen, glass and eye as plain numbers; in the left camera's frame."""

    eye_mm: NDArray[np.float64]  # (3,)
    middle_mm: NDArray[np.float64]  # (3,) of the screen without bulge
    axes: NDArray[np.float64]  # (3, 3) rows across, down, across x down
    half_mm: NDArray[np.float64]  # (2,) from pixel (0, 0) to the middle
    pitch_mm: float
    bulge_mm: float
    normal: NDArray[np.float64]  # (3,) of the glass
    thickness_mm: float  # of the glass, 0 without
    refractive_index: float
    n_turns: int  # of the search for the way through the glass


@njit(cache=True, nogil=True)
def project_to_screen(
    points_mm: NDArray[np.float64], optics: Optics, pixels: NDArray[np.float64]
) -> None:
    """Picture px where points are drawn; NaN at and behind the eye.

    Args:
        points_mm: (N, 3).
        optics: of the view.
        pixels: (N, 2) in place.
    """
    start = np.zeros(3)
    for k in range(3):
        for axis in range(3):
            start[axis] += (optics.eye_mm[k] - optics.middle_mm[k]) * optics.axes[axis, k]
    half_x, half_y = optics.half_mm[0], optics.half_mm[1]
    curve = optics.bulge_mm / (half_x * half_x + half_y * half_y)
    c = start[2] - optics.bulge_mm + curve * (start[0] * start[0] + start[1] * start[1])
    ray, step = np.empty(3), np.empty(3)
    for i in range(len(points_mm)):
        _look_through(points_mm[i], optics, ray)
        for axis in range(3):
            step[axis] = (
                ray[0] * optics.axes[axis, 0]
                + ray[1] * optics.axes[axis, 1]
                + ray[2] * optics.axes[axis, 2]
            )
        a = curve * (step[0] * step[0] + step[1] * step[1])
        b = step[2] + 2.0 * curve * (start[0] * step[0] + start[1] * step[1])
        root = b * b - 4.0 * a * c
        pixels[i, 0] = pixels[i, 1] = np.nan
        # Through a bulge a line may meet the far branch: it must go towards the screen's plane.
        if not root >= 0.0 or step[2] * -start[2] <= 0.0:
            continue
        # Of the two places the one that a flat screen leaves, without loss of digits.
        below = b + np.copysign(np.sqrt(root), b)
        if below == 0.0:
            continue
        reach = -2.0 * c / below
        if reach > 0.0:
            pixels[i, 0] = (start[0] + reach * step[0] + half_x) / optics.pitch_mm
            pixels[i, 1] = (start[1] + reach * step[1] + half_y) / optics.pitch_mm


@njit(cache=True, nogil=True)
def _look_through(point_mm: NDArray[np.float64], optics: Optics, ray: NDArray[np.float64]) -> None:
    """From the eye to where a point appears behind the glass."""
    normal = optics.normal
    shift = 0.0
    for turn in range(optics.n_turns + 1):
        for k in range(3):
            ray[k] = point_mm[k] - shift * normal[k] - optics.eye_mm[k]
        if optics.thickness_mm == 0.0 or turn == optics.n_turns:
            return
        length = np.sqrt(ray[0] * ray[0] + ray[1] * ray[1] + ray[2] * ray[2])
        along = ray[0] * normal[0] + ray[1] * normal[1] + ray[2] * normal[2]
        cosine = abs(along) / max(length, 1e-12)
        below = np.sqrt(optics.refractive_index * optics.refractive_index - 1.0 + cosine * cosine)
        shift = optics.thickness_mm * (1.0 - cosine / below)
