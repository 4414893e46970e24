"""Slices across the patient's axes, and the contours of surfaces in them."""

import numpy as np
import pytest

from navapp.preop.slices import DIRECTIONS, MARGIN_MM, SliceGrid, cut_contour, make_grid
from tests.geometry.shapes import sphere

RADIUS_MM = 15.0


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("height_mm", [0.0, 7.3])
def test_a_ball_is_cut_in_a_circle(axis, height_mm) -> None:
    ball = sphere(RADIUS_MM, 60)
    ends = cut_contour(ball.vertices_mm, ball.faces, axis, height_mm)
    assert np.abs(ends[..., axis] - height_mm).max() < 1e-9
    radius = np.linalg.norm(np.delete(ends, axis, axis=2), axis=2)
    assert np.abs(radius - np.sqrt(RADIUS_MM**2 - height_mm**2)).max() < 0.1
    length = np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1).sum()
    assert length == pytest.approx(2.0 * np.pi * np.sqrt(RADIUS_MM**2 - height_mm**2), rel=0.01)


def test_what_a_plane_does_not_cross_has_no_contour() -> None:
    ball = sphere(RADIUS_MM, 20)
    assert len(cut_contour(ball.vertices_mm, ball.faces, 2, 20.0)) == 0


GRID = SliceGrid((-20.0, -10.0, 100.0), 2.0, (11, 7, 5))
# A vector from the patient's middle to each side, LPS.
SIDES = {
    "R": (-1, 0, 0), "L": (1, 0, 0), "A": (0, -1, 0),
    "P": (0, 1, 0), "F": (0, 0, -1), "H": (0, 0, 1),
}  # fmt: skip


@pytest.mark.parametrize("direction", DIRECTIONS, ids=lambda one: one.name)
def test_each_mark_stands_on_the_side_of_the_picture_that_it_names(direction) -> None:
    middle = np.array([0.0, 0.0, 104.0])
    at = GRID.find_pixels(direction, middle)
    for mark, towards in zip(direction.marks, ((-1, 0), (1, 0), (0, -1), (0, 1)), strict=True):
        moved = GRID.find_pixels(direction, middle + 2.0 * np.array(SIDES[mark]))
        np.testing.assert_allclose(moved - at, towards)


def test_the_first_slice_and_the_last_lie_where_the_grid_ends() -> None:
    axial, coronal, sagittal = DIRECTIONS
    assert [GRID.position_mm(one, 0) for one in DIRECTIONS] == [100.0, -10.0, -20.0]
    assert GRID.position_mm(sagittal, GRID.count_slices(sagittal) - 1) == 0.0
    assert GRID.shape_of(axial) == (7, 11)
    assert GRID.shape_of(coronal) == (5, 11)
    assert GRID.shape_of(sagittal) == (5, 7)
    # The head is up: the highest cube is in the first row.
    np.testing.assert_allclose(GRID.find_pixels(coronal, np.array([-20.0, 0, 108.0])), (0, 0))
    np.testing.assert_allclose(GRID.find_pixels(axial, np.array([-20.0, -10.0, 0])), (0, 0))


def test_a_point_belongs_to_the_nearest_slice_and_to_one_alone() -> None:
    points = np.array([[0, 0, z] for z in (100.9, 101.0, 101.1, 102.9, 103.0, 99.0, 98.9)], float)
    assert GRID.find_slices(DIRECTIONS[0], points).tolist() == [0, 1, 1, 1, 2, 0, -1]


def test_a_grid_surrounds_the_surfaces_at_whole_steps_within_what_was_recorded() -> None:
    ball = sphere(10.25, 10)
    grid = make_grid([ball])
    assert grid.origin_mm == (-25.0, -25.0, -25.0)
    assert MARGIN_MM == 15.0
    assert grid.size == (51, 51, 51)
    bounds = np.array([[-12.5, -100.0, -100.0], [100.0, 3.5, 100.0]])
    inside = make_grid([ball], bounds)
    assert inside.origin_mm == (-12.0, -25.0, -25.0)
    assert inside.size == (38, 29, 51)


def test_a_very_large_region_gets_a_longer_step() -> None:
    grid = make_grid([sphere(400.0, 10)])
    assert np.prod(grid.size) <= 8_500_000
    assert grid.step_mm == 4.25


@pytest.mark.parametrize("values", [((0, 0, np.nan), 1.0, (1, 1, 1)), ((0, 0, 0), 0.0, (1, 1, 1)),
                                    ((0, 0, 0), 1.0, (1, 0, 1))])  # fmt: skip
def test_what_is_no_grid_is_refused(values) -> None:
    with pytest.raises(ValueError, match="a grid has"):
        SliceGrid(*values)
