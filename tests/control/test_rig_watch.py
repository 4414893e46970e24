"""A rig that moved ends all trust; what passes does not."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from navapp.control.board_watch import BoardWatch
from navapp.control.commands import (
    Accept,
    DistrustRig,
    EnterStage,
    Interrupt,
    Propose,
    Reconnect,
    Register,
    Show,
)
from navapp.control.event_log import SessionHooks
from navapp.control.executors import InlineExecutor
from navapp.control.rig_watch import RowWatch
from navapp.control.states import DeviceHealth, EventLevel
from navapp.errors import DeviceLost, RigError
from navapp.geometry.transform import RigidTransform
from navapp.values import Reason, RowCheck
from tests.control.fakes import DOUBTED, PERIOD_NS, Bench, a_pose, answer, navigating
from tests.control.test_length_check import Look

S = 1_000_000_000
GOOD, LOW, HIGH = RowCheck(0.02, False), RowCheck(0.6, True), RowCheck(-0.6, True)
WORST = 0.0009


def said(
    rows: Callable[[float], RowCheck | None],
    seconds: float,
    rate_hz: float = 15.0,
    motion_px: float = 0.0,
) -> str:
    """What is wrong, after so long; empty: nothing."""
    watch = RowWatch()
    for k in range(round(seconds * rate_hz)):
        if why := watch.add(rows(k / rate_hz), round(k / rate_hz * S), motion_px):
            return why
    return ""


@pytest.mark.parametrize("rate_hz", [3.0, 15.0, 60.0])
def test_rows_that_stay_off_are_a_rig_that_moved(rate_hz: float) -> None:
    assert said(lambda s: GOOD, 60.0, rate_hz) == ""
    assert "0.60 px too low" in said(lambda s: LOW, 8.0, rate_hz)
    assert "0.60 px too high" in said(lambda s: HIGH, 8.0, rate_hz)
    assert said(lambda s: LOW, 3.5, rate_hz) == ""


def test_a_good_pair_in_between_does_not_hide_it() -> None:
    assert said(lambda s: GOOD if 2.0 <= s < 2.1 else LOW, 8.0)
    assert said(lambda s: None if s % 2.0 < 1.0 else LOW, 12.0)


@pytest.mark.parametrize(
    "rows",
    [
        lambda s: LOW if 5.0 < s < 8.5 else GOOD,
        lambda s: LOW if s % 4.0 < 2.0 else HIGH,
        lambda s: LOW if s % 4.0 < 2.0 else GOOD,
        lambda s: LOW if s % 10.0 < 2.0 else None,
        lambda s: RowCheck(0.29, False),
        lambda s: None,
    ],
    ids=["passes", "breathes", "comes and goes", "seldom told", "within", "untold"],
)
def test_what_passes_is_no_alarm(rows: Callable[[float], RowCheck | None]) -> None:
    assert said(rows, 60.0) == ""


@pytest.mark.parametrize("motion_px", [0.31, 0.6, 5.0, math.inf])
def test_rows_that_a_moving_leg_explains_are_no_alarm(motion_px: float) -> None:
    for rows in (LOW, HIGH):
        assert said(lambda s, rows=rows: rows, 60.0, motion_px=motion_px) == ""


def test_rows_that_it_does_not_explain_are_one_all_the_same() -> None:
    assert "0.60 px too low" in said(lambda s: LOW, 8.0, motion_px=0.2)


def test_a_leg_that_is_carried_steadily_never_alarms_and_once_it_rests_does(bench: Bench) -> None:
    """10 mm/s, paired with pictures of unknown times."""
    navigating(bench)
    y_mm = 0.0
    for k in range(300):
        y_mm += 0.66 if k < 200 else 0.0
        pose = RigidTransform.from_parts("left", "femur", np.eye(3), (0.0, y_mm % 100, 300.0))
        offset_px = 0.22 if k < 200 else 0.6
        bench.script.tracked = replace(answer(pose=pose), rows=RowCheck(offset_px, True))
        bench.frames(1)
        if k < 200:
            assert bench.state == "navigating"
    assert bench.state == "fault"


def with_rows(rows: RowCheck | None):
    return replace(DOUBTED if rows and rows.is_off else answer(), rows=rows)


def after_rows(bench: Bench, rows: RowCheck | None, seconds: float) -> Bench:
    bench.script.tracked = with_rows(rows)
    bench.frames(round(seconds * S / PERIOD_NS))
    return bench


@pytest.fixture
def moved(bench: Bench) -> Bench:
    return after_rows(navigating(bench), LOW, 6.0)


def test_a_moved_rig_is_said_in_words_rings_and_is_dark(moved: Bench) -> None:
    snapshot = moved.snapshot
    assert snapshot.state.value == "fault"
    assert snapshot.reasons[0] is Reason.RIG_MOVED
    assert moved.is_dark
    alarm = moved.events[-1]
    assert alarm.level is EventLevel.ALARM
    assert alarm.text.startswith("rig moved, recalibrate (the right picture shows everything 0.60")
    assert snapshot.rig_alarm == alarm.text
    (line,) = [line for line in snapshot.devices if line.kind == "rig"]
    assert line.health is DeviceHealth.TROUBLE
    assert "rig moved, recalibrate" in line.detail
    assert isinstance(moved.controller.failure, RigError)
    assert moved.controller.failure.remedy == Reason.RIG_MOVED.remedy


def test_what_the_rows_have_found_is_told_to_a_recording() -> None:
    told = []
    hooks = SessionHooks(on_command=(lambda command, sequence: told.append((command, sequence)),))
    bench = after_rows(navigating(Bench(hooks=hooks)), LOW, 6.0)
    (found,) = [one for one in told if isinstance(one[0], DistrustRig)]
    first = next(result for result in bench.results if result.state.value == "fault")
    assert found == (
        DistrustRig("the right picture shows everything 0.60 px too low"),
        first.frame.sequence,
    )


def test_no_good_frame_and_no_command_brings_it_back(moved: Bench) -> None:
    after_rows(moved, GOOD, 30.0)
    assert moved.state == "fault"
    for command in (
        Register(), Accept(None), Propose(a_pose()), Show(), EnterStage(5), EnterStage(1),
        Reconnect(), Interrupt(), DistrustRig("again"),
    ):  # fmt: skip
        moved.do(command)
        moved.frames(2)
        assert moved.state == "fault"
        assert moved.is_dark
        assert not moved.snapshot.is_navigable
        assert not moved.snapshot.is_candidate
    refused = " ".join(event.text for event in moved.events if event.kind == "refused")
    assert "rig moved, recalibrate" in refused
    assert "no candidate" in refused
    assert sum(event.level is EventLevel.ALARM for event in moved.events) == 1


def test_a_camera_that_comes_back_does_not_bring_it_back(moved: Bench) -> None:
    moved.camera.error = DeviceLost("unplugged")
    moved.frames(2)
    moved.camera.error = None
    moved.frames(30)
    assert moved.controller.lost_device is None
    assert moved.state == "fault"
    assert moved.snapshot.reasons[0] is Reason.RIG_MOVED
    assert moved.is_dark


def test_rows_that_are_off_for_a_moment_only_hide_the_guides(bench: Bench) -> None:
    after_rows(navigating(bench), LOW, 3.0)
    assert bench.state == "navigating"
    assert not bench.shows_guides
    after_rows(bench, GOOD, 6.0)
    assert bench.shows_guides
    assert bench.snapshot.rig_alarm == ""
    assert not any(event.level is EventLevel.ALARM for event in bench.events)


def board_bench(looks: Callable[[], Look | None], **options) -> Bench:
    return Bench(
        board_watch=BoardWatch(lambda left, right: looks(), WORST, InlineExecutor(), lambda: 0),
        **options,
    )


def test_a_board_that_is_measured_right_is_an_event_and_a_line_with_its_age() -> None:
    bench = board_bench(lambda: Look(1.0002))
    bench.frames(1)
    (line,) = [line for line in bench.snapshot.devices if line.kind == "rig"]
    assert line.detail == "not checked: show the board"
    assert line.health is DeviceHealth.UNKNOWN
    after_rows(navigating(bench), GOOD, 8.0)
    told = [event for event in bench.events if event.kind == "rig"]
    assert [event.level for event in told] == [EventLevel.INFO]
    assert told[0].text == "rig checked: 100 mm on the board are measured as 100.02 +- 0.00 mm"
    (line,) = [line for line in bench.snapshot.devices if line.kind == "rig"]
    assert line.health is DeviceHealth.OK
    assert line.detail.endswith("s ago")
    assert bench.shows_guides


def test_a_board_that_is_measured_wrong_ends_the_trust() -> None:
    told = []
    hooks = SessionHooks(on_command=(lambda command, sequence: told.append((command, sequence)),))
    length = [Look(1.0)]
    bench = after_rows(navigating(board_bench(lambda: length[0], hooks=hooks)), GOOD, 8.0)
    assert bench.shows_guides
    length[0] = None
    bench.frames(200)
    length[0] = Look(0.9985)
    bench.frames(240)
    assert bench.state == "fault"
    assert bench.is_dark
    assert bench.snapshot.reasons[0] is Reason.RIG_MOVED
    assert "100 mm on the board are measured as 99.85 +- 0.00 mm" in bench.snapshot.rig_alarm
    (command,) = [one for one, _ in told if isinstance(one, DistrustRig)]
    length[0] = Look(1.0)
    bench.frames(300)
    assert bench.state == "fault"
    # The same command after the same frame does the same to a replay.
    sequence = next(number for one, number in told if one is command)
    first = next(result for result in bench.results if result.state.value == "fault")
    assert first.frame.sequence == sequence + 1


def test_a_board_that_cannot_be_measured_well_is_a_warning() -> None:
    ratios = iter([1.0007, 1.0009] * 100)
    bench = board_bench(lambda: Look(next(ratios)))
    bench.frames(120)
    (event,) = [event for event in bench.events if event.kind == "rig"]
    assert event.level is EventLevel.WARNING
    assert bench.state == "ready"
