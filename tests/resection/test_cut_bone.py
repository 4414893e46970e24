"""The states of a cut bone and their versions."""

import numpy as np

from navapp.resection import CutBone
from navapp.values import BoneModel, MeasuredFace, ResectionPlane
from tests.geometry.shapes import sphere

TOP = ResectionPlane("femur", np.array([0.0, 0.0, 8.0]), np.array([0.0, 0.0, 1.0]))
SIDE = ResectionPlane("femur", np.array([8.0, 0.0, 0.0]), np.array([1.0, 0.0, 0.0]))
LITTLE = np.diag([1e-6, 1e-6, 1e-3])
FACE = MeasuredFace(TOP, np.zeros(3), LITTLE, LITTLE, 0.8)


def whole() -> CutBone:
    return CutBone(BoneModel("femur", sphere(10.0)))


def test_every_new_state_is_a_new_version() -> None:
    bone = whole()
    assert bone.version == 0
    states = [bone.make("top", TOP), bone.make("top", TOP).make("side", SIDE)]
    assert [state.version for state in states] == [1, 2]
    assert states[1].with_faces({"top": FACE}).version == 3
    assert states[1].model.version == 2


def test_going_back_restores_the_version_and_going_on_takes_a_new_one() -> None:
    top = whole().make("top", TOP)
    measured = top.with_faces({"top": FACE})
    assert measured.without_faces().version == top.version
    back = measured.restore("top")
    assert back.version == 0
    assert back.surface is None
    assert not back.model.is_removed.any()
    assert back.make("side", SIDE).version == 3
    assert back.make("top", TOP).version == top.version


def test_states_are_the_same_in_any_order_of_cuts() -> None:
    both = whole().make("top", TOP).make("side", SIDE)
    side = both.restore("top")
    assert side.version == 3
    assert side.make("top", TOP).version == both.version
