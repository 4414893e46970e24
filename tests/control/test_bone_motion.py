"""How far a bone moves in the picture while one camera waits for the other."""

import math
from dataclasses import replace

import numpy as np
import pytest

from drivers.frames import StereoFrame
from navapp.control.bone_motion import BoneMotion
from navapp.geometry.transform import RigidTransform
from navapp.values import TrackedFrame
from tests.control.fakes import a_plan, a_pose, a_rig, answer

MS = 1_000_000
PX_PER_MM = 200.0 / 300.0


def frame(time_ms: float, skew_ms: float = 0.0) -> StereoFrame:
    picture = np.zeros((4, 4), np.uint8)
    return StereoFrame(picture, picture, round(time_ms * MS), 0, round(skew_ms * MS), 0, "rig")


def at(x_mm: float, y_mm: float, bone: str = "femur") -> TrackedFrame:
    pose = a_pose(bone)
    place_mm = pose.translation_mm + np.array([x_mm, y_mm, 0.0])
    return answer(pose=RigidTransform.from_parts("left", bone, pose.rotation, place_mm))


@pytest.fixture
def motion() -> BoneMotion:
    motion = BoneMotion(a_rig(), a_plan())
    motion.row_px(frame(0), at(0.0, 0.0))
    return motion


@pytest.mark.parametrize("skew_ms", [5.0, -5.0])
def test_a_known_skew_costs_its_share_of_the_way(motion: BoneMotion, skew_ms: float) -> None:
    # 2 mm in 100 ms: 0.1 mm in 5 ms; the mesh's edge is nearer to the camera by some mm at most.
    found_px = motion.row_px(frame(100, skew_ms), at(0.0, 2.0))
    assert found_px == pytest.approx(0.1 * PX_PER_MM, rel=0.1)


def test_an_unknown_one_may_cost_half_of_it(motion: BoneMotion) -> None:
    assert motion.row_px(frame(100), at(0.0, 2.0)) == pytest.approx(1.0 * PX_PER_MM, rel=0.1)


def test_sideways_costs_no_rows(motion: BoneMotion) -> None:
    assert motion.row_px(frame(100), at(2.0, 0.0)) == pytest.approx(0.0, abs=1e-9)


def test_a_bone_that_turns_moves_at_its_ends(motion: BoneMotion) -> None:
    turned = answer(pose=a_pose().move(np.array([0, 0, 0, 0.0, 0.0, 0.05]), np.zeros(3)))
    assert motion.row_px(frame(100), turned) > 0.3


def test_what_is_not_known_is_said(motion: BoneMotion) -> None:
    assert math.isinf(motion.row_px(frame(100), at(0.0, 0.0, "tibia")))
    assert math.isinf(motion.row_px(frame(200), None))
    assert math.isinf(motion.row_px(frame(300), at(0.0, 0.0)))
    assert math.isfinite(motion.row_px(frame(400), at(0.0, 0.0)))
    assert math.isinf(motion.row_px(frame(400), at(0.0, 0.0)))
    assert math.isinf(motion.row_px(frame(9000), at(0.0, 0.0)))
    gone = replace(at(0.0, 0.0), estimate=None)
    assert math.isinf(motion.row_px(frame(9100), gone))
    beside = motion.row_px(frame(9200), at(5000.0, 0.0)), motion.row_px(frame(9300), at(5e3, 0.0))
    assert all(map(math.isinf, beside))
