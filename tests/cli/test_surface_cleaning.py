import numpy as np
import pytest

from navapp.cli.surface_cleaning import (
    estimate_normals,
    measure_spacing,
    mend,
    thin,
    thin_evenly,
)
from navapp.geometry.mesh import TriangleMesh
from tests.geometry.shapes import sphere


def joined(*meshes: TriangleMesh) -> TriangleMesh:
    vertices = np.concatenate([mesh.vertices_mm for mesh in meshes])
    starts = np.cumsum([0, *(len(mesh.vertices_mm) for mesh in meshes)])
    faces = [mesh.faces + start for mesh, start in zip(meshes, starts, strict=False)]
    return TriangleMesh(vertices, np.concatenate(faces))


def shell(mesh: TriangleMesh, above: float) -> TriangleMesh:
    """The part of a mesh above a plane across z."""
    corners = mesh.vertices_mm[mesh.faces]
    return TriangleMesh(mesh.vertices_mm, mesh.faces[corners[..., 2].min(axis=1) > above])


STRAY = TriangleMesh(np.array([[90.0, 0, 0], [91.0, 0, 0], [90.0, 1, 0]]), np.array([[0, 1, 2]]))


def test_a_sound_mesh_stays_as_it_is():
    found = mend(sphere())
    assert found.notes == ()
    np.testing.assert_array_equal(found.mesh.vertices_mm, sphere().vertices_mm)
    assert len(found.mesh.faces) == len(sphere().faces)
    np.testing.assert_allclose(found.mesh.normals, sphere().normals)


def test_triangles_without_shared_vertices_become_one_surface():
    soup = TriangleMesh(
        sphere().vertices_mm[sphere().faces].reshape(-1, 3),
        np.arange(3 * len(sphere().faces)).reshape(-1, 3),
    )
    found = mend(soup).mesh
    assert len(found.vertices_mm) == len(sphere().vertices_mm)
    assert found.volume_mm3() == pytest.approx(sphere().volume_mm3())


def test_strays_go_and_pieces_of_some_size_stay():
    other = sphere(5.0, centre_mm=(60.0, 0.0, 0.0))
    found = mend(joined(sphere(), STRAY, other))
    assert len(found.mesh.vertices_mm) == len(sphere().vertices_mm) + len(other.vertices_mm)
    assert found.mesh.vertices_mm[:, 0].max() < 70.0
    assert found.notes == ("1 triangles of tiny separate pieces were left out",)


def test_triangles_without_area_and_unused_vertices_go():
    faces = np.concatenate([sphere().faces, [[0, 0, 1], [5, 5, 5]]])
    vertices = np.concatenate([sphere().vertices_mm, [[500.0, 0.0, 0.0]]])
    found = mend(TriangleMesh(vertices, faces)).mesh
    assert len(found.faces) == len(sphere().faces)
    assert len(found.vertices_mm) == len(sphere().vertices_mm)


def test_triangles_given_from_both_sides_count_once():
    faces = np.concatenate([sphere().faces, sphere().faces[:, ::-1]])
    found = mend(TriangleMesh(sphere().vertices_mm, faces)).mesh
    np.testing.assert_allclose(found.normals, sphere().normals)


@pytest.mark.parametrize("opening_mm", [-30.0, -15.0])
def test_a_surface_that_is_all_but_closed_is_turned_outward(opening_mm):
    mesh = shell(sphere(), opening_mm)
    found = mend(mesh.flip())
    assert found.mesh.volume_mm3() > 0.0
    assert "turned" in found.notes[0]
    assert mend(mesh).notes == ()


def test_an_open_bowl_is_not_turned_but_named():
    found = mend(shell(sphere(), 8.0).flip())
    assert found.mesh.volume_mm3() < 0.0
    assert "may point inwards" in found.notes[0]


def test_a_mesh_without_area_has_nothing_left():
    line = TriangleMesh(np.outer(np.arange(9.0), [1, 2, 3]), np.arange(9).reshape(-1, 3))
    assert len(mend(line).mesh.vertices_mm) == 0


def test_a_thinned_mesh_is_the_same_surface_with_even_vertices():
    fine = sphere(20.0, 120)
    coarse = thin(fine, 2000)
    assert 1600 <= len(coarse.vertices_mm) <= 2000
    assert np.abs(np.linalg.norm(coarse.vertices_mm, axis=1) - 20.0).max() < 0.1
    assert coarse.volume_mm3() == pytest.approx(fine.volume_mm3(), rel=0.01)
    cosine = np.einsum("ij,ij->i", coarse.normals, coarse.vertices_mm / 20.0)
    assert cosine.min() > 0.97
    edges = np.sort(coarse.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    _, counts = np.unique(edges, axis=0, return_counts=True)
    assert (counts % 2 == 0).all()  # closed as before


def scattered(n: int, seed: int = 1) -> np.ndarray:
    directions = np.random.default_rng(seed).normal(size=(n, 3))
    return directions / np.linalg.norm(directions, axis=1, keepdims=True)


def test_estimated_normals_are_outward_on_every_part():
    directions = scattered(3000)
    left, right = 20.0 * directions - [40.0, 0, 0], 12.0 * directions + [40.0, 0, 0]
    normals = estimate_normals(np.concatenate([left, right]))
    cosine = np.einsum("ij,ij->i", normals, np.concatenate([directions, directions]))
    assert cosine.min() > 0.95


def test_estimated_normals_do_not_change_their_side_between_thin_walls():
    # A plate, thin beside its width: neighbours of one side are nearer than the other side.
    side = np.stack(np.meshgrid(np.arange(40.0), np.arange(40.0)), axis=-1).reshape(-1, 2)
    side = side + np.random.default_rng(2).uniform(-0.2, 0.2, side.shape)
    top = np.column_stack([side, np.full(len(side), 4.0)])
    normals = estimate_normals(top * [1, 1, -1])
    assert (normals[:, 2] > 0.99).all() or (normals[:, 2] < -0.99).all()


@pytest.mark.parametrize("shape", ["plane", "line", "four points"])
def test_flat_and_straight_clouds_get_unit_normals_too(shape):
    rng = np.random.default_rng(3)
    points = {
        "plane": np.column_stack([rng.uniform(0, 50, (400, 2)), np.zeros(400)]),
        "line": np.outer(np.arange(400.0), [1.0, 0.0, 0.0]),
        "four points": np.eye(4, 3),
    }[shape]
    np.testing.assert_allclose(np.linalg.norm(estimate_normals(points), axis=1), 1.0)


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_points_are_thinned_evenly(scale):
    # Ten times as dense on one half: what is left is as dense on both.
    points = 30.0 * scattered(40_000)
    dense = points[:, 0] > 0.0
    points = scale * points[dense | (np.arange(len(points)) % 10 == 0)]
    kept = thin_evenly(points, 2000)
    assert 1600 <= len(kept) <= 2000
    assert (np.diff(kept) > 0).all()
    share = (points[kept, 0] > 0.0).mean()
    assert share == pytest.approx(0.5, abs=0.1)


def test_spacing_is_that_of_the_nearest_neighbours():
    grid = np.stack(np.meshgrid(*[np.arange(5) * 0.25] * 3), axis=-1).reshape(-1, 3)
    assert measure_spacing(grid) == pytest.approx(0.25)
