import numpy as np
import pytest
from scipy.spatial import cKDTree

from navapp.geometry.vertex_neighbourhoods import compute_curvature, find_neighbours
from tests.registration.shapes import ball_mesh, grid_mesh, tube_mesh

NO_FACES = np.empty((0, 3), dtype=np.int32)


def table_of(mesh) -> np.ndarray:
    return find_neighbours(mesh.vertices_mm, mesh.faces)


def matrices(form: np.ndarray) -> np.ndarray:
    xx, yy, zz, xy, xz, yz = form.T
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]).transpose(2, 0, 1)


def test_neighbours_are_those_along_the_edges() -> None:
    mesh = ball_mesh(20.0, 200)
    beside = [set() for _ in mesh.vertices_mm]
    for a, b, c in mesh.faces:
        beside[a] |= {b, c}
        beside[b] |= {a, c}
        beside[c] |= {a, b}
    found = [set(row[row >= 0]) for row in table_of(mesh)]
    assert found == beside


def test_padding_stands_at_the_end() -> None:
    table = table_of(grid_mesh(lambda x, y: 0.0 * x, 10.0))
    first_gap = (table >= 0).argmin(axis=1)
    for row, n in zip(table, first_gap, strict=True):
        if row.min() < 0:
            assert (row[n:] == -1).all()
    assert table.min() == -1


def test_a_cloud_has_its_nearest_points_as_neighbours_and_they_have_it() -> None:
    points = np.random.default_rng(1).uniform(0.0, 10.0, (200, 3))
    table = find_neighbours(points, NO_FACES)
    nearest = cKDTree(points).query(points, k=2)[1][:, 1]
    assert ((table >= 0).sum(axis=1) >= 8).all()
    is_full = (table >= 0).all(axis=1)
    for v, other in enumerate(nearest):
        assert other in table[v] or is_full[v]
        assert v in table[other] or is_full[other]
    assert not (table == np.arange(200)[:, None]).any()


@pytest.mark.parametrize("n", [1, 2, 5])
def test_a_cloud_of_few_points_is_allowed(n: int) -> None:
    points = np.random.default_rng(1).uniform(0.0, 10.0, (n, 3))
    table = find_neighbours(points, NO_FACES)
    assert ((table >= 0).sum(axis=1) == n - 1).all()


def test_a_vertex_that_no_face_touches_is_joined_to_the_mesh() -> None:
    mesh = grid_mesh(lambda x, y: 0.0 * x, 10.0)
    points = np.concatenate([mesh.vertices_mm, [[0.3, 0.2, 1.0]]])
    table = find_neighbours(points, mesh.faces)
    alone = len(points) - 1
    assert (table[alone] >= 0).sum() == 8
    assert alone in table[table[alone, 0]]


def test_a_ball_bends_by_one_over_its_radius_in_all_tangents() -> None:
    mesh = ball_mesh(20.0)
    normals = mesh.vertices_mm / 20.0
    form, spacing = compute_curvature(mesh.vertices_mm, normals, table_of(mesh))
    expected = (np.eye(3) - normals[:, :, None] * normals[:, None, :]) / 20.0
    np.testing.assert_allclose(matrices(form), expected, atol=1e-4)
    index = table_of(mesh)[7]
    offsets = mesh.vertices_mm[index[index >= 0]] - mesh.vertices_mm[7]
    assert spacing[7] == pytest.approx(np.linalg.norm(offsets, axis=1).mean())


def test_a_tube_bends_across_its_axis_only() -> None:
    mesh = tube_mesh(20.0, 30.0)
    form, _ = compute_curvature(mesh.vertices_mm, mesh.normals, table_of(mesh))
    inner = np.abs(mesh.vertices_mm[:, 1]) < 25.0
    principal = np.linalg.eigvalsh(matrices(form)[inner])
    np.testing.assert_allclose(principal[:, 2], 1.0 / 20.0, rtol=0.02)
    np.testing.assert_allclose(principal[:, :2], 0.0, atol=1e-4)
    along = np.einsum("nij,j->ni", matrices(form)[inner], (0.0, 1.0, 0.0))
    np.testing.assert_allclose(along, 0.0, atol=1e-4)


def test_a_hollow_bends_the_other_way() -> None:
    mesh = ball_mesh(20.0)
    form, _ = compute_curvature(mesh.vertices_mm, -mesh.vertices_mm / 20.0, table_of(mesh))
    np.testing.assert_allclose(np.trace(matrices(form), axis1=1, axis2=2), -0.1, atol=1e-3)


def test_a_crease_bends_no_tighter_than_its_spacing_allows() -> None:
    mesh = grid_mesh(lambda x, y: 5.0 * np.abs(x))
    form, spacing = compute_curvature(mesh.vertices_mm, mesh.normals, table_of(mesh))
    assert np.abs(np.linalg.eigvalsh(matrices(form))).max(axis=1).max() <= (
        np.sqrt(2.0) / (1.5 * spacing.min()) + 1e-9
    )
    is_crease = np.abs(mesh.vertices_mm[:, 0]) < 2.1
    assert np.abs(form[is_crease]).max() > 0.05


def test_a_point_without_neighbours_is_flat() -> None:
    form, spacing = compute_curvature(
        np.zeros((1, 3)), np.array([[0.0, 0.0, 1.0]]), np.full((1, 4), -1)
    )
    np.testing.assert_array_equal(form, 0.0)
    np.testing.assert_array_equal(spacing, 0.0)
