import numpy as np

from navapp.preop.defects import SPOT_RADIUS_MM, paint_near, paint_within
from tests.geometry.shapes import sphere

BALL = sphere(30.0, 60)


def ring(height_mm: float, radius_mm: float, n: int = 24) -> np.ndarray:
    angle = np.linspace(0.0, 2.0 * np.pi, n, endpoint=False)
    return np.column_stack(
        [radius_mm * np.cos(angle), radius_mm * np.sin(angle), np.full(n, height_mm)]
    )


def test_a_spot_is_what_lies_near_its_point() -> None:
    points = np.array([[0.0, 0.0, 30.0], [30.0, 0.0, 0.0]])
    distance = np.linalg.norm(BALL.vertices_mm[:, None] - points, axis=2).min(axis=1)
    np.testing.assert_array_equal(
        paint_near(BALL, points), np.flatnonzero(distance <= SPOT_RADIUS_MM)
    )
    assert len(paint_near(BALL, points + 100.0)) == 0


def test_an_outline_paints_the_cap_within_it_and_not_the_far_side() -> None:
    outline = ring(np.sqrt(30.0**2 - 12.0**2), 12.0)
    painted = paint_within(BALL, outline)
    x, y, z = BALL.vertices_mm.T
    beside = np.hypot(x, y)
    inside = np.flatnonzero((beside < 11.5) & (z > 0.0))
    assert len(inside) > 20
    assert set(inside) <= set(painted)
    assert (beside[painted] < 12.1).all()
    assert (z[painted] > 0.0).all()


def test_an_outline_drawn_on_the_cartilage_paints_the_bone_below() -> None:
    on_bone = paint_within(BALL, ring(27.5, 12.0))
    np.testing.assert_array_equal(paint_within(BALL, ring(30.0, 12.0)), on_bone)


def test_an_outline_that_is_bent_inwards_is_followed() -> None:
    """A crescent: what its bay leaves out is not painted."""
    outline = np.array([[-10.0, -8, 28], [10, -8, 28], [10, 8, 28], [0, -4, 28], [-10, 8, 28]])
    painted = BALL.vertices_mm[paint_within(BALL, outline)]
    assert len(painted) > 5
    assert not ((np.abs(painted[:, 0]) < 2.0) & (painted[:, 1] > 0.0)).any()


def test_an_outline_round_the_whole_bone_means_nothing() -> None:
    assert len(paint_within(BALL, ring(0.0, 30.0))) == 0
