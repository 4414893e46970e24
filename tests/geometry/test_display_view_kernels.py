"""The compiled way through the mirror beside the readable one."""

import numpy as np
import pytest

from navapp.geometry.display_model_optics import Glass, VirtualScreen
from navapp.geometry.display_model_view import make_view, project
from tests.reference import display_view_reference as reference

MIDDLE = np.array([5.0, -8.0, 450.0])
AHEAD = np.array([0.1, 0.2, 1.0]) / np.sqrt(1.05)
ACROSS = np.cross([0.0, 1.0, 0.0], AHEAD)
ACROSS /= np.linalg.norm(ACROSS)
DOWN = np.cross(AHEAD, ACROSS)
EYE = MIDDLE - 420.0 * AHEAD


def screen(bulge_mm: float) -> VirtualScreen:
    corner = MIDDLE - 0.25 * 799 * ACROSS * 0.5 * 2 - 0.25 * 599 * DOWN
    return VirtualScreen(corner, ACROSS, DOWN, 0.5, 800, 600, bulge_mm)


@pytest.mark.kernel
@pytest.mark.parametrize("bulge_mm", [0.0, 6.0, -4.0])
@pytest.mark.parametrize("thickness_mm", [None, 0.0, 3.0])
def test_points_are_drawn_where_the_readable_formula_says(bulge_mm, thickness_mm) -> None:
    rng = np.random.default_rng(7)
    slanted = (AHEAD + DOWN) / np.linalg.norm(AHEAD + DOWN)
    glass = None if thickness_mm is None else Glass(thickness_mm, slanted)
    view = make_view(screen(bulge_mm), glass, EYE, (False, False))
    points = MIDDLE + rng.uniform(-120.0, 120.0, (300, 3))
    points[:3] = EYE - 50.0 * AHEAD  # behind the eye
    expected = reference.project(view.screen, glass, EYE, points)
    assert np.isnan(expected[:3]).all()
    found = view.camera.project(view.warp(points))
    np.testing.assert_allclose(found, expected, atol=1e-7)
    found = project(view.screen, glass, EYE, points)
    np.testing.assert_allclose(found, expected, atol=1e-9)
