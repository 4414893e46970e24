"""The states of a cut bone and their versions."""

from dataclasses import replace

import numpy as np
import pytest

from navapp.geometry.transform import RigidTransform
from navapp.resection import CutBone
from navapp.resection.cut_bone import UNSURE_MM
from navapp.values import (
    BoneModel,
    Box,
    DrillAxis,
    MeasuredFace,
    Part,
    ResectionPlane,
)
from tests.geometry.shapes import sphere

TOP = ResectionPlane("femur", np.array([0.0, 0.0, 8.0]), np.array([0.0, 0.0, 1.0]))
SIDE = ResectionPlane("femur", np.array([8.0, 0.0, 0.0]), np.array([1.0, 0.0, 0.0]))
LITTLE = np.diag([2e-6, 2e-6, 2e-3])
FACE = MeasuredFace(TOP, np.zeros(3), LITTLE, 0.8)


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


def test_the_mouth_of_a_hole_is_whole_until_a_cut_comes_near_it() -> None:
    top = DrillAxis("femur", np.array([0.0, 0.0, 10.0]), np.array([0.0, 0.0, -1.0]), 5.0, 2.0)
    bottom = replace(top, entry_mm=-top.entry_mm, direction=-top.direction)
    bone = whole().make("a", top).make("b", bottom)
    assert bone.whole_holes == ("a", "b")
    assert bone.make("top", TOP).whole_holes == ("b",)


def test_a_hole_and_a_part_take_bone_away_and_cover_it() -> None:
    hole = DrillAxis("femur", np.array([0.0, 0.0, 10.0]), np.array([0.0, 0.0, -1.0]), 5.0, 4.0)
    bored = whole().make("a", hole).model
    beside_mm = np.hypot(*bored.mesh.vertices_mm[:, :2].T)
    on_top = bored.mesh.vertices_mm[:, 2] > 3.5
    np.testing.assert_array_equal(bored.is_removed, on_top & (beside_mm < 2.0 + UNSURE_MM))
    assert bored.lid is not None
    here = RigidTransform.from_parts("femur", "cap", np.eye(3), (0.0, 0.0, 10.0))
    capped = whole().make("cap", Part("implant", Box((8.0, 8.0, 2.0)), here))
    assert not capped.model.is_removed.any()
    assert capped.model.lid.vertices_mm[:, 2].max() == pytest.approx(11.0)
    assert capped.restore("cap").model.lid is None
