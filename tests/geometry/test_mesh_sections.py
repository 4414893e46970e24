"""Lines in which a plane cuts a mesh, and the area that they enclose."""

import numpy as np
import pytest

from navapp.geometry.mesh import TriangleMesh, join_meshes
from navapp.geometry.mesh_sections import clip_below, count_corners, fill_section, section_lines
from tests.geometry.shapes import cube, sphere

UP = np.array([0.0, 0.0, 1.0])


def height(mesh: TriangleMesh, level_mm: float) -> np.ndarray:
    return mesh.vertices_mm[:, 2] - level_mm


def test_a_sphere_is_cut_in_a_closed_circle() -> None:
    ball = sphere(20.0, 40)
    (line,) = section_lines(ball, height(ball, 12.0))
    np.testing.assert_allclose(line[0], line[-1])
    np.testing.assert_allclose(line[:, 2], 12.0, atol=1e-9)
    np.testing.assert_allclose(np.hypot(line[:, 0], line[:, 1]), 16.0, atol=0.1)


def test_corners_are_counted_as_by_numpy() -> None:
    ball = sphere(20.0, 24)
    is_marked = np.random.default_rng(1).random((len(ball.vertices_mm), 2))[:, 0] > 0.5
    n_corners = is_marked[ball.faces].sum(axis=1)
    assert set(n_corners) == {0, 1, 2, 3}
    np.testing.assert_array_equal(count_corners(ball.faces, is_marked), n_corners)


def test_an_open_mesh_is_cut_in_an_open_line() -> None:
    ball = sphere(20.0, 24)
    half = TriangleMesh(ball.vertices_mm, ball.faces[ball.vertices_mm[ball.faces, 0].min(1) > 1e-6])
    (line,) = section_lines(half, height(half, 3.0))
    assert not np.allclose(line[0], line[-1])


@pytest.mark.parametrize("normal", [UP, -UP])
def test_the_area_of_a_section_faces_along_the_normal(normal: np.ndarray) -> None:
    ball = sphere(20.0, 60)
    lid = fill_section(section_lines(ball, height(ball, 12.0)), normal)
    assert lid is not None
    assert lid.face_areas_mm2().sum() == pytest.approx(np.pi * 16.0**2, rel=0.01)
    a, b, c = (lid.vertices_mm[lid.faces[:, k]] for k in range(3))
    assert (np.cross(b - a, c - a) @ normal > 0.0).all()


def test_a_hole_and_an_island_are_told_from_the_area() -> None:
    wall, hole = sphere(20.0, 60), sphere(10.0, 60).flip()
    apart = sphere(5.0, 60, (40.0, 0.0, 0.0))
    body = join_meshes(wall, hole, apart)
    lid = fill_section(section_lines(body, height(body, 0.5)), UP)
    assert lid is not None
    expected = np.pi * (20.0**2 - 10.0**2 + 5.0**2)
    assert lid.face_areas_mm2().sum() == pytest.approx(expected, rel=0.01)


def test_an_area_is_filled_with_small_triangles_when_asked() -> None:
    wall, hole = sphere(20.0, 120), sphere(10.0, 120).flip()
    body = join_meshes(wall, hole)
    lid = fill_section(section_lines(body, height(body, 0.5)), UP, step_mm=1.0)
    assert lid is not None
    assert lid.face_areas_mm2().sum() == pytest.approx(np.pi * (20.0**2 - 10.0**2), rel=0.01)
    np.testing.assert_allclose(lid.vertices_mm[:, 2], 0.5, atol=1e-9)
    corners = lid.vertices_mm[lid.faces]
    assert np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max() < 2.5


def test_where_nothing_is_cut_there_is_no_area() -> None:
    block = cube(10.0)
    assert section_lines(block, height(block, 20.0)) == []
    assert fill_section([], UP) is None
    assert fill_section([np.zeros((5, 3))], UP) is None


def test_joined_meshes_keep_their_order() -> None:
    one, other = cube(10.0), sphere(3.0, 8)
    both = join_meshes(one, other)
    np.testing.assert_array_equal(both.faces[: len(one.faces)], one.faces)
    assert both.volume_mm3() == pytest.approx(one.volume_mm3() + other.volume_mm3(), rel=1e-3)


@pytest.mark.parametrize("level_mm", [-7.3, 0.4, 12.0])
def test_a_clipped_ball_and_its_lid_hold_what_the_cap_leaves(level_mm: float) -> None:
    ball = sphere(20.0, 60)
    heights_mm = height(ball, level_mm)
    below = clip_below(ball, heights_mm)
    np.testing.assert_array_equal(below.vertices_mm[: len(ball.vertices_mm)], ball.vertices_mm)
    used = below.vertices_mm[np.unique(below.faces)]
    assert used[:, 2].max() == pytest.approx(level_mm)
    lid = fill_section(section_lines(ball, heights_mm), UP)
    assert lid is not None
    cap_mm = 20.0 - level_mm
    cap_mm3 = np.pi * cap_mm**2 * (60.0 - cap_mm) / 3.0
    left_mm3 = join_meshes(below, lid).volume_mm3()
    assert left_mm3 == pytest.approx(4.0 / 3.0 * np.pi * 20.0**3 - cap_mm3, rel=0.01)


@pytest.mark.parametrize(("level_mm", "share"), [(30.0, 1.0), (-30.0, 0.0)])
def test_a_plane_beside_a_mesh_leaves_all_or_nothing(level_mm: float, share: float) -> None:
    ball = sphere(20.0, 20)
    assert len(clip_below(ball, height(ball, level_mm)).faces) == share * len(ball.faces)
