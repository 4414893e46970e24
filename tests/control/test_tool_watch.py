"""Tools in a session on fakes: when they are looked for, and what is said of them."""

import dataclasses

import numpy as np
import pytest

from navapp.control.commands import EnterStage
from navapp.control.interlocks import grow_older, is_tool_current
from navapp.control.recorder import reading_to_json
from navapp.control.states import ToolLine
from navapp.values import DrillAxis, Status, SurgicalContent
from tests.control.fakes import Bench, a_plan, a_pose, answer, navigating
from tests.control.held_pointer import POINTER, HeldPointer

ENTRY = DrillAxis("femur", np.zeros(3), np.array([0.0, 0.0, 1.0]), 30.0, 8.0)
PLAN = dataclasses.replace(
    a_plan(),
    targets={"femur/notch": np.array([[0.0, 0.0, 0.0]]), "femur/edge": np.array([[30.0, 0, 9.0]])},
    content=SurgicalContent(drills={"canal": ENTRY}),
    digest="",
)


@pytest.fixture
def held(monkeypatch: pytest.MonkeyPatch) -> HeldPointer:
    return HeldPointer(monkeypatch)


@pytest.fixture
def bench(held: HeldPointer) -> Bench:
    return navigating(Bench(plan=PLAN, tools={"pointer": POINTER}))


def pointer(bench: Bench) -> ToolLine:
    (line,) = bench.frames(1).tools
    return line


def test_without_tools_nothing_is_looked_for(held: HeldPointer) -> None:
    assert navigating(Bench()).frames(3).tools == ()
    assert held.n_looks == 0


def test_a_tool_that_is_not_seen_is_looked_for_now_and_then(
    bench: Bench, held: HeldPointer
) -> None:
    held.n_looks = 0
    bench.frames(10)
    assert held.n_looks == 2
    assert pointer(bench).missing == "no marker is seen by both cameras"
    held.tip_mm = np.array([0.0, 0.0, 300.0])
    bench.frames(5)
    held.n_looks = 0
    bench.frames(10)
    assert held.n_looks == 10


def test_the_tip_is_told_in_the_bones_coordinates(bench: Bench, held: HeldPointer) -> None:
    held.tip_mm = np.array([1.0, 2.0, 299.0])
    bench.frames(5)
    reading = pointer(bench).reading
    assert reading is not None
    assert reading.placed is not None
    np.testing.assert_allclose(reading.placed.tip_mm, [1.0, 2.0, -1.0], atol=1e-9)
    # 0.1 mm of the bone in every direction, 1e-4 mm^2 of tip and plate, turns of both.
    assert 0.28 < reading.placed.bound_mm < 0.5
    # The bowl's ground lies at 0.05 mm there, its triangles up to 0.2 mm above.
    assert abs(reading.surface_mm) == pytest.approx(1.15, abs=0.11)
    name, away_mm = reading.nearest
    assert name == "femur/notch"
    assert away_mm == pytest.approx(6.0**0.5)


def test_a_hole_is_told_in_stages_that_show_holes(bench: Bench, held: HeldPointer) -> None:
    held.tip_mm = np.array([3.0, 4.0, 310.0])
    bench.frames(5)
    assert pointer(bench).reading.hole is None
    bench.do(EnterStage(2))
    hole = pointer(bench).reading.hole
    assert hole.name == "canal"
    assert hole.off_mm == pytest.approx(5.0)
    assert hole.depth_mm == pytest.approx(10.0)
    assert hole.angle_deg is None  # nobody has turned the pointer about itself


def test_no_place_on_a_bone_that_is_not_ok(bench: Bench, held: HeldPointer) -> None:
    held.tip_mm = np.array([0.0, 0.0, 300.0])
    bench.script.tracked = answer(Status.DEGRADED)
    bench.frames(5)
    reading = pointer(bench).reading
    assert reading.placed is None
    assert "tip_mm" not in reading_to_json(reading)
    assert reading_to_json(reading)["tip_left_mm"] == [0.0, 0.0, 300.0]


def test_no_place_on_a_bone_that_nobody_has_accepted(held: HeldPointer) -> None:
    bench = Bench(plan=PLAN, tools={"pointer": POINTER})
    held.tip_mm = np.array([0.0, 0.0, 300.0])
    (line,) = bench.frames(6).tools
    assert line.reading.placed is None


def test_a_reading_grows_old(bench: Bench, held: HeldPointer) -> None:
    held.tip_mm = np.array([0.0, 0.0, 300.0])
    snapshot = bench.frames(6)
    assert is_tool_current(snapshot.tools[0])
    later = grow_older(snapshot, snapshot.time_ns + 600_000_000)
    assert not is_tool_current(later.tools[0])


def test_the_bones_pose_moves_the_tip(bench: Bench, held: HeldPointer) -> None:
    held.tip_mm = np.array([0.0, 0.0, 300.0])
    bench.script.tracked = answer(pose=a_pose(x_mm=2.0))
    bench.frames(5)
    np.testing.assert_allclose(pointer(bench).reading.placed.tip_mm, [-2.0, 0, 0], atol=1e-9)
