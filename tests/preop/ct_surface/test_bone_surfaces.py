import numpy as np
import pytest

from navapp.geometry.simplify import is_closed, is_within
from navapp.preop.ct_surface import bone_surfaces, make_label_surface, make_surfaces
from navapp.preop.segmentation import segment
from navapp.preop.volume import CtVolume, LabelVolume
from navapp.preop.volume.hounsfield import PADDING_HU
from tests.many import few_of
from tests.preop.ct_phantoms import (
    MARROW_HU,
    SOFT_HU,
    ct_of,
    hollow_ball,
    hollow_cylinder,
    lattice,
    leaning_axes,
    points_of,
)

SPACING_MM = (0.6, 0.6, 0.8)
PLACE_MM = np.array([40.0, -15.0, 900.0])
BALL_MM, BALL_RADIUS_MM = PLACE_MM + np.array([14.0, 0.0, 0.0]), 12.0
SHAFT_MM, SHAFT_RADIUS_MM = PLACE_MM - [12.0, 0.0, 0.0], 9.0
SEEDS = {"patella": BALL_MM, "femur": SHAFT_MM}
CUT_MM = 12.0
# One worker lays the surfaces of each scan, once.
pytestmark = pytest.mark.xdist_group("bone surfaces")


def scanned(axes, n_j=54):
    """A ball with thin cortex, and a shaft with thick cortex that the volume cuts."""
    size = (94, n_j, 44)
    matrix = lattice(size, SPACING_MM, axes, PLACE_MM)
    points = points_of(size, matrix)
    hu = SOFT_HU + hollow_ball(points, BALL_MM, BALL_RADIUS_MM)
    hu += hollow_cylinder(points - SHAFT_MM, SHAFT_RADIUS_MM, 2.5, inside_hu=MARROW_HU)
    return ct_of(hu, matrix, 20.0, seed=1)


@pytest.fixture(scope="module")
def straight():
    """The CT, and its surfaces from two thresholds."""
    ct, steps = scanned(np.eye(3)), []
    found = [make_surfaces(segment(ct, hu, SEEDS), steps.append) for hu in (150.0, 350.0)]
    assert steps[:4] == [
        "laying first surfaces",
        "estimating the density of cortex and the blur of the scanner",
        "finding the edge of the patella",
        "finding the edge of the femur",
    ]
    return ct, found


@pytest.fixture(scope="module")
def leaning():
    ct = scanned(leaning_axes(), 70)
    return ct, [make_surfaces(segment(ct, seeds=SEEDS))]


@pytest.fixture(params=few_of([("straight", 0), ("straight", 1), ("leaning", 0)]), ids=str)
def scan(request):
    """A CT, and the surfaces that were found in it."""
    name, n = request.param
    ct, found = request.getfixturevalue(name)
    return ct, found[n]


def off_ball_mm(surface):
    away = np.linalg.norm(surface.mesh.vertices_mm - BALL_MM, axis=1)
    return away - BALL_RADIUS_MM


def off_shaft_mm(surface):
    beside = (surface.mesh.vertices_mm - SHAFT_MM)[~surface.is_cut, :2]
    return np.hypot(*beside.T) - SHAFT_RADIUS_MM


def assert_is_on_surface(off_mm):
    assert abs(np.median(off_mm)) < 0.05
    assert np.quantile(np.abs(off_mm), 0.95) < 0.15
    assert np.abs(off_mm).max() < 0.6


def test_surfaces_lie_where_the_bones_end(scan):
    _, found = scan
    ball, shaft = found.bones["patella"], found.bones["femur"]
    assert_is_on_surface(off_ball_mm(ball))
    assert_is_on_surface(off_shaft_mm(shaft))
    for surface in (ball, shaft):
        assert is_closed(surface.mesh)
        assert len(surface.is_cut) == len(surface.is_measured) == len(surface.mesh.vertices_mm)


def test_the_threshold_does_not_move_the_surface(straight):
    low, high = straight[1]
    for off_mm, name in ((off_ball_mm, "patella"), (off_shaft_mm, "femur")):
        medians = [np.median(off_mm(found.bones[name])) for found in (low, high)]
        assert abs(medians[0] - medians[1]) < 0.02


def test_a_ball_is_whole_and_measured(scan):
    ball = scan[1].bones["patella"]
    assert not ball.is_cut.any()
    assert ball.is_measured.mean() > 0.97
    volume_mm3 = 4.0 / 3.0 * np.pi * BALL_RADIUS_MM**3
    assert ball.mesh.volume_mm3() == pytest.approx(volume_mm3, rel=0.01)


def test_a_shaft_is_cut_where_the_volume_ends_and_there_alone(scan):
    ct, found = scan
    shaft = found.bones["femur"]
    k = ct.indices_of(shaft.mesh.vertices_mm)[:, 2]
    from_end = np.minimum(k, ct.size[2] - 1 - k)
    assert (shaft.is_cut == (from_end < 0.75)).all()
    assert from_end[shaft.is_cut].min() == pytest.approx(-0.5, abs=0.1)
    for end in (k < 10, k > 30):
        assert (shaft.is_cut & end).sum() > 20
    assert not shaft.is_measured[shaft.is_cut].any()
    assert shaft.is_measured[~shaft.is_cut].mean() > 0.97


def test_the_scanner_is_found(scan):
    found = scan[1].scan
    assert found.blur_in_plane_mm == pytest.approx(0.5, rel=0.1)
    assert found.blur_axial_mm == pytest.approx(0.5, rel=0.1)
    assert found.cortex_hu == pytest.approx(1200.0, rel=0.05)
    assert found.soft_hu == pytest.approx(SOFT_HU, abs=10.0)


def test_the_working_model_is_near_the_fine_one(scan, monkeypatch):
    ct, found = scan
    fine = found.bones["patella"]
    monkeypatch.setattr(bone_surfaces, "_WORKING_VERTICES", 300)
    coarse = bone_surfaces._working(fine, ct)
    assert len(coarse.mesh.vertices_mm) < 0.7 * len(fine.mesh.vertices_mm)
    assert is_within(fine.mesh, coarse.mesh, 0.1)
    assert is_closed(coarse.mesh)
    assert coarse.is_measured.mean() > 0.95


@pytest.mark.release
def test_a_shaft_that_padding_cuts_is_cut_there(straight):
    """As in a CT that was resampled to other axes: its last slice leans in the volume."""
    ct, _ = straight
    points = points_of(ct.size, ct.lps_from_index) - SHAFT_MM
    slope = np.array([-0.3, 0.2, 1.0]) / np.linalg.norm([-0.3, 0.2, 1.0])
    hu = np.where(points @ slope > CUT_MM, np.int16(PADDING_HU), ct.hu)
    found = segment(CtVolume(hu, ct.lps_from_index, ct.spacing_mm), seeds=SEEDS)
    assert any(said.startswith("femur: cut off by padding") for said in found.warnings)
    shaft = make_surfaces(found).bones["femur"]
    above_mm = (shaft.mesh.vertices_mm - SHAFT_MM) @ slope - CUT_MM
    middle_mm = np.hypot(*(shaft.mesh.vertices_mm - SHAFT_MM)[:, :2].T)
    on_cap = (above_mm > -0.5) & (middle_mm < 0.8 * SHAFT_RADIUS_MM)
    assert on_cap.sum() > 20
    assert shaft.is_cut[on_cap].mean() > 0.9
    assert not shaft.is_cut[(above_mm < -3.0) & (shaft.mesh.vertices_mm[:, 2] > 890.0)].any()


@pytest.mark.parametrize("axes", [np.eye(3), leaning_axes()])
def test_a_ready_segmentation_is_laid_around_its_voxels(axes):
    size = (60, 70, 40)
    matrix = lattice(size, SPACING_MM, axes, PLACE_MM)
    beside = points_of(size, matrix) - PLACE_MM
    labels = 7 * (np.hypot(beside[..., 0], beside[..., 1]) < SHAFT_RADIUS_MM).astype(np.int16)
    volume = LabelVolume(labels, matrix, np.linalg.norm(matrix[:3, :3], axis=0))
    surface = make_label_surface(labels == 7, volume)
    assert is_closed(surface.mesh)
    assert not surface.is_measured.any()
    k = volume.indices_of(surface.mesh.vertices_mm)[:, 2]
    assert (surface.is_cut == (np.minimum(k, 39 - k) < 0.75)).all()
    off_mm = np.hypot(*(surface.mesh.vertices_mm - PLACE_MM)[~surface.is_cut, :2].T)
    assert np.median(off_mm) == pytest.approx(SHAFT_RADIUS_MM, abs=0.1)
    assert np.abs(off_mm - SHAFT_RADIUS_MM).max() < 0.6
