import numpy as np
import pytest

from sim_devices.implicit import Difference, Ellipsoid, Union
from sim_devices.surface_nets import (
    compute_cell_codes,
    make_grid,
    make_surface_net,
    mesh_solid,
    repair_ambiguous,
    sample,
)


def edge_use(faces):
    edges = np.sort(np.stack([faces, np.roll(faces, -1, axis=1)], axis=-1).reshape(-1, 2), axis=1)
    return np.unique(edges, axis=0, return_counts=True)[1]


def directed_edges_are_unique(faces):
    edges = np.stack([faces, np.roll(faces, -1, axis=1)], axis=-1).reshape(-1, 2)
    return len(np.unique(edges, axis=0)) == len(edges)


def box(half):
    return np.full(3, -half), np.full(3, half)


def test_a_ball_becomes_a_closed_outward_mesh_on_its_surface():
    mesh = mesh_solid(Ellipsoid((0.4, -0.3, 0.2), (20.0,) * 3), *box(24.0), 1.2)
    radius = np.linalg.norm(mesh.vertices_mm - [0.4, -0.3, 0.2], axis=1)
    assert np.abs(radius - 20.0).max() < 0.001
    assert (edge_use(mesh.faces) == 2).all()
    assert directed_edges_are_unique(mesh.faces)
    assert mesh.volume_mm3() == pytest.approx(4.0 / 3.0 * np.pi * 8000.0, rel=0.005)
    euler = len(mesh.vertices_mm) - len(edge_use(mesh.faces)) + len(mesh.faces)
    assert euler == 2


def test_triangles_are_well_shaped():
    mesh = mesh_solid(Ellipsoid((0.0, 0.0, 0.0), (20.0, 15.0, 12.0)), *box(24.0), 1.2)
    corners = mesh.vertices_mm[mesh.faces]
    lengths = np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2)
    assert 0.9 < lengths.mean() < 1.4
    assert (lengths.min(axis=1) / lengths.max(axis=1)).min() > 0.15


def test_only_the_largest_piece_is_kept():
    apart = Union(
        Ellipsoid((-8.0, 0.0, 0.0), (10.0,) * 3), ((Ellipsoid((14.0, 0.0, 0.0), (4.0,) * 3), 0.5),)
    )
    assert mesh_solid(apart, *box(24.0), 1.0).vertices_mm[:, 0].max() < 3.0


def test_sampling_is_exact_near_the_surface_and_has_the_right_sign_elsewhere():
    solid = Difference(
        Ellipsoid((0.0, 0.0, 0.0), (20.0, 15.0, 12.0)), Ellipsoid((0, 12.0, 0), (6.0,) * 3), 2.0
    )
    grid = make_grid(*box(23.0), 1.0)
    index = np.stack(np.meshgrid(*map(np.arange, grid.shape), indexing="ij"), -1).reshape(-1, 3)
    exact = solid(grid.points(index)).reshape(grid.shape)
    sampled = sample(solid, grid)
    near = np.abs(exact) < 2.0
    np.testing.assert_array_equal(sampled[near], exact[near])
    np.testing.assert_array_equal(sampled < 0.0, exact < 0.0)


def test_even_noise_gives_a_manifold():
    values = np.random.default_rng(3).standard_normal((12, 13, 14))
    values[[0, -1]] = values[:, [0, -1]] = values[:, :, [0, -1]] = 1.0
    grid = make_grid(np.zeros(3), np.array([11.0, 12.0, 13.0]), 1.0)
    mesh = make_surface_net(values, grid)
    assert (edge_use(mesh.faces) == 2).all()
    assert directed_edges_are_unique(mesh.faces)


def test_repair_leaves_unambiguous_samples_alone():
    grid = make_grid(*box(12.0), 1.0)
    values = sample(Ellipsoid((0.0, 0.0, 0.0), (9.0,) * 3), grid)
    np.testing.assert_array_equal(repair_ambiguous(values), values)


def test_cell_codes_number_the_corners_x_first():
    inside = np.zeros((2, 2, 2), dtype=bool)
    inside[1, 0, 1] = True
    assert compute_cell_codes(inside)[0, 0, 0] == 1 << 5


@pytest.mark.parametrize("radius", [0.1, 30.0])
def test_a_solid_that_is_empty_or_does_not_fit_is_refused(radius):
    solid = Ellipsoid((0.5, 0.5, 0.5), (radius,) * 3)
    with pytest.raises(ValueError, match="inside the grid"):
        mesh_solid(solid, *box(12.0), 1.0)
