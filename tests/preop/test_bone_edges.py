"""Creases of a surface, and what lies near its ends."""

import numpy as np
import pytest

from navapp.preop.bone_edges import find_creases, find_near_ends
from tests.geometry.shapes import sphere
from tests.registration.shapes import grid_mesh

HALF_MM, SPACING_MM = 20.0, 1.0
# Its sides bulge: a flat one would be taken for a cap.
ROOF = grid_mesh(lambda x, y: -np.abs(x) - 0.01 * (x * x + y * y), HALF_MM, SPACING_MM)


def inside(mesh) -> np.ndarray:
    return ~find_near_ends(mesh)


def test_the_ridge_of_a_roof_is_one_line_along_it() -> None:
    crease = find_creases(ROOF, inside(ROOF))
    assert np.abs(crease.points_mm[:, 0]).max() < 0.5 * SPACING_MM
    rows = np.unique(crease.points_mm[:, 1].round(3))
    assert len(rows) == len(crease.points_mm) > 25
    slope = -0.02 * crease.points_mm[:, 1]
    along = np.column_stack([np.zeros_like(slope), np.ones_like(slope), slope])
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    assert np.abs((crease.tangents * along).sum(axis=1)).min() > 0.999
    np.testing.assert_allclose(np.linalg.norm(crease.tangents, axis=1), 1.0, atol=1e-6)
    np.testing.assert_allclose((crease.normals * along).sum(axis=1), 0.0, atol=0.05)


def test_only_wanted_vertices_are_creases() -> None:
    is_wanted = inside(ROOF) & (ROOF.vertices_mm[:, 1] > 0.0)
    assert find_creases(ROOF, is_wanted).points_mm[:, 1].min() > 0.0


def test_what_bends_as_much_along_as_across_is_no_crease() -> None:
    ball = sphere(5.0)
    assert len(find_creases(ball, inside(ball)).points_mm) == 0


@pytest.mark.parametrize(("radius_mm", "is_crease"), [(6.5, True), (7.5, False)])
def test_a_crease_bends_more_sharply_than_7_mm(radius_mm: float, is_crease: bool) -> None:
    arch = grid_mesh(lambda x, y: -x * x / (2.0 * radius_mm), 12.0, 0.8)
    found = find_creases(arch, inside(arch))
    assert (len(found.points_mm) > 0) is is_crease
    assert np.abs(found.points_mm[:, 0]).max(initial=0.0) < 1.0


@pytest.mark.parametrize(("along_mm", "is_crease"), [(11.0, True), (9.0, False)])
def test_a_crease_bends_twice_as_sharply_across_as_along(along_mm: float, is_crease: bool) -> None:
    saddle = grid_mesh(lambda x, y: -x * x / 10.0 + y * y / (2.0 * along_mm), 12.0, 0.5)
    is_middle = np.abs(saddle.vertices_mm[:, :2]).max(axis=1) < 1.0
    assert (len(find_creases(saddle, is_middle).points_mm) > 0) is is_crease


@pytest.mark.parametrize("spacing_mm", [0.4, 0.8])
def test_roughness_of_a_fine_mesh_is_no_crease(spacing_mm: float) -> None:
    rng = np.random.default_rng(7)
    rough = grid_mesh(lambda x, y: rng.normal(0.0, 0.4 * spacing_mm, x.shape), 12.0, spacing_mm)
    assert len(find_creases(rough, inside(rough)).points_mm) == 0


def test_what_lies_within_3_mm_of_an_open_border_is_near_an_end() -> None:
    bowl = grid_mesh(lambda x, y: 0.01 * (x * x + y * y), 10.0, 0.2)
    across_mm = np.abs(bowl.vertices_mm[:, :2]).max(axis=1)
    # Straight, to the border that is nearest.
    from_border_mm = np.hypot(10.0 - across_mm, 0.01 * (100.0 - across_mm**2))
    is_end = find_near_ends(bowl)
    assert is_end[from_border_mm < 2.85].all()
    assert not is_end[from_border_mm > 3.15].any()


def test_a_closed_surface_without_a_cap_has_no_end() -> None:
    assert not find_near_ends(sphere(20.0)).any()
