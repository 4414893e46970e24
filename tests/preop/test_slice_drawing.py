"""Slices as pictures: contours, crosses, scale, marks and the window of densities."""

import cv2
import numpy as np
import pytest

from navapp.preop.plan_view import make_plan_view
from navapp.preop.slice_drawing import (
    WINDOWS_HU,
    apply_window,
    choose_scale_mm,
    draw_slice,
    draw_slices,
)
from navapp.preop.slice_volume import SliceVolume
from navapp.preop.slices import DIRECTIONS, SliceGrid
from navapp.preop.volume import CtVolume
from navapp.values import BoneModel, Plan
from tests.geometry.shapes import sphere

RADIUS_MM = 15.0
AXIAL = DIRECTIONS[0]


@pytest.mark.parametrize("flips", [(1, 1, 1), (-1, 1, -1), (1, -1, -1)])
def test_the_contour_lies_on_the_rim_of_what_it_outlines(flips) -> None:
    spacing = np.array([0.8, 0.8, 1.2])
    n = np.array([60, 60, 40])
    matrix = np.eye(4)
    matrix[:3, :3] = np.diag(spacing * flips)
    matrix[:3, 3] = -0.5 * matrix[:3, :3] @ (n - 1)
    index = np.stack(np.meshgrid(*(np.arange(k) for k in n), indexing="ij"), axis=-1)
    radius = np.linalg.norm(index @ matrix[:3, :3].T + matrix[:3, 3], axis=-1)
    hu = (1400.0 * np.clip(0.5 + RADIUS_MM - radius, 0.0, 1.0) - 200.0).transpose(2, 1, 0)
    volume = CtVolume(hu.astype(np.int16), matrix, spacing)
    picture = draw_slices(volume, sphere(RADIUS_MM, 60)).astype(int)
    is_line = (picture.max(axis=2) - picture.min(axis=2)) > 60
    scale = picture.shape[0] / (2.0 * (RADIUS_MM + 15.0))
    white = (picture.min(axis=2) > 127).astype(np.uint8)
    around = np.ones((3, 3), np.uint8)
    rim = cv2.dilate(white, around) - cv2.erode(white, around)
    away_mm = cv2.distanceTransform(1 - rim, cv2.DIST_L2, 5)[is_line] / scale
    assert is_line.sum() > 1000
    assert away_mm.max() < 0.6


def plan_with(points) -> Plan:
    return Plan({"femur": BoneModel("femur", sphere(10.0, 40), "left")}, {"femur/entry": points})


def is_yellow(picture):
    """As the first cross of a slice; the contours are orange."""
    blue, green, red = np.moveaxis(picture.astype(int), 2, 0)
    return (red > 150) & (green > red - 20) & (blue < green - 60)


@pytest.mark.parametrize("direction", DIRECTIONS, ids=lambda one: one.name)
def test_a_cross_lies_where_its_point_is(direction) -> None:
    point = np.array([4.0, -7.0, 11.0])
    view = make_plan_view(plan_with(point[None]))
    index = int(view.grid.find_slices(direction, point[None])[0])
    rows, columns = view.grid.shape_of(direction)
    drawn = draw_slice(view, direction, index, (8 * columns, 8 * rows))
    y, x = np.argwhere(is_yellow(drawn)).mean(axis=0)
    expected = 8 * (view.grid.find_pixels(direction, point) + 0.5) - 0.5
    np.testing.assert_allclose((x, y), expected, atol=1.0)
    other = draw_slice(view, direction, index + 1, (8 * columns, 8 * rows))
    assert not is_yellow(other).any()
    numbered = draw_slice(view, direction, index, (8 * columns, 8 * rows), has_numbers=True)
    assert is_yellow(numbered).sum() > is_yellow(drawn).sum() + 10


def test_the_patient_s_right_is_at_the_left_beside_its_letter_in_the_pictures_of_a_bone() -> None:
    """Of a volume recorded from left to right, which unmarked slices would show mirrored."""
    matrix = np.diag([-1.0, 1.0, 1.0, 1.0])
    matrix[:3, 3] = (30, -30, -30)
    hu = np.full((61, 61, 61), -1000, np.int16)
    place = np.linalg.inv(matrix) @ (-18.0, 0.0, 0.0, 1.0)
    i, j, k = place[:3].astype(int)
    hu[k - 5 : k + 6, j - 5 : j + 6, i - 5 : i + 6] = 1400
    volume = CtVolume(hu, matrix, np.ones(3))
    picture = draw_slices(volume, sphere(20.0, 30))[:, :360]  # the axial one
    x = np.argwhere((picture > 200).all(axis=2))[:, 1]
    assert abs(np.median(x) - 360 * (30.0 - 18.0) / 60.0) < 8
    letter = picture[165:185, 2:26] > 100
    assert 20 < letter.all(axis=2).sum() < 200


def test_a_bone_outside_a_slice_has_no_contour_and_scale_bars_are_as_long_as_they_say() -> None:
    view = make_plan_view(plan_with(np.zeros((0, 3))))
    rows, columns = view.grid.shape_of(AXIAL)
    drawn = draw_slice(view, AXIAL, 0, (10 * columns, 10 * rows))
    is_white = (drawn == 255).all(axis=2)
    columns_of_bar = np.flatnonzero(is_white[rows * 10 // 2 :].any(axis=0))
    length = columns_of_bar[-1] - columns_of_bar[0]
    assert length == pytest.approx(10 * choose_scale_mm(columns), abs=2)
    assert not (drawn[..., 2] > drawn[..., 0]).any()


@pytest.mark.parametrize(("width_mm", "scale"), [(300, 100), (130, 50), (60, 20), (25, 10), (4, 5)])
def test_the_scale_bar_fills_less_than_half_of_the_picture(width_mm, scale) -> None:
    assert choose_scale_mm(width_mm) == scale


def test_a_window_spreads_the_densities_of_soft_tissue() -> None:
    grid = SliceGrid((0.0, 0.0, 0.0), 1.0, (256, 1, 1))
    grey = np.arange(256, dtype=np.uint8).reshape(1, 1, 256)
    volume = SliceVolume(grid, grey, (-200.0, 1400.0))
    shown = apply_window(volume, grey[0], WINDOWS_HU["soft tissue"])[0].astype(int)
    hu = np.linspace(-200.0, 1400.0, 256)
    assert (shown[hu < -150] == 0).all()
    assert (shown[hu > 250] == 255).all()
    assert abs(shown[np.abs(hu - 50).argmin()] - 127) < 4
    np.testing.assert_array_equal(apply_window(volume, grey[0], None), grey[0])
    labels = SliceVolume(grid, grey)
    np.testing.assert_array_equal(apply_window(labels, grey[0], WINDOWS_HU["soft tissue"]), grey[0])
