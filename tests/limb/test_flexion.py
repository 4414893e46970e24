"""The hinge of a knee: its axis, what it allows, and what it draws."""

import numpy as np
import pytest

from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.transform import RigidTransform, rotation_from_vector
from navapp.limb import Hinge, Poses
from tests.registration.shapes import femur


def hinge() -> Hinge:
    return Hinge.of(femur().mesh)


def bent(one: Hinge, flexion_deg: float, turn_deg=(0.0, 0.0, 0.0), shift_mm=(0.0, 0.0, 0.0)):
    rotation = rotation_from_vector(np.radians(flexion_deg) * one.axis)
    rotation = rotation @ rotation_from_vector(np.radians(turn_deg))
    shift = one.centre_mm - rotation @ one.centre_mm + shift_mm
    return Poses(rotation[None], shift[None])


def test_the_axis_runs_to_the_left_between_the_condyles() -> None:
    found, points_mm = hinge(), femur().mesh.vertices_mm
    assert found.axis[0] > 0.98
    assert points_mm[:, 0].min() < found.centre_mm[0] < points_mm[:, 0].max()
    # Behind the middle and above the lowest point, as a condyle's radius is.
    assert 12.0 < found.centre_mm[2] - points_mm[:, 2].min() < 32.0
    assert 12.0 < points_mm[:, 1].max() - found.centre_mm[1] < 32.0


def test_the_axis_turns_with_the_bone() -> None:
    mesh = femur().mesh
    turn = rotation_from_vector((0.0, 0.05, 0.15))
    turned = mesh.transform(RigidTransform.from_parts("femur", "femur", turn, (5.0, 0.0, 0.0)))
    assert Hinge.of(turned).axis @ (turn @ hinge().axis) > 0.999


@pytest.mark.parametrize("flexion_deg", [-4.0, 0.0, 45.0, 90.0, 128.0])
def test_any_flexion_with_some_play_is_allowed(flexion_deg) -> None:
    one = hinge()
    assert one.allows(bent(one, flexion_deg)).all()
    assert one.allows(bent(one, flexion_deg, (0.0, 4.0, 5.0), (4.0, 0.0, -6.0))).all()


@pytest.mark.parametrize(
    ("flexion_deg", "turn_deg", "shift_mm"),
    [
        (-12.0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
        (140.0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
        (60.0, (0.0, 12.0, 0.0), (0.0, 0.0, 0.0)),
        (60.0, (0.0, 0.0, 0.0), (0.0, 14.0, 0.0)),
    ],
)
def test_what_no_knee_does_is_not_allowed(flexion_deg, turn_deg, shift_mm) -> None:
    one = hinge()
    assert not one.allows(bent(one, flexion_deg, turn_deg, shift_mm)).any()


def test_what_is_drawn_is_allowed_and_reaches_every_flexion() -> None:
    one = hinge()
    drawn = one.draw(5000, np.random.default_rng(1))
    assert 3000 < len(drawn.rotations) <= 5000
    assert one.allows(drawn).all()
    flexion_deg = np.degrees(np.arctan2(drawn.rotations[:, 2, 1], drawn.rotations[:, 1, 1]))
    assert (np.histogram(flexion_deg, bins=13, range=(0.0, 130.0))[0] > 100).all()


def test_a_bone_without_condyles_has_no_hinge() -> None:
    mesh = femur().mesh
    front = mesh.faces[(mesh.vertices_mm[mesh.faces][:, :, 1] < -10.0).all(axis=1)]
    assert Hinge.of(TriangleMesh(mesh.vertices_mm * (1.0, 1e-3, 1.0), front)) is None
