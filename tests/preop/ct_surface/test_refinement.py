"""Surfaces moved to edges whose density is known by formula, without voxels between."""

import numpy as np
import pytest

from navapp.preop.ct_surface.blur import neighbours_of
from navapp.preop.ct_surface.cortex_model import Scan
from navapp.preop.ct_surface.refinement import _smooth_offsets, _until_class, refine_surface
from tests.geometry.shapes import sphere
from tests.preop.ct_phantoms import (
    SOFT_HU,
    ct_of,
    hollow_ball,
    lattice,
    leaning_axes,
    points_of,
)

SCAN = Scan(1200.0, 50.0, 0.5, 0.5)
SIZE, SPACING_MM, RADIUS_MM = (50, 50, 60), (0.8, 0.8, 1.0), 10.0
NEIGHBOUR_MM = np.array([0.0, 0.0, 2.0 * RADIUS_MM + 1.3])


@pytest.fixture(params=[np.eye(3), leaning_axes()], ids=["straight", "leaning"])
def ct(request):
    matrix = lattice(SIZE, SPACING_MM, request.param, (0.0, 0.0, 8.0))
    return ct_of(np.zeros(SIZE[::-1]), matrix)


def alone(points):
    return SOFT_HU + hollow_ball(points, np.zeros(3), RADIUS_MM)


def with_neighbour(points):
    return alone(points) + hollow_ball(points, NEIGHBOUR_MM, RADIUS_MM)


def refined(ct, density, off_mm=0.0, reach_mm=0.6, is_cut=None, is_other=None):
    mesh = sphere(RADIUS_MM + off_mm, 24)
    n = len(mesh.vertices_mm)
    is_cut = np.zeros(n, dtype=bool) if is_cut is None else is_cut
    is_other = np.zeros(ct.hu.shape, dtype=bool) if is_other is None else is_other
    found = refine_surface(mesh, is_cut, ct, is_other, density, SCAN, reach_mm)
    return found, np.linalg.norm(found.mesh.vertices_mm, axis=1) - RADIUS_MM


@pytest.mark.parametrize("off_mm", [-0.8, -0.3, 0.0, 0.3, 0.8])
def test_a_surface_moves_to_the_edge(ct, off_mm):
    found, left_mm = refined(ct, alone, off_mm, 1.5)
    assert found.is_measured.all()
    np.testing.assert_allclose(left_mm, 0.0, atol=0.04)


def test_what_is_cut_stays_where_it_is_and_is_not_measured(ct):
    is_cut = sphere(RADIUS_MM + 0.3, 24).vertices_mm[:, 2] > 7.0
    found, left_mm = refined(ct, alone, 0.3, is_cut=is_cut)
    assert (found.is_measured == ~is_cut).all()
    np.testing.assert_allclose(left_mm[is_cut], 0.3, atol=1e-9)
    np.testing.assert_allclose(left_mm[~is_cut], 0.0, atol=0.04)


def test_beyond_reach_nothing_is_measured(ct):
    found, _ = refined(ct, alone, 0.8, 0.6)
    assert not found.is_measured.any()


def test_what_no_plate_explains_follows_its_neighbours(ct):
    """A screw in the bone, a little under its surface."""

    def with_screw(points):
        at = np.array([RADIUS_MM + 1.0, 0.0, 0.0])
        return alone(points) + 2500.0 * np.exp(-0.5 * ((points - at) ** 2).sum(axis=-1) / 1.2**2)

    found, left_mm = refined(ct, with_screw, 0.2, 0.6)
    away_mm = np.linalg.norm(found.mesh.vertices_mm - [RADIUS_MM, 0.0, 0.0], axis=1)
    assert not found.is_measured[away_mm < 1.0].any()
    assert found.is_measured[away_mm > 6.0].all()
    np.testing.assert_allclose(left_mm[away_mm > 6.0], 0.0, atol=0.04)
    assert np.abs(left_mm).max() < 0.65


def test_the_neighbour_across_the_joint_is_left_out(ct):
    is_other = np.linalg.norm(points_of(SIZE, ct.lps_from_index) - NEIGHBOUR_MM, axis=-1) < 10.0
    found, left_mm = refined(ct, with_neighbour, 0.2, is_other=is_other)
    facing = found.mesh.vertices_mm[:, 2] > 9.5
    assert found.is_measured[facing].all()
    np.testing.assert_allclose(left_mm[facing], 0.0, atol=0.12)
    np.testing.assert_allclose(left_mm[found.mesh.vertices_mm[:, 2] < 5.0], 0.0, atol=0.04)


def test_samples_end_half_way_to_another_bone(ct):
    is_other = points_of(SIZE, ct.lps_from_index)[..., 2] > RADIUS_MM + 3.0
    mesh = sphere(RADIUS_MM, 24)
    until = np.array([0.5, 0.75, 1.0, 1.5, 2.0, 3.0])[_until_class(mesh, ct, is_other)]
    x, y, z = mesh.vertices_mm.T
    up = np.hypot(x, y) < 1.0
    assert set(until[up & (z > 0.0)]) == {1.5}
    assert set(until[z < 5.0]) == {3.0}


def test_evening_takes_noise_and_keeps_what_all_say():
    mesh = sphere(RADIUS_MM, 24)
    n = len(mesh.vertices_mm)
    neighbours = neighbours_of(mesh.faces, n)
    noise = np.random.default_rng(0).normal(0.0, 0.1, n)
    even = _smooth_offsets(0.3 + noise, np.ones(n), neighbours)
    assert even.mean() == pytest.approx(0.3, abs=0.02)
    assert even.std() < 0.5 * noise.std()
    np.testing.assert_allclose(_smooth_offsets(np.full(n, 0.3), np.ones(n), neighbours), 0.3)
    assert not _smooth_offsets(noise, np.zeros(n), neighbours).any()
    # One wild value without weight is not heard at all.
    weight, wild = np.ones(n), np.full(n, 0.3)
    weight[n // 2], wild[n // 2] = 0.0, 50.0
    np.testing.assert_allclose(_smooth_offsets(wild, weight, neighbours), 0.3)
