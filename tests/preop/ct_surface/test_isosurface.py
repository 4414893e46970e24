import numpy as np
import pytest

from navapp.geometry.simplify import is_closed
from navapp.preop.ct_surface.isosurface import make_isosurface
from navapp.preop.volume import LabelVolume
from tests.preop.ct_phantoms import OBLIQUE, lattice, leaning_axes, points_of

SIZE, SPACING_MM = (64, 60, 50), (0.7, 0.75, 0.9)
CENTRE_MM = np.array([30.0, -80.0, 700.0])
LATTICES = {
    "straight": np.eye(3),
    "oblique": OBLIQUE,
    "left-handed": OBLIQUE @ np.diag([1.0, -1.0, 1.0]),
    "leaning": leaning_axes(),
}


def volume_of(mask, matrix):
    return LabelVolume(mask.astype(np.uint8), matrix, np.linalg.norm(matrix[:3, :3], axis=0))


def middle_mm(mesh):
    """Centre of what it encloses."""
    corners = mesh.vertices_mm[mesh.faces] - CENTRE_MM
    weight = np.linalg.det(corners)
    return CENTRE_MM + (weight[:, None] * corners.sum(axis=1)).sum(axis=0) / (4.0 * weight.sum())


@pytest.mark.parametrize("axes", LATTICES.values(), ids=LATTICES.keys())
def test_a_ball_is_closed_outward_and_as_large_as_it_is(axes):
    matrix = lattice(SIZE, SPACING_MM, axes, CENTRE_MM)
    mask = np.linalg.norm(points_of(SIZE, matrix) - CENTRE_MM, axis=-1) < 18.0
    mesh, _ = make_isosurface(mask, volume_of(mask, matrix))
    assert is_closed(mesh)
    assert mesh.volume_mm3() == pytest.approx(4.0 / 3.0 * np.pi * 18.0**3, rel=0.005)
    np.testing.assert_allclose(middle_mm(mesh), CENTRE_MM, atol=0.03)
    outward = mesh.vertices_mm - CENTRE_MM
    assert (np.einsum("ij,ij->i", outward, mesh.normals) > 0.0).all()
    assert np.abs(np.linalg.norm(outward, axis=1) - 18.0).max() < 0.6
    # About one vertex a square millimetre.
    assert 0.5 < len(mesh.vertices_mm) / mesh.face_areas_mm2().sum() < 1.5


def test_where_the_volume_ends_the_surface_is_closed_flat():
    matrix = lattice((40, 40, 30), (0.7, 0.7, 0.9), middle_mm=CENTRE_MM)
    points = points_of((40, 40, 30), matrix) - CENTRE_MM
    mask = np.hypot(points[..., 0], points[..., 1]) < 9.0
    mesh, _ = make_isosurface(mask, volume_of(mask, matrix))
    assert is_closed(mesh)
    half = 0.5 * 30 * 0.9
    z = mesh.vertices_mm[:, 2] - CENTRE_MM[2]
    assert z.min() == pytest.approx(-half, abs=0.1)
    assert z.max() == pytest.approx(half, abs=0.1)


def test_crumbs_and_holes_beside_the_bone_are_no_surface():
    matrix = lattice(SIZE, SPACING_MM)
    points = points_of(SIZE, matrix)
    mask = np.linalg.norm(points, axis=-1) < 14.0
    alone, nothing = make_isosurface(mask, volume_of(mask, matrix))
    mask |= np.linalg.norm(points - [17.5, 17.5, 17.5], axis=-1) < 3.0
    with_crumb, left_out = make_isosurface(mask, volume_of(mask, matrix))
    assert with_crumb.volume_mm3() == pytest.approx(alone.volume_mm3(), rel=1e-3)
    assert nothing == 0.0
    assert left_out == pytest.approx(3.0**3 / (3.0**3 + 14.0**3), rel=0.3)


def test_a_hollow_is_no_piece_that_is_left_out():
    matrix = lattice(SIZE, SPACING_MM)
    radius = np.linalg.norm(points_of(SIZE, matrix), axis=-1)
    mask = (radius < 14.0) & (radius > 8.0)
    mesh, left_out = make_isosurface(mask, volume_of(mask, matrix))
    assert left_out == 0.0
    assert mesh.volume_mm3() == pytest.approx(4.0 / 3.0 * np.pi * 14.0**3, rel=0.01)
