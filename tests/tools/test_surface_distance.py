"""Distance from a surface, beside solids whose distance is known and a search of all triangles."""

import numpy as np
import pytest

from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.transform import FloatArray
from navapp.tools.surface_distance import SurfaceDistance
from tests.geometry.shapes import cube, sphere

# Long and thin: middles of its triangles tell little of where they are.
HALF_MM = np.array([40.0, 3.0, 8.0])
BAR = TriangleMesh(cube().vertices_mm * HALF_MM, cube().faces)


def distance_from_bar(point: FloatArray) -> float:
    beyond = np.abs(point) - HALF_MM
    return float(np.linalg.norm(np.maximum(beyond, 0.0)) + min(beyond.max(), 0.0))


def places_of(mesh: TriangleMesh, n: int = 30) -> FloatArray:
    """Places on all triangles, close together."""
    u, v = np.meshgrid(np.linspace(0.0, 1.0, n), np.linspace(0.0, 1.0, n))
    kept = (u + v).ravel() <= 1.0 + 1e-9
    weights = np.column_stack([1.0 - u.ravel() - v.ravel(), u.ravel(), v.ravel()])[kept]
    places = np.einsum("nk,fkj->fnj", weights, mesh.vertices_mm[mesh.faces])
    return np.asarray(places.reshape(-1, 3))


def test_a_bars_distance_is_that_of_its_formula() -> None:
    rng = np.random.default_rng(6)
    find = SurfaceDistance(BAR).find
    for point in rng.uniform(-1.6, 1.6, (300, 3)) * HALF_MM:
        distance, place, normal = find(point)
        assert distance == pytest.approx(distance_from_bar(point), abs=1e-9)
        assert np.linalg.norm(place - point) == pytest.approx(abs(distance))
        assert np.abs(place / HALF_MM).max() == pytest.approx(1.0)
        assert np.linalg.norm(normal) == pytest.approx(1.0)


def test_the_nearest_place_of_a_sphere_is_the_nearest_of_all() -> None:
    mesh = sphere(20.0, 6)
    places = places_of(mesh)
    find = SurfaceDistance(mesh).find
    for point in np.random.default_rng(7).uniform(-30.0, 30.0, (80, 3)):
        distance, place, _ = find(point)
        brute = np.linalg.norm(places - point, axis=1).min()
        assert abs(distance) <= brute + 1e-9
        assert abs(distance) > brute - 0.1
        # On the surface itself, to the mesh of places.
        assert np.linalg.norm(places - place, axis=1).min() < 0.3


def test_outside_is_positive_and_inside_negative() -> None:
    find = SurfaceDistance(sphere(20.0, 12)).find
    rng = np.random.default_rng(8)
    for direction in rng.normal(0.0, 1.0, (60, 3)):
        direction = direction / np.linalg.norm(direction)
        for radius in (2.0, 15.0, 19.0, 20.5, 35.0):
            distance, _, normal = find(radius * direction)
            # The mesh lies inside of the sphere by less than a fifth.
            assert radius - 20.0 <= distance + 1e-9
            assert distance < radius - 20.0 + 0.4
            if radius > 10.0:
                assert normal @ direction > 0.97


def test_beside_an_edge_the_normal_is_that_of_both_its_sides() -> None:
    find = SurfaceDistance(cube(2.0)).find
    distance, place, normal = find(np.array([1.3, 1.4, 0.2]))
    assert distance == pytest.approx(0.5)
    np.testing.assert_allclose(place, [1.0, 1.0, 0.2], atol=1e-12)
    assert normal[0] > 0.2
    assert normal[1] > 0.2
    assert normal[2] == pytest.approx(0.0, abs=1e-12)


def test_on_an_edge_the_distance_is_nothing() -> None:
    find = SurfaceDistance(cube(2.0)).find
    for point in ([1.0, 1.0, 0.3], [1.0, 1.0, 1.0], [1.0, 0.2, -0.4], [-1.0, 0.0, 0.0]):
        distance, place, _ = find(np.array(point))
        assert distance == pytest.approx(0.0, abs=1e-12)
        np.testing.assert_allclose(place, point, atol=1e-12)


def test_just_inside_an_edge_is_inside() -> None:
    find = SurfaceDistance(cube(2.0)).find
    for point in ([0.99, 0.99, 0.0], [0.99, 0.99, 0.99], [-0.99, 0.99, 0.4]):
        assert find(np.array(point))[0] == pytest.approx(-0.01)
