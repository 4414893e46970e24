"""Sessions in the simulated room whose right camera is bumped into."""

import math
from contextlib import ExitStack

import numpy as np
import pytest

from calibration.rig.known_length import LengthMeter
from calibration.targets.boards import parse_board
from navapp.control.board_watch import BoardWatch
from navapp.control.commands import Accept, Register
from navapp.control.executors import InlineExecutor
from navapp.control.length_check import Finding
from navapp.control.states import EventLevel
from navapp.geometry.transform import RigidTransform, rotation_from_vector
from navapp.values import Reason, Status
from sim_devices.faults import Fault, FaultKind, FaultScript
from sim_devices.rigs import make_default_rig
from sim_devices.sheet import SheetInView
from tests.control.test_simulated_session import SimulatedRoom
from tests.sim_devices.test_sheet import sheet_of

BOARD = parse_board(
    {
        "type": "charuco", "squares_x": 9, "squares_y": 6, "square_mm": 10.0,
        "marker_mm": 7.5, "dictionary": "DICT_4X4_100",
    }
)  # fmt: skip
S = 1_000_000_000
# 0.4 mm at 450 mm.
WORST = 0.4 / 450.0
THIRD_OF_A_PIXEL_DEG = math.degrees(0.3 / make_default_rig().right.focal_px)


def bumped(turn_deg: tuple[float, float, float], start_s: float, lasts_s: float = math.inf):
    return FaultScript((Fault(FaultKind.TURN, start_s, lasts_s, turn_deg=turn_deg),))


def navigating(room: SimulatedRoom) -> SimulatedRoom:
    room.frames(1)
    room.controller.submit(Register())
    room.frames(2)
    room.controller.submit(Accept(None))
    room.frames(2)
    assert room.state == "navigating"
    return room


def until_s(room: SimulatedRoom, seconds: float) -> None:
    while room.state != "fault" and room.clock.now_ns() < seconds * S:
        room.frames(1)


@pytest.mark.release
@pytest.mark.slow
def test_a_camera_turned_up_by_two_hundredths_of_a_degree_ends_the_trust(undo: ExitStack) -> None:
    room = navigating(
        SimulatedRoom(undo, faults=bumped((-0.02, 0.0, 0.0), 2.5), rate_hz=3.0, scale=0.7)
    )
    until_s(room, 12.0)
    assert room.state == "fault"
    assert room.clock.now_ns() < 8.5 * S
    assert not room.display.visible_image().any()
    alarm = room.controller.snapshot.rig_alarm
    assert alarm.startswith("rig moved, recalibrate (the right picture shows everything 0.")
    assert alarm.endswith(" px too low)")
    # Before the alarm there was none that could have been believed.
    after = [r for r in room.results if r.frame.captured_ns >= 2.5 * S]
    assert len(after) >= 10
    assert not any(result.is_navigable for result in after)


@pytest.mark.release
def test_a_camera_that_swings_back_is_believed_again(undo: ExitStack) -> None:
    room = navigating(SimulatedRoom(undo, faults=bumped((-0.02, 0.0, 0.0), 2.5, 1.5), rate_hz=3.0))
    until_s(room, 6.0)
    disturbed = [r for r in room.results if 2.5 * S <= r.frame.captured_ns < 4.0 * S]
    assert all(Reason.ROWS_DISAGREE in r.tracked.verdict.reasons for r in disturbed)
    assert disturbed
    assert room.state == "navigating"
    assert room.controller.snapshot.is_navigable


def with_board(undo: ExitStack, faults: FaultScript) -> SimulatedRoom:
    """A board held beside the bone, which stays in view."""
    rotation = rotation_from_vector((0.15, 0.2, 0.05))
    place_mm = np.array([-110.0, -60.0, 420.0]) - rotation @ BOARD.points_mm.mean(axis=0)
    pose = RigidTransform.from_parts("left", "board", rotation, place_mm)
    sheet = sheet_of(BOARD)
    watch = BoardWatch(LengthMeter(BOARD, make_default_rig()), WORST, InlineExecutor(), lambda: 0)
    return SimulatedRoom(
        undo, faults=faults, rate_hz=1.0, board_watch=watch,
        seen=lambda world: SheetInView(world, sheet, lambda time_ns: pose, (0, 60 * S)),
    )  # fmt: skip


@pytest.mark.release
def test_a_third_of_a_pixel_sideways_is_found_on_the_board(undo: ExitStack) -> None:
    turn_deg = (0.0, -THIRD_OF_A_PIXEL_DEG, 0.0)
    room = navigating(with_board(undo, bumped(turn_deg, 8.0)))
    until_s(room, 8.0)
    assert room.controller.snapshot.is_navigable
    told = [event for event in room.controller.snapshot.events if event.kind == "rig"]
    assert [event.level for event in told] == [EventLevel.INFO]
    before = room.controller.snapshot.length_check
    assert before.finding is Finding.WITHIN
    assert before.ratio == pytest.approx(1.0, abs=2e-4)
    until_s(room, 25.0)
    assert room.state == "fault"
    assert not room.display.visible_image().any()
    assert "100 mm on the board are measured as" in room.controller.snapshot.rig_alarm
    found = room.controller.snapshot.length_check
    assert found.ratio - 1.0 == pytest.approx(-0.0013, abs=3e-4)
    # Nothing else has noticed: the rows agree, and the pose is called good.
    unnoticed = [r for r in room.results if r.state.value == "navigating"][-3:]
    assert all(r.tracked.verdict.status is Status.OK for r in unnoticed)
    assert all(r.frame.captured_ns > 8.0 * S for r in unnoticed)


# For longer than before the turn of the test above.
@pytest.mark.release
def test_a_rig_that_has_not_moved_stays_believed(undo: ExitStack) -> None:
    room = navigating(with_board(undo, FaultScript()))
    until_s(room, 12.0)
    assert room.controller.snapshot.is_navigable
    assert room.controller.snapshot.length_check.finding is Finding.WITHIN
