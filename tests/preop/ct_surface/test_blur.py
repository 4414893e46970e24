import numpy as np
import pytest
from scipy.spatial import ConvexHull

from navapp.geometry.mesh import TriangleMesh
from navapp.preop.ct_surface.blur import (
    compute_axial_fractions,
    compute_blur_shift_mm,
    neighbours_of,
)
from navapp.preop.ct_surface.cortex_model import Scan
from tests.geometry.shapes import cube
from tests.preop.ct_phantoms import ball, ct_of, cylinder, lattice, leaning_axes

STRAIGHT = ct_of(np.zeros((3, 3, 3)), lattice((3, 3, 3), (0.5, 0.5, 0.8)))
EVEN = Scan(1200.0, 50.0, 0.6, 0.6)
TURN_RAD = np.pi * (3.0 - np.sqrt(5.0))


def around(points):
    """Their convex hull, outward."""
    hull = ConvexHull(points)
    a, b, c = (points[hull.simplices[:, n]] for n in range(3))
    inward = np.einsum("ij,ij->i", np.cross(b - a, c - a), hull.equations[:, :3]) < 0.0
    faces = np.where(inward[:, None], hull.simplices[:, ::-1], hull.simplices)
    return TriangleMesh(points, faces.astype(np.int32))


def sphere_mesh(radius_mm):
    n = int(4.0 * np.pi * radius_mm**2)
    z = 1.0 - (2.0 * np.arange(n) + 1.0) / n
    turn, r = TURN_RAD * np.arange(n), np.sqrt(1.0 - z**2)
    return around(radius_mm * np.column_stack([r * np.cos(turn), r * np.sin(turn), z]))


def cylinder_mesh(radius_mm, n_rings=25):
    """An open one, of triangles with nearly equal sides."""
    n = round(2.0 * np.pi * radius_mm)
    ring, column = (index.ravel() for index in np.indices((n_rings, n)))
    turn = 2.0 * np.pi * (column + 0.5 * ring) / n
    height = 0.5 * np.sqrt(3.0) * (ring - 0.5 * (n_rings - 1))
    points = np.column_stack([radius_mm * np.cos(turn), radius_mm * np.sin(turn), height])
    here = np.arange((n_rings - 1) * n)
    beside = here - here % n + (here + 1) % n
    faces = np.vstack(
        [np.column_stack([here, beside, here + n]), np.column_stack([beside, beside + n, here + n])]
    )
    return TriangleMesh(points, faces.astype(np.int32))


def shifts_mm(mesh, scan=EVEN, ct=STRAIGHT):
    return compute_blur_shift_mm(mesh, neighbours_of(mesh.faces, len(mesh.vertices_mm)), ct, scan)


@pytest.mark.parametrize("radius_mm", [6.0, 12.0, 25.0])
def test_a_sphere_lies_further_out_by_the_variance_over_its_radius(radius_mm):
    expected = 0.6**2 / radius_mm
    np.testing.assert_allclose(shifts_mm(sphere_mesh(radius_mm)), expected, rtol=0.05)


@pytest.mark.parametrize("radius_mm", [6.0, 12.0])
def test_a_cylinder_by_half_of_that(radius_mm):
    mesh = cylinder_mesh(radius_mm)
    inner = np.abs(mesh.vertices_mm[:, 2]) < 4.0
    np.testing.assert_allclose(shifts_mm(mesh)[inner], 0.5 * 0.6**2 / radius_mm, rtol=0.05)


def test_the_shift_is_that_of_the_half_maximum_of_a_blurred_body():
    """Drawn by formula: where the blurred body is one half."""
    r = np.linspace(11.0, 13.0, 2001)
    points = np.column_stack([r, np.zeros((len(r), 2))])
    for body, mesh in (
        (ball(points, np.zeros(3), 12.0, 0.6), sphere_mesh(12.0)),
        (cylinder(points, 12.0, 0.6), cylinder_mesh(12.0)),
    ):
        edge_mm = r[np.abs(body - 0.5).argmin()]
        middle = np.abs(mesh.vertices_mm[:, 2]) < 4.0
        assert 12.0 - edge_mm == pytest.approx(np.median(shifts_mm(mesh)[middle]), abs=0.002)


def test_a_hollow_lies_further_in():
    np.testing.assert_allclose(shifts_mm(sphere_mesh(12.0).flip()), -0.36 / 12.0, rtol=0.05)


def test_across_the_slices_their_blur_counts():
    mesh = sphere_mesh(20.0)
    shift = shifts_mm(mesh, Scan(1200.0, 50.0, 0.5, 1.0))
    upright = np.abs(mesh.normals[:, 2])
    np.testing.assert_allclose(shift[upright > 0.98], 1.0 / 20.0, rtol=0.1)
    np.testing.assert_allclose(shift[upright < 0.1], 0.25 / 20.0, rtol=0.1)


def test_the_corner_of_a_mesh_is_no_curve():
    """An edge without radius says nothing of a profile: at most as sharp as bone is."""
    assert (np.abs(shifts_mm(cube(0.5))) <= 0.25 * 0.36 + 1e-9).all()


@pytest.mark.parametrize("axes", [np.eye(3), leaning_axes(20.0), np.diag([1.0, -1.0, 1.0])])
def test_slices_are_crossed_along_their_normal_however_they_are_stacked(axes):
    ct = ct_of(np.zeros((3, 3, 3)), lattice((3, 3, 3), (0.5, 0.5, 2.0), axes))
    share = compute_axial_fractions(ct, np.eye(3))
    np.testing.assert_allclose(np.abs(share), [0.0, 0.0, 1.0], atol=1e-12)


def test_neighbours_share_an_edge():
    faces = np.array([[0, 1, 2], [2, 1, 3]])
    expected = np.array(
        [[0, 1, 1, 0, 0], [1, 0, 1, 1, 0], [1, 1, 0, 1, 0], [0, 1, 1, 0, 0], [0, 0, 0, 0, 0]]
    )
    np.testing.assert_array_equal(neighbours_of(faces, 5).toarray(), expected)
