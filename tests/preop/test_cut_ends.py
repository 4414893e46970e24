import os
from pathlib import Path

import numpy as np
import pytest

from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.ply import read_ply
from navapp.preop.cut_ends import anatomy_of, ends_of, on_flat_caps, on_open_borders, whole_until_mm
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


def test_an_open_border_is_where_a_triangle_has_no_neighbour() -> None:
    assert not on_open_borders(BALL).any()
    opened = TriangleMesh(BALL.vertices_mm, BALL.faces[1:])
    assert set(np.flatnonzero(on_open_borders(opened))) == set(BALL.faces[0].tolist())


def test_anatomy_is_what_is_neither_cap_nor_cut_away() -> None:
    cut, _ = cut_ball(TILTED)
    low = cut.vertices_mm[:, 2] < -15.0
    bone = BoneModel("femur", cut, is_removed=low)
    own = anatomy_of(bone)
    kept = {tuple(vertex) for vertex in own.vertices_mm}
    assert kept <= {tuple(vertex) for vertex in cut.vertices_mm[~low & ~on_flat_caps(cut)]}
    assert len(kept) > 0.95 * (~(low | on_flat_caps(cut))).sum()
    np.testing.assert_allclose(np.linalg.norm(own.normals, axis=1), 1.0)
    # Open in both places, and there only.
    border = own.vertices_mm[on_open_borders(own)]
    assert {"cap", "cut"} == {"cap" if point @ TILTED > 15.0 else "cut" for point in border}
    assert ((border @ TILTED > 15.0) | (border[:, 2] < -10.0)).all()
    assert (ends_of(bone) == (low | on_flat_caps(cut))).all()


def test_nothing_of_a_box_is_anatomy() -> None:
    """Of its sides, which are no caps, only triangles with a corner on a cap."""
    assert len(anatomy_of(BoneModel("femur", cube(20.0))).faces) == 0


@pytest.mark.parametrize("points", [np.empty((0, 3)), np.eye(3), np.zeros((9, 3))])
def test_what_is_hardly_a_surface_has_no_caps(points) -> None:
    faces = np.arange(len(points), dtype=np.int32).reshape(-1, 3)
    assert not on_flat_caps(TriangleMesh(points, faces)).any()


def test_the_joints_surfaces_of_simulated_bones_are_no_caps() -> None:
    """Some of their patellae have facets as flat as a cut."""
    for knee in knees():
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
    assert whole_until_mm(along, is_border, 5.0) == 30.0
    assert whole_until_mm(along, np.zeros(5, dtype=bool), 5.0) == 40.0
