import os
from pathlib import Path

import numpy as np
import pytest

from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.ply import read_ply
from navapp.preop.cut_ends import (
    anatomy_of,
    ends_of,
    find_whole_until_mm,
    on_cut_borders,
    on_flat_caps,
)
from navapp.values import BoneModel
from tests.geometry.shapes import cube, sphere
from tests.preop.knees import knees

DATA = Path(os.environ.get("NAVAPP_DATA", "../shared/data"))
CUT = [f"bones/pymskt/{name}" for name in ("femur_1", "femur_2", "femur_3", "tibia_1", "tibia_2")]
CUT += [
    f"{folder}/{bone}"
    for folder in ("bones/knee_dess_R", "phantom_a", "phantom_c")
    for bone in ("femur", "tibia")
]
BALL = sphere(30.0, 30)
SHEET = 40.0 * np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 0, 0], [1, 1, 0], [0, 1.0, 0]])
TILTED = np.array([0.36, -0.48, 0.8])


def cut_ball(across):
    """The ball squeezed flat 20 mm from its middle, and which vertices that took."""
    beyond = np.maximum(BALL.vertices_mm @ across - 20.0, 0.0)
    return TriangleMesh(BALL.vertices_mm - beyond[:, None] * across, BALL.faces), beyond > 0.0


@pytest.mark.parametrize("across", [(0.0, 0.0, 1.0), (0.0, 0.0, -1.0), TILTED])
def test_a_flat_end_is_found_however_oblique_and_a_round_one_is_none(across) -> None:
    assert not on_flat_caps(BALL).any()
    cut, was_taken = cut_ball(np.asarray(across))
    found = on_flat_caps(cut)
    assert found[was_taken].mean() > 0.9
    # Nothing below the plane.
    assert (cut.vertices_mm[found] @ across > 19.5).all()


def rod(radius_mm: float, n: int = 64) -> TriangleMesh:
    """A closed cylinder, 60 mm long, along z."""
    angle = 2.0 * np.pi * np.arange(n) / n
    ring = radius_mm * np.column_stack([np.cos(angle), np.sin(angle)])
    ends = [np.column_stack([ring, np.full(n, z)]) for z in (0.0, 60.0)]
    middles = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 60.0]])
    a, b = np.arange(n), np.roll(np.arange(n), -1)
    low, high = np.full(n, 2 * n), np.full(n, 2 * n + 1)
    corners = [(b, a, low), (a + n, b + n, high), (a, b, b + n), (a, b + n, a + n)]
    faces = np.concatenate([np.column_stack(one) for one in corners])
    return TriangleMesh(np.vstack([*ends, middles]), faces.astype(np.int32))


def test_an_end_of_two_and_a_half_square_centimetres_is_a_cap_and_a_smaller_one_is_none() -> None:
    # 64 sides: 250 mm2 at 8.927 mm.
    assert on_flat_caps(rod(8.94)).all()
    assert not on_flat_caps(rod(8.91)).any()


def test_a_long_border_is_a_cut_and_a_hole_is_none() -> None:
    assert not on_cut_borders(BALL).any()
    assert not on_cut_borders(TriangleMesh(BALL.vertices_mm, BALL.faces[1:])).any()
    height = BALL.vertices_mm[:, 2]
    bowl = TriangleMesh(BALL.vertices_mm, BALL.faces[(height < 15.0)[BALL.faces].all(axis=1)])
    found = on_cut_borders(bowl)
    assert found.any()
    assert (height[found] > 11.0).all()
    assert (height[found] < 15.0).all()


def test_anatomy_is_what_is_neither_cap_nor_cut_away() -> None:
    cut, was_taken = cut_ball(TILTED)
    low = cut.vertices_mm[:, 2] < -15.0
    bone = BoneModel("femur", cut, is_removed=low)
    own = anatomy_of(bone)
    kept = {tuple(vertex) for vertex in own.vertices_mm}
    assert not kept & {tuple(vertex) for vertex in cut.vertices_mm[low | was_taken]}
    assert len(kept) > 0.95 * (~(low | was_taken)).sum()
    np.testing.assert_allclose(np.linalg.norm(own.normals, axis=1), 1.0)
    # Open in both places, and there only.
    border = own.vertices_mm[on_cut_borders(own)]
    assert {"cap", "cut"} == {"cap" if point @ TILTED > 15.0 else "cut" for point in border}
    assert ((border @ TILTED > 15.0) | (border[:, 2] < -10.0)).all()
    assert ends_of(bone)[low | was_taken].mean() > 0.95
    assert not ends_of(bone)[
        (cut.vertices_mm[:, 2] > -14.0) & (cut.vertices_mm @ TILTED < 19.0)
    ].any()


@pytest.mark.parametrize("name", ["femur", "patella"])
@pytest.mark.parametrize("direction", [(1.0, 0.0, 0.0), (-0.8, 0.6, 0.0)])
def test_a_bone_cut_from_its_side_has_a_cap_there(name, direction) -> None:
    """By the edge of a picture that does not hold all of it."""
    across = np.array(direction)
    for knee in knees()[:6:2]:
        mesh = knee.bones[name]
        height = mesh.vertices_mm @ across
        beyond = np.maximum(height - height.max() + 0.25 * np.ptp(height), 0.0)
        cut = TriangleMesh(mesh.vertices_mm - beyond[:, None] * across, mesh.faces)
        assert on_flat_caps(cut)[beyond > 0.0].mean() > 0.9


def test_nothing_of_a_box_is_anatomy() -> None:
    """Of its sides, which are no caps, only triangles with a corner on a cap."""
    assert len(anatomy_of(BoneModel("femur", cube(20.0))).faces) == 0


@pytest.mark.parametrize("points", [np.empty((0, 3)), np.eye(3), np.zeros((9, 3)), SHEET])
def test_what_is_hardly_a_surface_has_no_caps(points) -> None:
    faces = np.arange(len(points), dtype=np.int32).reshape(-1, 3)
    assert not on_flat_caps(TriangleMesh(points, faces)).any()


@pytest.mark.release
def test_the_joints_surfaces_of_simulated_bones_are_no_caps(people) -> None:
    """Some of their patellae have facets as flat as a cut."""
    for knee in people:
        for name, sign in (("femur", -1.0), ("tibia", 1.0), ("patella", 0.0)):
            mesh = knee.bones[name]
            height = sign * (mesh.vertices_mm[:, 2] - mesh.centroid_mm[2])
            assert not (on_flat_caps(mesh) & (height >= 0.0)).any()


@pytest.mark.data
@pytest.mark.parametrize("name", CUT)
def test_the_caps_of_real_bones_are_found_and_nothing_else(name) -> None:
    """Exported from segmentations, they are rough and their rims are smoothed."""
    mesh = read_ply(DATA / f"{name}.ply")[0]
    sign = 1.0 if "femur" in name else -1.0
    depth = (sign * mesh.vertices_mm[:, 2]).max() - sign * mesh.vertices_mm[:, 2]
    found = on_flat_caps(mesh)
    assert found[depth < 0.05].all()
    assert depth[found].max() < 1.0


def test_slices_are_whole_up_to_the_lowest_point_of_an_oblique_cut() -> None:
    along = np.array([0.0, 10.0, 20.0, 30.0, 40.0])
    is_border = np.array([True, False, False, True, True])
    assert find_whole_until_mm(along, is_border, 5.0) == 30.0
    assert find_whole_until_mm(along, np.zeros(5, dtype=bool), 5.0) == 40.0
