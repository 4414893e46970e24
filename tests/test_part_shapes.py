"""Surfaces of planned parts."""

import numpy as np
import pytest

from navapp.geometry.simplify import is_closed
from navapp.geometry.transform import RigidTransform, rotation_from_vector
from navapp.values import Box, Cylinder, Part, Sphere
from navapp.values.part_shapes import part_mesh
from tests.geometry.shapes import cube

HERE = RigidTransform.from_parts(
    "femur", "implant", rotation_from_vector((0.4, -0.7, 0.2)), (5.0, -6.0, 7.0)
)


@pytest.mark.parametrize(
    ("shape", "volume_mm3", "size_mm"),
    [
        (Box((10.0, 20.0, 4.0)), 800.0, (10.0, 20.0, 4.0)),
        (Cylinder(12.0, 9.0), np.pi * 36.0 * 9.0, (12.0, 12.0, 9.0)),
        (Sphere(16.0), np.pi * 16.0**3 / 6.0, (16.0, 16.0, 16.0)),
        (cube(6.0), 216.0, (6.0, 6.0, 6.0)),
    ],
)
def test_a_part_has_its_size_and_place(shape, volume_mm3: float, size_mm) -> None:
    mesh = part_mesh(Part("implant", shape, HERE))
    assert mesh.volume_mm3() == pytest.approx(volume_mm3, rel=0.03)
    own = HERE.inverse().apply(mesh.vertices_mm)
    np.testing.assert_allclose(own.max(axis=0), 0.5 * np.array(size_mm), rtol=0.01)
    np.testing.assert_allclose(own.min(axis=0), -0.5 * np.array(size_mm), rtol=0.01)


def test_a_box_is_closed() -> None:
    assert is_closed(part_mesh(Part("implant", Box((10.0, 20.0, 4.0)), HERE)))


@pytest.mark.parametrize("shape", [Box((10.0, 20.0, 4.0)), Cylinder(12.0, 9.0), Sphere(16.0)])
def test_normals_look_outwards(shape) -> None:
    mesh = part_mesh(Part("implant", shape, HERE))
    outward = mesh.vertices_mm - HERE.apply(np.zeros(3))
    assert (np.einsum("vk,vk->v", outward, mesh.normals) > -1e-9).all()
