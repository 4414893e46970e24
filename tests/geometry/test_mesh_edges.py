"""Edges over which a mesh bends outward, and those where it ends."""

import numpy as np

from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.mesh_edges import half_edges, open_border, pair_half_edges, ridge_edges
from tests.registration.shapes import ball_mesh, grid_mesh, tube_mesh

CORNERS = np.array([[x, y, z] for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)])
# Two triangles a side, counter-clockwise from outside.
SIDES = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
CUBE = TriangleMesh(
    CORNERS, np.array([[s[0], s[a], s[b]] for s in SIDES for a, b in ((1, 2), (2, 3))])
)


def test_a_cube_has_its_twelve_edges_and_no_diagonal() -> None:
    assert CUBE.volume_mm3() > 0.0
    found = ridge_edges(CUBE)
    assert len(found.edges) == 12
    length = np.linalg.norm(CORNERS[found.edges[:, 0]] - CORNERS[found.edges[:, 1]], axis=1)
    np.testing.assert_allclose(length, 1.0)


def test_the_triangles_of_an_edge_hold_it_and_their_third_vertex() -> None:
    found = ridge_edges(CUBE)
    for edge, faces, opposite in zip(found.edges, found.faces, found.opposite, strict=True):
        for face, third in zip(faces, opposite, strict=True):
            assert set(CUBE.faces[face]) == {*edge, third}


def test_planes_go_through_their_triangles_and_look_outward() -> None:
    normals, offsets = np.split(ridge_edges(CUBE).planes, [3])
    corners = CORNERS[CUBE.faces]
    np.testing.assert_allclose(np.einsum("kf,fck->fc", normals, corners).T, offsets[[0] * 3])
    assert (normals.T @ np.full(3, 0.5) < offsets[0]).all()


def test_grooves_and_open_borders_are_left_out() -> None:
    assert len(ridge_edges(CUBE.flip()).edges) == 0
    without_a_side = TriangleMesh(CORNERS, CUBE.faces[2:])
    assert len(ridge_edges(without_a_side).edges) == 8


def test_every_edge_has_its_half_edges_once() -> None:
    faces = np.array([[0, 1, 2], [2, 1, 3], [3, 1, 4]], dtype=np.int32)
    ends, halves = half_edges(faces), pair_half_edges(faces)
    edges = [tuple(sorted(ends[one])) for one in halves[:, 0]]
    assert sorted(edges) == [(0, 1), (0, 2), (1, 2), (1, 3), (1, 4), (2, 3), (3, 4)]
    shared = {edge for edge, other in zip(edges, halves[:, 1], strict=True) if other >= 0}
    assert shared == {(1, 2), (1, 3)}
    for one, other in halves[halves[:, 1] >= 0]:
        assert one % len(faces) != other % len(faces)
        assert set(ends[one]) == set(ends[other])


def test_an_edge_of_three_triangles_keeps_two() -> None:
    faces = np.array([[0, 1, 2], [1, 0, 3], [0, 1, 4]], dtype=np.int32)
    halves = pair_half_edges(faces)
    assert len(halves) == 7
    assert (halves[:, 1] >= 0).sum() == 1


def test_a_border_is_where_the_surface_ends() -> None:
    mesh = grid_mesh(lambda x, y: 0.0 * x, 10.0)
    is_rim = np.abs(mesh.vertices_mm[:, :2]).max(axis=1) > 9.9
    np.testing.assert_array_equal(open_border(len(is_rim), mesh.faces), is_rim)
    tube = tube_mesh(20.0, 30.0)
    is_end = np.abs(tube.vertices_mm[:, 1]) > 29.9
    np.testing.assert_array_equal(open_border(len(is_end), tube.faces), is_end)


def test_a_closed_surface_and_a_cloud_have_no_border() -> None:
    mesh = ball_mesh(20.0, 200)
    assert not open_border(200, mesh.faces).any()
    assert not open_border(200, np.empty((0, 3), dtype=np.int32)).any()
