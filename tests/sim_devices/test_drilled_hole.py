import numpy as np
import pytest

from navapp.geometry.mesh import TriangleMesh
from sim_devices.anatomy import KneeSpec, make_knee
from sim_devices.drilled_hole import (
    HOLE_DEPTH_MM,
    HOLE_RADIUS_MM,
    drill_hole,
    find_entry_point,
)
from sim_devices.tools import across

AXIS = np.array([0.0, np.sin(0.1), np.cos(0.1)])


@pytest.fixture(scope="module")
def femur():
    return make_knee(KneeSpec(1)).bones["femur"]


@pytest.fixture(scope="module")
def entry():
    knee = make_knee(KneeSpec(1))
    return find_entry_point(
        knee.bones["femur"], knee.landmarks["femur/notch"] + (0, -10.0, 0), AXIS
    )


def open_edges(*meshes):
    """Directed edges of positions without a partner in the other direction."""
    positions = np.concatenate([mesh.vertices_mm[mesh.faces].reshape(-1, 3) for mesh in meshes])
    _, index = np.unique(np.round(positions, 6), axis=0, return_inverse=True)
    corners = index.reshape(-1, 3)
    edges = {(a, b) for face in corners for a, b in zip(face, np.roll(face, -1), strict=True)}
    return [edge for edge in edges if edge[::-1] not in edges]


@pytest.mark.release
def test_the_drilled_bone_and_its_hole_are_one_closed_surface(femur, entry):
    bone, wall, _ = drill_hole(femur, entry, AXIS)
    assert open_edges(femur) == []
    assert len(open_edges(bone)) > 20
    assert open_edges(bone, wall) == []


def test_the_hole_takes_away_a_cylinder(femur, entry):
    bone, wall, _ = drill_hole(femur, entry, AXIS)
    faces = np.concatenate([bone.faces, wall.faces + np.int32(len(bone.vertices_mm))])
    both = TriangleMesh(np.concatenate([bone.vertices_mm, wall.vertices_mm]), faces)
    removed = femur.volume_mm3() - both.volume_mm3()
    cylinder = np.pi * HOLE_RADIUS_MM**2 * HOLE_DEPTH_MM
    assert removed == pytest.approx(cylinder, rel=0.25)
    assert 8.0 <= 2.0 * HOLE_RADIUS_MM <= 10.0


def test_the_rest_of_the_surface_is_untouched(femur, entry):
    bone, wall, depth = drill_hole(femur, entry, AXIS)
    np.testing.assert_array_equal(bone.vertices_mm[: len(femur.vertices_mm)], femur.vertices_mm)
    u, v = across(AXIS)
    offset = bone.vertices_mm - entry
    radius = np.hypot(offset @ u, offset @ v)
    near = np.abs(offset @ AXIS) < 15.0
    used = np.zeros(len(bone.vertices_mm), dtype=bool)
    used[bone.faces] = True
    assert (radius[used & near] > HOLE_RADIUS_MM - 1e-4).all()
    wall_offset = wall.vertices_mm[:-1] - entry
    wall_radius = np.hypot(wall_offset @ u, wall_offset @ v)
    assert wall_radius.max() < HOLE_RADIUS_MM + 1e-4
    assert depth.min() == 0.0


def test_the_wall_faces_the_axis(femur, entry):
    _, wall, _ = drill_hole(femur, entry, AXIS)
    corners = wall.vertices_mm[wall.faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    inwards = np.einsum("ij,ij->i", normal, wall.normals[wall.faces].mean(axis=1))
    assert (inwards[np.linalg.norm(normal, axis=1) > 1e-6] > 0.0).mean() > 0.98


def test_a_line_beside_the_bone_has_no_entry_point(femur):
    with pytest.raises(ValueError, match="misses"):
        find_entry_point(femur, np.array([500.0, 0.0, 0.0]), AXIS)
