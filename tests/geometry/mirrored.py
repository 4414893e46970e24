"""Displays in a mirror for tests, drawn at random around a site 450 mm from the cameras."""

import numpy as np

from navapp.geometry.display_model import DisplayModel
from navapp.geometry.display_model_optics import Glass, VirtualScreen
from navapp.geometry.transform import rotation_from_vector

SITE_MM = np.array([0.0, 0.0, 450.0])


def display_of(
    rng: np.random.Generator,
    *,
    flips: tuple[bool, bool] = (True, False),
    glass_mm: float = 3.0,
    bulge_mm: float = 0.0,
    quality: object = None,
) -> DisplayModel:
    """An eye 450 mm above the site sees a 24 inch screen within 20 mm of it."""
    turn = rotation_from_vector(rng.normal(0.0, 0.3, 3))
    right, down, ahead = turn.T
    eye = SITE_MM - 450.0 * ahead
    tilt = rotation_from_vector(rng.normal(0.0, 0.03, 3))
    across = tilt @ (-right if flips[0] else right)
    below = tilt @ (-down if flips[1] else down)
    middle = SITE_MM + rng.uniform(-20.0, 20.0) * ahead + rng.normal(0.0, 10.0, 3)
    pitch = 0.2767
    origin = middle - 0.5 * pitch * (1919 * across + 1079 * below)
    normal = rotation_from_vector(rng.normal(0.0, 0.05, 3)) @ rotation_from_vector(
        0.785 * right
    ) @ ahead  # fmt: skip
    glass = Glass(glass_mm, normal) if glass_mm else None
    screen = VirtualScreen(origin, across, below, pitch, 1920, 1080, bulge_mm)
    return DisplayModel(screen, glass, eye, *flips, quality=quality)


def site_points(rng: np.random.Generator, n: int = 40) -> np.ndarray:
    """(n, 3) within 50 mm of the site's middle."""
    return SITE_MM + rng.uniform(-50.0, 50.0, (n, 3))
