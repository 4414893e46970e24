"""The scripted hand: it moves as a hand can, and keeps the tip where it says."""

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import ArrayLike

from navapp.geometry.transform import FloatArray, RigidTransform, rotation_from_vector
from sim_devices.sheet import PrintedSheet
from sim_devices.tool_hand import PivotingHand, ToolDeed, Touch, TouchingHand
from sim_devices.tool_shapes import ToolShape

HZ, SECOND = 60, 1_000_000_000
HOLE_MM = np.array([-20.0, 20.0, 460.0])
HELD = rotation_from_vector((0.0, 0.0, np.radians(-80.0)))
# As the session's tool is tilted from touch to touch.
TILTS_DEG = (
    (0.0, 0.0, 0.0), (20.0, 0.0, 8.0), (-12.0, 14.0, -10.0), (0.0, -22.0, 5.0), (8.0, 10.0, 16.0),
)  # fmt: skip


def shape_of(
    tip_mm: ArrayLike = (2.0, 78.0, 112.0), axis: ArrayLike = (0.0, 0.55, 0.835)
) -> ToolShape:
    direction = np.array(axis, dtype=np.float64) / np.linalg.norm(axis)
    paper = PrintedSheet(np.full((4, 4), 255, np.uint8), 1.0, -2.0, -2.0)
    return ToolShape((paper,), np.eye(4)[None], np.array(tip_mm), direction, 118.0, 3.0)


SHAPES = {"pointer": shape_of(), "drill": shape_of((-3.0, 70.0, 128.0), (0.01, 0.40, 0.9165))}


def sampled(
    pose_at: Callable[[int], RigidTransform], begin_s: float, end_s: float
) -> list[RigidTransform]:
    n = round((end_s - begin_s) * HZ)
    return [pose_at(round((begin_s + k / HZ) * SECOND)) for k in range(n)]


def fastest_mm_s(poses: list[RigidTransform]) -> float:
    middles = np.array([pose.translation_mm for pose in poses])
    return float(np.linalg.norm(np.diff(middles, axis=0), axis=1).max() * HZ)


@pytest.mark.parametrize("name", SHAPES)
def test_a_pivoting_plate_is_never_faster_than_a_hand(name: str) -> None:
    hand = PivotingHand(SHAPES[name], HOLE_MM, HELD, 4)
    poses = sampled(hand.left_from_tool, 0.0, 60.0)
    assert fastest_mm_s(poses) <= 100.0
    # It does move, and to all sides.
    middles = np.array([pose.translation_mm for pose in poses])
    assert np.ptp(middles, axis=0).min() > 30.0


@pytest.mark.parametrize("deed", ["pivot", "turn"])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_tip_stays_in_its_hole(deed: ToolDeed, seed: int) -> None:
    shape = SHAPES["drill"]
    hand = PivotingHand(shape, HOLE_MM, HELD, seed)
    hand.begin(deed)
    tips = np.array([pose.apply(shape.tip_mm) for pose in sampled(hand.left_from_tool, 0.0, 30.0)])
    off = np.linalg.norm(tips - HOLE_MM, axis=1)
    assert off.max() < 0.1
    # It slips a little.
    assert off.max() > 0.005


def axes_of(hand: PivotingHand, shape: ToolShape, begin_s: float) -> tuple[FloatArray, float]:
    """(n, 3) of the axis in the room during a turn, and how far (rad) it turns the tool."""
    poses = sampled(hand.left_from_tool, begin_s, begin_s + 8.0)
    axes = np.array([pose.rotate(shape.axis) for pose in poses])
    across = np.cross(shape.axis, (1.0, 0.0, 0.0))
    seen = np.array([pose.rotate(across / np.linalg.norm(across)) for pose in poses])
    angles = np.arccos(np.clip(seen @ seen.T, -1.0, 1.0))
    return axes, float(angles.max())


def test_every_turn_is_about_the_tools_axis_and_each_about_another_line() -> None:
    shape = SHAPES["drill"]
    hand = PivotingHand(shape, HOLE_MM, HELD, 3)
    means = []
    for number in range(3):
        sampled(hand.left_from_tool, 10.0 * number, 10.0 * number + 0.1)
        hand.begin("turn")
        axes, turned_rad = axes_of(hand, shape, 10.0 * number + 0.1)
        mean = axes.mean(axis=0) / np.linalg.norm(axes.mean(axis=0))
        # It wobbles by less than half a degree, and turns to and fro by more than a right angle.
        assert np.degrees(np.arccos(np.clip(axes @ mean, -1.0, 1.0))).max() < 0.6
        assert turned_rad > 0.5 * np.pi
        means.append(mean)
    for a, b in ((0, 1), (1, 2)):
        assert np.degrees(np.arccos(means[a] @ means[b])) > 5.0


def test_a_turning_plate_is_never_faster_than_a_hand() -> None:
    for shape in SHAPES.values():
        hand = PivotingHand(shape, HOLE_MM, HELD, 6)
        hand.begin("turn")
        assert fastest_mm_s(sampled(hand.left_from_tool, 0.0, 20.0)) <= 100.0


def test_the_same_time_is_the_same_pose() -> None:
    hand = PivotingHand(SHAPES["pointer"], HOLE_MM, HELD, 7)
    first = [pose.matrix for pose in sampled(hand.left_from_tool, 0.0, 3.0)]
    again = [pose.matrix for pose in sampled(hand.left_from_tool, 0.0, 3.0)]
    np.testing.assert_array_equal(first, again)


def touches_of(rng: np.random.Generator, n: int = 8) -> list[Touch]:
    """Places on a ball of a knee's size, from the side that the cameras see."""
    chosen: list[FloatArray] = []
    while len(chosen) < n:
        one = rng.normal(0.0, 1.0, 3) - [0.0, 0.0, 1.5]
        one /= np.linalg.norm(one)
        # Turned to the cameras, and apart, as the session's are.
        is_apart = all(np.linalg.norm(32.0 * (one - other)) > 12.0 for other in chosen)
        if one[2] < -0.55 and is_apart:
            chosen.append(one)
    return [Touch(32.0 * one, one) for one in chosen]


def still(time_ns: int) -> RigidTransform:
    return RigidTransform.from_parts("left", "femur", np.eye(3), (0.0, 10.0, 450.0))


def breathing(time_ns: int) -> RigidTransform:
    return still(0).move(
        (0.0, 2.0 * np.sin(1.5 * time_ns / SECOND), 0.0, 0.02 * np.sin(time_ns / SECOND), 0.0, 0.0),
        (0.0, 0.0, 450.0),
    )


def touching(
    seed: int, left_from_bone: Callable[[int], RigidTransform]
) -> tuple[TouchingHand, list[Touch]]:
    held = [rotation_from_vector(np.radians(tilt)) @ HELD for tilt in TILTS_DEG]
    touches = touches_of(np.random.default_rng(seed))
    return TouchingHand(SHAPES["drill"], touches, left_from_bone, held, seed), touches


@pytest.mark.parametrize("seed", [1, 2, 3, 4])
def test_a_touching_plate_is_never_faster_than_a_hand(seed: int) -> None:
    hand, _ = touching(seed, still)
    assert fastest_mm_s(sampled(hand.left_from_tool, 0.0, 40.0)) <= 100.0


@pytest.mark.parametrize("left_from_bone", [still, breathing])
def test_the_tip_rests_on_the_place_that_it_says_it_touches(
    left_from_bone: Callable[[int], RigidTransform],
) -> None:
    hand, touches = touching(5, left_from_bone)
    seen = set()
    for k in range(40 * HZ):
        time_ns = k * SECOND // HZ
        number = hand.touched(time_ns)
        if number is None:
            continue
        seen.add(number)
        tip = hand.left_from_tool(time_ns).apply(SHAPES["drill"].tip_mm)
        place = left_from_bone(time_ns).apply(touches[number].point_mm)
        np.testing.assert_allclose(tip, place, atol=1e-9)
    assert seen == set(range(8))


def test_on_its_way_the_tip_is_lifted_from_the_bone() -> None:
    hand, _ = touching(5, still)
    heights = []
    for k in range(40 * HZ):
        time_ns = k * SECOND // HZ
        if hand.touched(time_ns) is None:
            tip = (
                still(0).inverse().apply(hand.left_from_tool(time_ns).apply(SHAPES["drill"].tip_mm))
            )
            heights.append(np.linalg.norm(tip) - 32.0)
    assert max(heights) > 5.0


def test_places_are_touched_one_after_the_other_again_and_again() -> None:
    hand, _ = touching(6, still)
    order = [hand.touched(k * SECOND // HZ) for k in range(90 * HZ)]
    visits = [b for a, b in zip([None, *order], order, strict=False) if b is not None and a is None]
    assert visits[:10] == [0, 1, 2, 3, 4, 5, 6, 7, 0, 1]
    rests = sum(one == 0 for one in order[: 10 * HZ])
    assert rests / HZ == pytest.approx(1.6, abs=0.1)


def test_from_frame_to_frame_the_tool_does_not_jump() -> None:
    hand, _ = touching(7, still)
    poses = sampled(hand.left_from_tool, 0.0, 40.0)
    tips = np.array([pose.apply(SHAPES["drill"].tip_mm) for pose in poses])
    assert np.linalg.norm(np.diff(tips, axis=0), axis=1).max() < 2.5
