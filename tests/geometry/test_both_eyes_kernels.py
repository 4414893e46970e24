"""What the right eye sees of a left view, against plain numpy and against geometry."""

from functools import cache

import numpy as np
import pytest

from navapp.geometry.both_eyes_kernels import mark_unclear, warp_depth
from navapp.geometry.transform import RigidTransform
from navapp.geometry.zbuffer import RenderedView, render_rectified
from tests.geometry.shapes import sphere
from tests.reference import both_eyes_reference as reference
from tests.registration.shapes import GEOMETRY, TRUE, femur
from tests.views import project_box

SCALE_PX_MM = GEOMETRY.focal_px * GEOMETRY.baseline_mm


@cache
def left_view() -> RenderedView:
    box = project_box(femur().mesh, TRUE, GEOMETRY).grow(16)
    return render_rectified(femur().mesh, TRUE, GEOMETRY, box)


def unclear(disparity_px: np.ndarray, reach_px: int) -> np.ndarray:
    marked = np.zeros(disparity_px.shape, dtype=bool)
    mark_unclear(disparity_px.astype(np.float32), reach_px, marked)
    return marked


@pytest.mark.kernel
@pytest.mark.parametrize(("before", "width"), [(270, 400), (200, 150), (150, 60)])
def test_the_warped_buffer_is_that_of_the_reference(before: int, width: int) -> None:
    """Also where it ends before the surface does, on either side."""
    view = left_view()
    # What is written beside the buffer would show.
    around = np.full((view.box.height, width + 20), np.nan, dtype=np.float32)
    warped, first = around[:, 10:-10], view.box.x - before
    warp_depth(view.depth_mm, view.box.x, SCALE_PX_MM, warped, first)
    expected = reference.warped(view.depth_mm, view.box.x, SCALE_PX_MM, width, first)
    assert np.isfinite(warped).mean() > 0.2
    # A pixel that falls on a border may round to either side.
    is_same = np.isclose(warped, expected, rtol=1e-6, equal_nan=True)
    assert is_same.mean() > 0.999
    assert np.isnan(around[:, :10]).all()
    assert np.isnan(around[:, -10:]).all()


@pytest.mark.kernel
def test_the_nearer_of_two_stays_in_the_warped_buffer() -> None:
    first = -300
    depth = np.full((2, 400), np.nan, dtype=np.float32)
    # The far one comes first in a row, the near one falls on its columns.
    depth[0, 94], depth[0, 150] = SCALE_PX_MM / 224.4, SCALE_PX_MM / 280.4
    # The near one comes first, and the far one falls on its second column.
    depth[1, 150], depth[1, 151] = SCALE_PX_MM / 280.6, SCALE_PX_MM / 280.3
    warped = np.full((2, 400), np.nan, dtype=np.float32)
    warp_depth(depth, 0, SCALE_PX_MM, warped, first)
    np.testing.assert_allclose(
        warped, reference.warped(depth, 0, SCALE_PX_MM, 400, first), rtol=1e-6
    )
    assert np.flatnonzero(warped[0] == depth[0, 150]).tolist() == [169, 170]
    assert np.flatnonzero(warped[1] == depth[1, 150]).tolist() == [169, 170]


@pytest.mark.kernel
@pytest.mark.parametrize("reach_px", [0, 1, 2, 3])
def test_unclear_pixels_are_those_of_the_reference(reach_px: int) -> None:
    bone = GEOMETRY.disparity_map_px(left_view().depth_mm)
    rng = np.random.default_rng(7)
    steps = rng.choice([0.0, 0.5, -0.5, 1.4, 2.0, -4.0], (40, 60))
    rough = (250.0 + np.cumsum(steps, axis=1)).astype(np.float32)
    rough[rng.random(rough.shape) < 0.1] = np.nan
    for disparity_px in (bone, rough, rough[:1], rough[:, :1]):
        found = unclear(disparity_px, reach_px)
        np.testing.assert_array_equal(found, reference.unclear(disparity_px, reach_px))
    assert found.mean() > 0.05


def test_what_the_right_eye_does_not_see_of_a_ball_is_unclear() -> None:
    middle_mm = np.array([-30.0, 5.0, 420.0])
    ball = sphere(40.0, 96)
    pose = RigidTransform.from_parts("left_rect", "femur", np.eye(3), middle_mm)
    box = project_box(ball, pose, GEOMETRY).grow(8)
    view = render_rectified(ball, pose, GEOMETRY, box)
    rows, columns = np.nonzero(view.mask)
    z = view.depth_mm[rows, columns].astype(np.float64)
    ray = np.column_stack([columns + box.x - GEOMETRY.centre_x_px,
                           rows + box.y - GEOMETRY.centre_y_px,
                           np.full(len(z), GEOMETRY.focal_px)])  # fmt: skip
    point = ray * (z / GEOMETRY.focal_px)[:, None]
    to_right = np.array([GEOMETRY.baseline_mm, 0.0, 0.0]) - point
    facing = ((point - middle_mm) * to_right).sum(axis=1) / np.linalg.norm(to_right, axis=1) / 40.0
    found = unclear(GEOMETRY.disparity_map_px(view.depth_mm), 2)[rows, columns]
    assert (facing < -0.05).sum() > 100
    assert found[facing < -0.05].all()
    # Well inside of both outlines everything is clear.
    inside = np.linalg.norm(point[:, :2] - middle_mm[:2], axis=1) < 25.0
    assert inside.sum() > 1000
    assert not found[inside].any()


def test_the_end_of_the_picture_is_no_outline() -> None:
    assert not unclear(np.full((30, 40), 200.0), 3).any()


def test_before_and_behind_an_edge_lies_what_it_mixes() -> None:
    """A near strip before a far wall: the right eye does not see the wall left of the strip."""
    wall = np.full((20, 80), 200.0)
    wall[:, 40:60] = 210.0
    found = unclear(wall, 2)
    expected = np.zeros(80, dtype=bool)
    expected[30:40] = True  # hidden by the strip
    expected[37:43] = expected[57:63] = True  # beside the strip's edges
    np.testing.assert_array_equal(found, np.broadcast_to(expected, found.shape))
