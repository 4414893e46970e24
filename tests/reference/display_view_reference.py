"""Where points are drawn on a screen in a mirror, by the formulas of its optics."""

import numpy as np


def project(screen, glass, eye_mm, points_mm) -> np.ndarray:
    """(N, 2) px of points (N, 3) for an eye at (3,); NaN at and behind it."""
    apparent = points_mm if glass is None else glass.apparent_mm(points_mm, eye_mm)
    pixels = intersect(screen, eye_mm, apparent)
    # Through a bulge a line may meet the paraboloid's far branch behind the eye's plane.
    ahead = ((apparent - eye_mm) @ screen.normal) * ((screen.middle_mm - eye_mm) @ screen.normal)
    return np.where((ahead > 0.0)[:, None], pixels, np.nan)


def intersect(screen, from_mm, through_mm) -> np.ndarray:
    """(N, 2) px in which lines from (3,) through (N, 3) meet a screen; NaN where they do not."""
    start = (from_mm - screen.middle_mm) @ screen.axes.T
    step = (through_mm - from_mm) @ screen.axes.T
    half = screen.half_mm
    curve = screen.bulge_mm / float(half @ half)
    a = curve * (step[..., :2] ** 2).sum(axis=-1)
    b = step[..., 2] + 2.0 * curve * (start[..., :2] * step[..., :2]).sum(axis=-1)
    c = start[..., 2] - screen.bulge_mm + curve * (start[..., :2] ** 2).sum(axis=-1)
    with np.errstate(invalid="ignore", divide="ignore"):
        reach = -2.0 * c / (b + np.copysign(np.sqrt(b * b - 4.0 * a * c), b))
    reach = np.where(reach > 0.0, reach, np.nan)
    return (start[..., :2] + reach[..., None] * step[..., :2] + half) / screen.pitch_mm
