"""What the left camera's picture shows of the measured depth."""

from dataclasses import replace

import numpy as np

from navapp.geometry.box import Box
from navapp.geometry.halves import double, half_box
from navapp.geometry.rectification import rectifier_of
from navapp.geometry.zbuffer import render
from navapp.overlay import LeftView
from navapp.values import Foreground, Origin, Surroundings
from tests.overlay.scenes import (
    CAMERA,
    HEIGHT,
    MESH,
    NOTHING,
    POSE,
    RIG,
    WIDTH,
    Occluder,
    left_view,
    measured,
)

WHOLE = Box(0, 0, WIDTH, HEIGHT)


def test_the_depth_is_that_of_the_left_camera() -> None:
    seen = left_view().see(measured(), WHOLE)
    bone = render(MESH, POSE, CAMERA)
    error_mm = np.abs(double(seen.depth_mm, WHOLE) - bone.depth_mm)[bone.mask]
    assert bone.mask.sum() > 10_000
    # Every second pixel: the bone is steep beside its edges, and the table far behind them.
    assert np.percentile(error_mm, 98) < 1.0
    assert np.median(error_mm) < 0.2
    assert not double(seen.is_guess, WHOLE)[bone.mask].any()


def test_a_box_of_the_picture_shows_the_same_as_the_whole() -> None:
    whole, box = left_view().see(measured(), WHOLE), Box(200, 150, 180, 120)
    part = left_view().see(measured(), box)
    assert part.box == box
    half = half_box(box).slices
    np.testing.assert_array_equal(part.depth_mm, whole.depth_mm[half])
    np.testing.assert_array_equal(part.is_guess, whole.is_guess[half])


def test_beside_what_was_measured_the_depth_is_unknown() -> None:
    around = measured()
    box = Box(250, 180, 150, 120)
    disparity_px, origin = (part[box.slices] for part in around.depth)
    surroundings = Surroundings(disparity_px, origin, box, False, np.zeros(origin.shape, np.uint8))
    small = Foreground(surroundings, around.measured, around.is_in_front[box.slices])
    seen = left_view().see(small, WHOLE)
    is_known = np.isfinite(seen.depth_mm)
    assert 0.8 < 4 * is_known.sum() / (box.width * box.height) < 1.2
    assert seen.is_guess[~is_known].all()
    assert not seen.is_guess[is_known].any()


def test_what_nobody_matched_is_a_guess() -> None:
    seen = left_view().see(measured(origin=Origin.FILLED_BORDER), WHOLE)
    assert seen.is_guess.all()
    assert np.isfinite(seen.depth_mm).mean() > 0.9


def test_marks_of_what_stands_in_front_have_a_soft_edge_at_their_place() -> None:
    column = 325.0
    in_front = left_view().see(measured(Occluder(column)), WHOLE).in_front / 255.0
    row = in_front[HEIGHT // 2]
    assert row[: int(column) - 5].max() < 0.01
    assert row[int(column) + 5 : int(column) + 20].min() > 0.99
    crossing = np.interp(0.5, row[300:350], np.arange(300, 350))
    assert abs(crossing - column) < 1.5


def test_the_last_row_and_column_of_an_odd_picture_show_what_is_there() -> None:
    # A lens whose edges stay in the rectified view.
    distortion = np.array([0.1, 0.0, 0.0, 0.0])
    camera = replace(CAMERA, distortion=distortion, width=WIDTH + 1, height=HEIGHT + 1)
    rig = replace(RIG, left=camera, right=camera)
    geometry = rectifier_of(rig).geometry
    box = Box(0, 0, geometry.width, geometry.height)
    disparity_px = np.full((box.height, box.width), 50.0, dtype=np.float32)
    origin = np.full(disparity_px.shape, Origin.MATCHED, np.uint8)
    is_in_front = np.broadcast_to(np.arange(box.width) < WIDTH // 2, disparity_px.shape).copy()
    surroundings = Surroundings(disparity_px, origin, box, False, np.zeros(origin.shape, np.uint8))
    foreground = Foreground(surroundings, NOTHING, is_in_front)
    seen = LeftView(rig).see(foreground, Box(0, 0, camera.width, camera.height))
    assert seen.in_front[:, :20].any()
    assert not seen.in_front[:, -20:].any()
    assert np.isfinite(seen.depth_mm).all()


def test_the_left_camera_sees_along_its_own_axes() -> None:
    points = np.array([[1.0, 2.0, 300.0]])
    np.testing.assert_array_equal(left_view().to_camera(points), points)
    np.testing.assert_array_equal(left_view().axes_in_left, np.eye(3))
    assert left_view().camera is CAMERA
