"""Fewer triangles for the same surface."""

import numpy as np
import pytest

from navapp.geometry import TriangleMesh
from navapp.geometry.simplify import is_within
from tests.geometry.shapes import sphere
from tests.kept import make_new_simplified as simplify

SPHERE = sphere(30.0, 40)


def test_a_simpler_mesh_stays_within_the_distance_and_closed() -> None:
    simple = simplify(SPHERE, 300, 0.5)
    assert len(simple.vertices_mm) < 0.4 * len(SPHERE.vertices_mm)
    radii = np.linalg.norm(simple.vertices_mm, axis=1)
    np.testing.assert_allclose(radii, 30.0, atol=0.5)
    assert is_within(SPHERE, simple, 0.5)
    assert simple.volume_mm3() == pytest.approx(SPHERE.volume_mm3(), rel=0.02)


def test_a_narrow_distance_keeps_more_vertices() -> None:
    loose, narrow = simplify(SPHERE, 100, 5.0), simplify(SPHERE, 100, 0.05)
    assert len(loose.vertices_mm) < len(narrow.vertices_mm) <= len(SPHERE.vertices_mm)
    assert is_within(SPHERE, narrow, 0.05)
    assert not is_within(SPHERE, loose, 0.05)


def test_a_small_mesh_stays_as_it_is() -> None:
    assert simplify(SPHERE, len(SPHERE.vertices_mm), 0.1) is SPHERE


def test_a_surface_far_from_the_origin_is_simplified_as_well() -> None:
    far = TriangleMesh(SPHERE.vertices_mm + np.array([4000.0, -3000.0, 5000.0]), SPHERE.faces)
    simple = simplify(far, 300, 0.5)
    assert len(simple.vertices_mm) < 0.4 * len(far.vertices_mm)
    assert is_within(far, simple, 0.5)


@pytest.mark.parametrize(
    ("point", "expected_mm"),
    [
        ((0.2, 0.2, 3.0), 3.0),
        ((-2.0, 0.5, 0.0), 2.0),
        ((3.0, 0.0, 0.0), 2.0),
        ((0.5, -1.0, 0.0), 1.0),
        ((1.0, 1.0, 0.0), 0.5**0.5),
    ],
)
def test_distance_from_a_triangle(point: tuple[float, float, float], expected_mm: float) -> None:
    triangle = TriangleMesh(np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]), np.array([[0, 1, 2]]))
    corners = np.array(point) + np.array([[0.0, 0, 0], [1e-9, 0, 0], [0, 1e-9, 0]])
    mesh = TriangleMesh(corners, np.array([[0, 1, 2]]))
    assert is_within(mesh, triangle, expected_mm + 1e-6)
    assert not is_within(mesh, triangle, expected_mm - 1e-6)


def test_a_large_triangle_near_a_point_is_not_overlooked() -> None:
    """Its middle is far away, and many small triangles are nearer."""
    size_mm, n = 1000.0, 20
    large = np.array([[-size_mm, -size_mm, 0.0], [size_mm, -size_mm, 0.0], [0.0, size_mm, 0.0]])
    crumbs = [np.array([[k, 0.0, 4.0], [k + 0.5, 0.0, 4.0], [k, 0.5, 4.0]]) for k in range(n)]
    vertices = np.concatenate([large, *crumbs])
    surface = TriangleMesh(vertices, np.arange(3 * (n + 1), dtype=np.int32).reshape(-1, 3))
    point = np.array([[3.0, -300.0, 1.0], [3.1, -300.0, 1.0], [3.0, -300.1, 1.0]])
    mesh = TriangleMesh(point, np.array([[0, 1, 2]]))
    assert is_within(mesh, surface, 1.0 + 1e-9)
    assert not is_within(mesh, surface, 1.0 - 1e-9)


def test_a_large_triangle_is_asked_for_what_lies_just_beyond_its_corner() -> None:
    """Further from its middle than the corner is, and many small triangles are nearer to that."""
    large = np.array([[-1000.0, -1000.0, 0.0], [1000.0, -1000.0, 0.0], [0.0, 1000.0, 0.0]])
    crumbs = [
        np.array([[k, 990.0, 9.0], [k + 0.5, 990.0, 9.0], [k, 990.5, 9.0]]) for k in range(20)
    ]
    surface = TriangleMesh(
        np.concatenate([large, *crumbs]), np.arange(63, dtype=np.int32).reshape(-1, 3)
    )
    corner = np.array([[0.0, 1001.0, 0.0], [1e-9, 1001.0, 0.0], [0.0, 1001.0, 1e-9]])
    mesh = TriangleMesh(corner, np.array([[0, 1, 2]]))
    assert is_within(mesh, surface, 1.0 + 1e-6)
    assert not is_within(mesh, surface, 1.0 - 1e-6)
