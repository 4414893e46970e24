import numpy as np
import pytest

from navapp.geometry.mesh import TriangleMesh
from sim_devices.tissue import DRAPE_HOLE_MM, SHEET_RADIUS_MM, make_drape, trim
from tests.kept import make_new_tissue as make_tissue


def ball(radius_mm, centre):
    latitude, longitude = np.meshgrid(np.linspace(0, np.pi, 60), np.linspace(0, 2 * np.pi, 121))
    vertices = np.stack(
        [
            np.sin(latitude) * np.cos(longitude),
            np.sin(latitude) * np.sin(longitude),
            np.cos(latitude),
        ],
        axis=-1,
    ).reshape(-1, 3)
    index = np.arange(121 * 60).reshape(121, 60)
    a, b, c, d = (
        part.ravel() for part in (index[:-1, :-1], index[:-1, 1:], index[1:, :-1], index[1:, 1:])
    )
    faces = np.concatenate([np.column_stack([a, b, c]), np.column_stack([b, d, c])])
    return TriangleMesh(radius_mm * vertices + centre, faces.astype(np.int32), vertices)


@pytest.fixture(scope="module")
def bone():
    return ball(38.0, np.array([0.0, 0.0, 30.0]))


@pytest.fixture(scope="module")
def sheet(bone):
    return make_tissue([bone], [bone], seed=1)


def above_bone_mm(sheet, bone):
    """Height of the sheet over the ball, and distance from the middle, of its vertices over it."""
    x, y, z = sheet.mesh.vertices_mm.T
    radius = np.hypot(x, y)
    over = radius < 37.0
    surface = 30.0 - np.sqrt(38.0**2 - radius[over] ** 2)
    return surface - z[over], radius[over]


def test_the_tissue_leaves_the_middle_of_the_bone_bare_and_covers_its_surroundings(sheet, bone):
    above, radius = above_bone_mm(sheet, bone)
    assert (above[radius < 15.0] < 0.0).all()
    outside = np.hypot(*sheet.mesh.vertices_mm[:, :2].T) > 60.0
    assert outside.any()


def test_the_border_wanders_over_the_rim_and_is_flush_in_places(sheet, bone):
    above, radius = above_bone_mm(sheet, bone)
    covered = above > 0.0
    assert covered.any()
    # It reaches inwards in places and stays outside in others.
    assert radius[covered].min() < 34.0
    assert (~covered[radius > 35.0]).any()
    # Where it starts it lies on the bone: thin cover exists.
    assert (np.abs(above[radius > 20.0]) < 0.6).sum() > 20


def test_what_is_not_laid_bare_stays_covered(bone):
    hidden = ball(20.0, np.array([0.0, 75.0, 22.0]))
    x, y, z = make_tissue([bone], [bone, hidden], seed=1).mesh.vertices_mm.T
    over = np.hypot(x, y - 75.0) < 10.0
    surface = 22.0 - np.sqrt(20.0**2 - np.hypot(x, y - 75.0)[over] ** 2)
    assert (z[over] < surface).all()


def test_sheets_face_the_cameras(sheet):
    assert (sheet.mesh.normals[:, 2] <= 1e-9).all()
    assert (make_drape(sheet, 10.0, 1).mesh.normals[:, 2] < 0.5).all()


def test_marks_and_exposure_are_shares(sheet):
    for values in (sheet.mark, sheet.exposure):
        assert values.min() >= 0.0
        assert values.max() <= 1.0
        assert np.ptp(values) > 0.3


def test_the_drape_has_its_hole_and_covers_the_rest(sheet):
    drape = make_drape(sheet, 10.0, 2)
    radius = np.hypot(*drape.mesh.vertices_mm[:, :2].T)
    assert DRAPE_HOLE_MM - 15.0 < radius.min() < DRAPE_HOLE_MM
    assert radius.max() > 400.0


def test_a_trimmed_sheet_ends_under_the_drape(sheet):
    short = trim(sheet)
    radius = np.hypot(*short.mesh.vertices_mm[:, :2].T)
    assert DRAPE_HOLE_MM + 10.0 < radius.max() < SHEET_RADIUS_MM
    assert len(short.mark) == len(short.exposure) == len(radius)
    assert len(short.mesh.faces) > 1.5 * len(radius)


def test_the_drape_lies_above_the_tissue(sheet):
    # Much too low a cloth is lifted.
    drape = make_drape(sheet, -40.0, 2).mesh.vertices_mm
    x, y, z = sheet.mesh.vertices_mm.T
    beneath = np.hypot(x, y) < 95.0
    for cloth in drape[::97]:
        distance = np.hypot(x - cloth[0], y - cloth[1])
        near = beneath & (distance < 1.0)
        if near.any() and np.hypot(*cloth[:2]) < 90.0:
            assert cloth[2] < z[near].min()


def test_equal_seeds_give_equal_sheets_and_others_do_not(bone, sheet):
    again = make_tissue([bone], [bone], seed=1)
    np.testing.assert_array_equal(again.mesh.vertices_mm, sheet.mesh.vertices_mm)
    other = make_tissue([bone], [bone], seed=2)
    assert not np.allclose(other.mesh.vertices_mm, sheet.mesh.vertices_mm)
