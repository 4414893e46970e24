"""Cut lines, and what lies beyond a plane."""

import numpy as np
import pytest

from navapp.geometry.mesh import TriangleMesh, join_meshes
from navapp.overlay.plane_sections import cut_lines, depth_beyond
from navapp.values import ResectionPlane
from tests.geometry.shapes import cube, sphere
from tests.overlay.scenes import MESH

UP = np.array([0.0, 0.0, 1.0])


def plane(point=(0.0, 0.0, 0.0), normal=UP, extent=(200.0, 200.0)) -> ResectionPlane:
    return ResectionPlane("femur", np.asarray(point), np.asarray(normal), extent)


def length_mm(line: np.ndarray) -> float:
    return float(np.linalg.norm(np.diff(line, axis=0), axis=1).sum())


def off_surface_mm(points: np.ndarray, mesh: TriangleMesh) -> np.ndarray:
    """Distance to the nearest edge of the mesh: a cut line has its corners on edges."""
    edges = mesh.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    start, end = mesh.vertices_mm[edges].transpose(1, 0, 2)
    along = end - start
    share = np.einsum("pek,ek->pe", points[:, None] - start, along) / (along**2).sum(axis=1)
    nearest = start + np.clip(share, 0.0, 1.0)[..., None] * along
    distances: np.ndarray = np.linalg.norm(points[:, None] - nearest, axis=2).min(axis=1)
    return distances


@pytest.mark.parametrize("normal", [UP, -UP, (0.3, -0.5, 0.8), (1.0, 0.0, 0.0)])
def test_a_closed_mesh_is_cut_in_one_closed_line_on_plane_and_surface(normal) -> None:
    ball, cut = sphere(20.0, 24), plane((1.0, 2.0, 6.0), normal)
    (line,) = cut_lines(ball, cut)
    np.testing.assert_array_equal(line[0], line[-1])
    assert np.abs((line - cut.point_mm) @ cut.normal).max() < 1e-9
    assert off_surface_mm(line, ball).max() < 1e-9
    height = cut.point_mm @ cut.normal
    expected = 2.0 * np.pi * np.sqrt(20.0**2 - height**2)
    assert length_mm(line) == pytest.approx(expected, rel=0.02)
    # As near to the ball as its triangles are.
    assert np.abs(np.linalg.norm(line, axis=1) - 20.0).max() < 0.2


def test_an_open_mesh_is_cut_in_an_open_line_from_rim_to_rim() -> None:
    cut = plane((0.0, 3.3, 0.0), (0.0, 1.0, 0.0))
    (line,) = cut_lines(MESH, cut)
    assert np.abs(line[:, 1] - 3.3).max() < 1e-9
    assert off_surface_mm(line, MESH).max() < 1e-9
    assert sorted(line[[0, -1], 0]) == pytest.approx([-45.0, 45.0])
    steps = np.diff(line[:, 0])
    assert (steps > 0).all() or (steps < 0).all()


def test_two_parts_are_cut_in_two_lines() -> None:
    left, right = cube(10.0, (-20.0, 0.0, 0.0)), cube(10.0, (20.0, 0.0, 0.0))
    both = TriangleMesh(
        np.vstack([left.vertices_mm, right.vertices_mm]), np.vstack([left.faces, right.faces + 8])
    )
    lines = cut_lines(both, plane((0.0, 0.0, 1.0)))
    assert len(lines) == 2
    for line in lines:
        assert length_mm(line) == pytest.approx(40.0)


def test_the_line_ends_where_the_planned_rectangle_does() -> None:
    (line,) = cut_lines(MESH, plane((0.0, 3.3, 0.0), (0.0, 1.0, 0.0), (30.0, 60.0)))
    # With a margin, to the nearest of the mesh's edges.
    assert 0.5 * 30.0 <= np.abs(line[:, 0]).max() <= 1.3 * 0.5 * 30.0
    assert np.abs(line[:, 0]).max() > 16.0


@pytest.mark.parametrize("z_mm", [20.001, -30.0])
def test_a_plane_that_misses_cuts_nothing(z_mm: float) -> None:
    assert cut_lines(sphere(20.0, 24), plane((0.0, 0.0, z_mm))) == ()


def test_a_plane_through_vertices_still_cuts_a_whole_line() -> None:
    ball = sphere(20.0, 24)
    (line,) = cut_lines(ball, plane())
    assert np.abs(line[:, 2]).max() < 1e-9
    assert length_mm(line) == pytest.approx(2.0 * np.pi * 20.0, rel=0.02)


def test_depth_beyond_is_the_height_over_the_plane_furthest_away() -> None:
    ball = sphere(20.0, 24)
    cuts = (plane((0.0, 0.0, 12.0)), plane((15.0, 0.0, 0.0), (1.0, 0.0, 0.0)))
    found = depth_beyond(ball, cuts)
    x, _, z = ball.vertices_mm.T
    np.testing.assert_allclose(found, np.maximum(np.maximum(z - 12.0, x - 15.0), 0.0), atol=1e-9)
    assert (found > 0).any()
    assert (found == 0).any()


def test_another_part_of_the_bone_beyond_the_plane_stays() -> None:
    ball = sphere(20.0, 24)
    beside = sphere(20.0, 24, (60.0, 0.0, 0.0))
    found = depth_beyond(join_meshes(ball, beside), (plane((0.0, 0.0, 0.0), UP, (10.0, 10.0)),))
    n = len(ball.vertices_mm)
    np.testing.assert_allclose(found[:n], np.maximum(ball.vertices_mm[:, 2], 0.0), atol=1e-9)
    assert not found[n:].any()
