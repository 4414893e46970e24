"""Overlay errors against answers by hand and against plain numpy."""

import numpy as np
import pytest

from navapp.evaluation.overlay_error import measure_overlay_error
from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.rectification import RectifiedGeometry, rectifier_of
from navapp.geometry.transform import RigidTransform, rotation_from_vector
from tests.control.fakes import a_rig
from tests.geometry.shapes import sphere, toed_in_rig
from tests.registration.shapes import grid_mesh

pytestmark = pytest.mark.kernel

FLAT = rectifier_of(a_rig()).geometry  # 320 x 240, 200 px, rectified already
PLATE = grid_mesh(lambda x, y: 0.0 * x, 40.0, 8.0)
FAR_MM = 300.0


def pose(x_mm=0.0, y_mm=0.0, z_mm=FAR_MM, turn=(0.0, 0.0, 0.0)) -> RigidTransform:
    return RigidTransform.from_parts(
        "left", "femur", rotation_from_vector(turn), (x_mm, y_mm, z_mm)
    )


def disc(radius_mm: float) -> TriangleMesh:
    angles = np.linspace(0.0, 2.0 * np.pi, 181)[:-1]
    rim = radius_mm * np.column_stack([np.cos(angles), np.sin(angles), 0.0 * angles])
    number = np.arange(180)
    faces = np.column_stack([np.full(180, 180), (number + 1) % 180, number])
    return TriangleMesh(np.vstack([rim, np.zeros(3)]), faces.astype(np.int32))


def measure(estimated, true=None, surface=PLATE, geometry: RectifiedGeometry = FLAT):
    return measure_overlay_error(estimated, true or pose(), surface, geometry)


def test_the_true_pose_has_no_error() -> None:
    for surface in (PLATE, sphere(30.0)):
        found = measure(pose(turn=(0.2, 0.1, 0.0)), pose(turn=(0.2, 0.1, 0.0)), surface)
        assert found.displacement_mm == pytest.approx(0.0, abs=1e-9)
        assert found.outline_mm == 0.0


@pytest.mark.parametrize(("x_mm", "y_mm"), [(2.0, 0.0), (0.0, -0.5), (3.0, 4.0)])
def test_a_plate_that_is_shifted_across_is_displaced_by_as_much(x_mm, y_mm) -> None:
    found = measure(pose(x_mm, y_mm))
    assert found.displacement_mm == pytest.approx(np.hypot(x_mm, y_mm), abs=1e-6)


@pytest.mark.parametrize("half_mm", [20.0, 80.0])
def test_a_plate_that_is_shifted_along_the_view_is_displaced_outwards(half_mm) -> None:
    # A point at r mm from the axis is drawn at r z / (z + d): off by r d / (z + d), at depth z.
    plate = grid_mesh(lambda x, y: 0.0 * x, half_mm, half_mm / 5.0)
    found = measure(pose(z_mm=FAR_MM + 6.0), surface=plate)
    mean_radius_mm = half_mm * 0.7652  # of a square of that half side
    expected_mm = mean_radius_mm * 6.0 / (FAR_MM + 6.0)
    assert found.displacement_mm == pytest.approx(expected_mm, rel=0.04)


@pytest.mark.parametrize("shift_mm", [0.3, 0.75, 1.5, 6.0, 20.0])
def test_the_outlines_of_a_shifted_disc_are_two_over_pi_of_the_shift_apart(shift_mm) -> None:
    # Also where that is a small part of a pixel, of 1.5 mm here: over a whole rim it averages out.
    places = [(0.0, 0.0), (0.3, 0.7), (0.8, 0.2), (1.1, 0.5)]
    found = [measure(pose(x + shift_mm, y), pose(x, y), disc(80.0)) for x, y in places]
    # Where the rim's normal turns by a from the shift, the other rim is shift |cos a| away.
    outline_mm = np.mean([one.outline_mm for one in found])
    assert outline_mm == pytest.approx(2.0 / np.pi * shift_mm, rel=0.13)
    assert found[0].displacement_mm == pytest.approx(shift_mm, abs=1e-6)


def test_a_disc_that_is_turned_in_the_picture_keeps_its_outline() -> None:
    found = measure(pose(turn=(0.0, 0.0, 0.05)), surface=disc(60.0))
    assert found.displacement_mm == pytest.approx(2.0 / 3.0 * 60.0 * 2.0 * np.sin(0.025), rel=0.01)
    assert found.outline_mm < 0.3


@pytest.mark.parametrize(
    "gone",
    [pose(x_mm=1000.0), pose(z_mm=-200.0), pose(z_mm=20.0)],
    ids=["beside the picture", "behind the camera", "in part behind the camera"],
)
def test_what_is_out_of_view_has_no_overlay_error(gone) -> None:
    assert measure(gone, surface=sphere(30.0)) is None


def test_a_bone_that_is_truly_out_of_view_has_no_overlay_error() -> None:
    assert measure(pose(), pose(x_mm=1000.0), sphere(30.0)) is None


def test_the_edge_of_the_picture_is_no_rim() -> None:
    # Half of the plate is out of the picture at the left: the picture's edge is where it was.
    left = pose(x_mm=-240.0)
    down = pose(x_mm=-240.0, y_mm=6.0)
    found = measure(down, left)
    # Upper and lower rim are 6 mm off, the right one, a third of the whole, by nothing.
    assert found.displacement_mm == pytest.approx(6.0, abs=1e-6)
    rows, columns = 53.0, 26.0
    assert found.outline_mm == pytest.approx(6.0 * 2 * columns / (2 * columns + rows), rel=0.1)


def test_a_surface_that_fills_the_picture_has_no_outline() -> None:
    wall = grid_mesh(lambda x, y: 0.0 * x, 900.0, 100.0)
    found = measure(pose(1.0), surface=wall)
    assert found.outline_mm is None
    assert found.displacement_mm == pytest.approx(1.0, abs=1e-6)


def measure_slowly(estimated, true, radius_mm: float, geometry: RectifiedGeometry) -> float:
    """Of a ball around the bone's origin: rays against a sphere, one pixel after the other."""
    to_rectified = geometry.rectified_from_left
    there, drawn = to_rectified @ true, to_rectified @ estimated
    centre = there.translation_mm
    errors_mm = []
    for row in range(geometry.height):
        for column in range(geometry.width):
            ray = np.array([column - geometry.centre_x_px, row - geometry.centre_y_px, 0.0])
            ray = ray / geometry.focal_px + (0.0, 0.0, 1.0)
            b, c = ray @ centre, centre @ centre - radius_mm**2
            inside = b * b - ray @ ray * c
            if inside < 0.0:
                continue
            point = ray * (b - np.sqrt(inside)) / (ray @ ray)
            x, y, z = drawn.apply(there.inverse().apply(point[None]))[0]
            u = geometry.focal_px * x / z + geometry.centre_x_px
            v = geometry.focal_px * y / z + geometry.centre_y_px
            errors_mm.append(np.hypot(u - column, v - row) * point[2] / geometry.focal_px)
    return float(np.mean(errors_mm))


@pytest.mark.parametrize("rig", [a_rig(), toed_in_rig().scale(0.25)], ids=["parallel", "toed in"])
def test_a_ball_against_plain_numpy(rig) -> None:
    geometry = rectifier_of(rig).geometry
    true = pose(5.0, -3.0, 320.0, (0.3, -0.2, 0.1))
    estimated = pose(6.5, -2.0, 326.0, (0.33, -0.18, 0.16))
    slow_mm = measure_slowly(estimated, true, 30.0, geometry)
    found = measure(estimated, true, sphere(30.0, 60), geometry)
    assert slow_mm > 1.0
    assert found.displacement_mm == pytest.approx(slow_mm, rel=0.01)
