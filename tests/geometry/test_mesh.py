import numpy as np
import pytest

from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.transform import RigidTransform, rotation_from_vector
from tests.geometry.shapes import cube, sphere

EMPTY = TriangleMesh(np.empty((0, 3)), np.empty((0, 3), dtype=np.int32))


def test_normals_of_a_sphere_are_unit_and_point_outwards():
    centre = np.array([5.0, -3.0, 400.0])
    ball = sphere(20.0, 24, centre)
    np.testing.assert_allclose(np.linalg.norm(ball.normals, axis=1), 1.0, atol=1e-12)
    outward = (ball.vertices_mm - centre) / 20.0
    assert np.einsum("ij,ij->i", ball.normals, outward).min() > 0.995


def test_large_triangles_weigh_more_in_a_normal():
    vertices = np.array([[0, 0, 0], [10, 0, 0], [0, 10, 0], [0, 0, 1], [0, 1, 0.0]])
    mesh = TriangleMesh(vertices, [[0, 1, 2], [0, 3, 4]])
    np.testing.assert_allclose(mesh.normals[0], np.array([-1, 0, 100]) / np.hypot(1, 100))


def test_a_vertex_of_no_triangle_has_no_normal():
    mesh = TriangleMesh(np.vstack([cube().vertices_mm, [[9, 9, 9]]]), cube().faces)
    np.testing.assert_array_equal(mesh.normals[8], 0.0)


def test_the_volume_of_a_cube_is_exact_anywhere():
    assert cube(3.0).volume_mm3() == pytest.approx(27.0, rel=1e-12)
    assert cube(3.0, (1e4, -1e4, 1e4)).volume_mm3() == pytest.approx(27.0, rel=1e-9)


def test_the_volume_of_a_sphere_approaches_its_formula():
    exact = 4 / 3 * np.pi * 20.0**3
    coarse, fine = (exact - sphere(20.0, n).volume_mm3() for n in (12, 24))
    assert 0 < fine < 0.02 * exact
    assert coarse / fine == pytest.approx(4.0, rel=0.1)


def test_flipping_turns_normals_faces_and_volume():
    mesh = sphere().flip()
    assert mesh.volume_mm3() == pytest.approx(-sphere().volume_mm3())
    np.testing.assert_allclose(
        TriangleMesh(mesh.vertices_mm, mesh.faces).normals, mesh.normals, atol=1e-12
    )
    np.testing.assert_array_equal(mesh.flip().faces, sphere().faces)


def test_the_largest_piece_is_kept_without_unused_vertices():
    big, small = sphere(), cube(1.0, (100, 0, 0))
    n = len(small.vertices_mm)
    both = TriangleMesh(
        np.vstack([small.vertices_mm, big.vertices_mm, [[7, 7, 7]]]),
        np.vstack([small.faces, big.faces + n]),
    )
    kept = both.largest_component()
    np.testing.assert_array_equal(kept.vertices_mm, big.vertices_mm)
    np.testing.assert_array_equal(kept.faces, big.faces)
    np.testing.assert_allclose(kept.normals, big.normals)


def test_triangles_that_share_one_vertex_are_one_piece():
    vertices = np.random.default_rng(1).normal(size=(5, 3))
    assert len(TriangleMesh(vertices, [[0, 1, 2], [2, 3, 4]]).largest_component().faces) == 2


def test_moving_a_mesh_turns_its_normals():
    pose = RigidTransform.from_parts("a", "b", rotation_from_vector([0.3, 1.2, -0.5]), [1, 2, 3])
    moved = sphere().transform(pose)
    np.testing.assert_allclose(
        moved.normals, TriangleMesh(moved.vertices_mm, moved.faces).normals, atol=1e-12
    )
    np.testing.assert_allclose(moved.vertices_mm, pose.apply(sphere().vertices_mm))


def test_centroid_and_size():
    mesh = cube(4.0, (1, 2, 3))
    np.testing.assert_allclose(mesh.centroid_mm, [1, 2, 3])
    np.testing.assert_allclose(mesh.size_mm, [4, 4, 4])


def test_an_empty_mesh_has_nothing():
    assert EMPTY.normals.shape == (0, 3)
    assert EMPTY.volume_mm3() == 0.0
    assert len(EMPTY.largest_component().vertices_mm) == 0
    assert len(EMPTY.flip().faces) == 0


def test_points_without_triangles_have_no_largest_piece():
    cloud = TriangleMesh(np.eye(3), np.empty((0, 3), dtype=np.int32))
    assert len(cloud.largest_component().vertices_mm) == 0
    assert cloud.volume_mm3() == 0.0


@pytest.mark.parametrize("faces", [[[0, 1, 3]], [[0, 1, -1]]])
def test_a_face_of_a_vertex_that_does_not_exist_is_refused(faces):
    with pytest.raises(ValueError, match="vertex that does not exist"):
        TriangleMesh(np.eye(3), faces)


@pytest.mark.parametrize(
    ("vertices", "faces"),
    [
        (np.zeros((3, 2)), [[0, 1, 2]]),
        (np.zeros(3), [[0, 0, 0]]),
        (np.full((3, 3), np.nan), [[0, 1, 2]]),
        (np.full((3, 3), np.inf), [[0, 1, 2]]),
        (np.eye(3), [[0, 1]]),
        (np.eye(3), [0, 1, 2]),
    ],
)
def test_bad_shapes_and_values_are_refused(vertices, faces):
    with pytest.raises(ValueError, match="must be"):
        TriangleMesh(vertices, faces)


@pytest.mark.parametrize("normals", [np.zeros((2, 3)), np.full((3, 3), np.nan)])
def test_bad_normals_are_refused(normals):
    with pytest.raises(ValueError, match="normal"):
        TriangleMesh(np.eye(3), [[0, 1, 2]], normals)


def test_a_mesh_cannot_be_changed_from_outside():
    vertices = np.eye(3)
    mesh = TriangleMesh(vertices, [[0, 1, 2]])
    vertices[0] = 9.0
    np.testing.assert_array_equal(mesh.vertices_mm, np.eye(3))
    for array in (mesh.vertices_mm, mesh.faces, mesh.normals):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0


def test_areas_and_volumes_of_triangles_add_up() -> None:
    mesh = cube(2.0)
    assert mesh.face_areas_mm2() == pytest.approx(np.full(12, 2.0))
    assert mesh.face_volumes_mm3() == pytest.approx(np.full(12, 2.0 / 3.0))
