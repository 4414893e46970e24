import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from navapp.control.stages import STAGES
from navapp.control.states import (
    DeviceHealth,
    DeviceLine,
    Event,
    EventLevel,
    OtherBone,
    SessionState,
    Snapshot,
    StepLine,
)
from navapp.ui.devices_panel import DevicesPanel
from navapp.ui.event_list import format_event_line
from navapp.ui.footer import KeyFooter
from navapp.ui.pose_panel import PosePanel, format_reason_lines
from navapp.ui.stepper import StageStepper
from navapp.ui.symbols import ASCII, UNICODE, Symbols
from navapp.ui.text_view import TextView
from navapp.ui.title_line import TitleLine
from navapp.ui.view import Level, View
from navapp.values import MeasuredFace, Reason, ResectionPlane, Status, Verdict
from tests.ui import snapshots

# Room of the panels at 80 x 24.
WIDTH, POSE_LINES, DEVICE_LINES = 25, 9, 2


def view_of(snapshot: Snapshot, symbols: Symbols = UNICODE, *, is_silent: bool = False) -> View:
    return View(snapshot, symbols, snapshots.START_NS, is_silent)


def lines_of(widget: TextView, view: View, width: int, height: int) -> list[str]:
    return [line.plain for line in widget.build(view, width, height)]


@pytest.mark.parametrize("reason", list(Reason))
def test_every_reason_with_its_remedy_fits_the_small_panel(reason: Reason) -> None:
    assert reason.value
    assert reason.remedy
    view = view_of(snapshots.suspended(reasons=(reason,)))
    assert len(format_reason_lines(view, WIDTH)) <= POSE_LINES - 3
    text = " ".join(line.plain for line in format_reason_lines(view, WIDTH))
    # What is too slow is told with figures.
    assert view.reason[0] in text
    assert reason.remedy in text


def test_the_pose_panel_says_yes_only_when_navigable() -> None:
    first = lines_of(PosePanel(), view_of(snapshots.navigating()), WIDTH, POSE_LINES)[0]
    assert "NAVIGABLE  yes" in first
    first = lines_of(PosePanel(), view_of(snapshots.suspended()), WIDTH, POSE_LINES)[0]
    assert "NAVIGABLE  NO" in first
    assert "+2 more" in first


def test_a_silent_session_is_not_navigable_whatever_its_last_word() -> None:
    view = view_of(snapshots.navigating(), is_silent=True)
    text = " ".join(lines_of(PosePanel(), view, WIDTH, POSE_LINES))
    assert "NAVIGABLE  NO" in text
    assert "no answer" in text
    assert "0.21" not in text
    assert "FROZEN" in view.picture_title
    assert view.level is Level.BAD


@pytest.mark.parametrize("snapshot", [snapshots.navigating(), snapshots.suspended()])
def test_the_error_keeps_its_place(snapshot: Snapshot) -> None:
    lines = lines_of(PosePanel(), view_of(snapshot), WIDTH, POSE_LINES)
    assert len(lines) == POSE_LINES
    assert lines[-2].startswith("error  ≤ ")
    assert all(len(line) <= WIDTH for line in lines)


def test_an_error_beyond_the_tolerance_is_called_over() -> None:
    assert "over" in lines_of(PosePanel(), view_of(snapshots.suspended()), WIDTH, POSE_LINES)[-2]
    assert "over" not in "".join(
        lines_of(PosePanel(), view_of(snapshots.navigating()), WIDTH, POSE_LINES)
    )


def test_a_candidate_shows_what_the_judge_has_against_it() -> None:
    verdict = Verdict(Status.DEGRADED, 2.4, (Reason.DEGENERATE,), 0.2, 0.3, 0.5, 0.9, 0.2)
    view = view_of(snapshots.review(verdict=verdict))
    text = " ".join(lines_of(PosePanel(), view, WIDTH, POSE_LINES))
    assert "judged DEGRADED" in text
    assert Reason.DEGENERATE.value in text
    assert "a accept" in text
    assert "CANDIDATE, not accepted" in view.picture_title


def test_a_candidate_that_waits_to_be_judged_is_not_asked_about() -> None:
    view = view_of(snapshots.review(verdict=None))
    text = " ".join(lines_of(PosePanel(), view, WIDTH, POSE_LINES))
    assert "judged" not in text
    assert "a accept" not in text


NONE = UNICODE.absent
WELL = OtherBone("tibia", Verdict(Status.OK, 0.31), 133.4)
OTHERS = (WELL, OtherBone("patella", Verdict(Status.LOST, 1.7), 12_345.0))


@pytest.mark.parametrize(
    ("other", "line"),
    [
        (WELL, "tibia   ● ≤0.31 mm 133 ms"),
        (OtherBone("patella", Verdict(Status.OK, 0.3), 501.0), f"patella {NONE} old      501 ms"),
        (dataclasses.replace(WELL, age_ms=2e10), f"tibia   {NONE} old      9999 s"),
        (OtherBone("femur", Verdict(Status.DEGRADED, 0.2), 999.6), "femur   ▲ DEGRADED    1 s"),
        (OTHERS[1], "patella ✗ LOST       12 s"),
        (OtherBone("tibia", Verdict(Status.LOST, 0.4)), "tibia   ✗ LOST          -"),
        (OtherBone("tibia"), f"tibia   {NONE} -             -"),
    ],
)  # fmt: skip
def test_another_bone_is_one_line_with_a_bound_only_while_it_is_current(
    other: OtherBone, line: str
) -> None:
    view = view_of(snapshots.navigating(others=(other,)))
    assert lines_of(PosePanel(), view, WIDTH, POSE_LINES)[-3] == line


def test_other_bones_take_the_room_of_the_rms_and_of_nothing_else() -> None:
    alone = lines_of(PosePanel(), view_of(snapshots.navigating()), WIDTH, POSE_LINES)
    view = view_of(snapshots.navigating(others=OTHERS))
    lines = lines_of(PosePanel(), view, WIDTH, POSE_LINES)
    assert lines[:5] == alone[:5]
    assert lines[-2:] == alone[-2:]
    assert [line.split()[0] for line in lines[5:7]] == ["tibia", "patella"]
    assert len(lines) == POSE_LINES
    wide = lines_of(PosePanel(), view, 40, 12)
    assert all(any(word in line for line in wide) for word in ("rms", "expected", "tibia"))


@pytest.mark.parametrize("reason", list(Reason))
def test_other_bones_hide_no_reason_and_no_remedy(reason: Reason) -> None:
    view = view_of(snapshots.suspended(reasons=(reason, Reason.BLANKED), others=OTHERS))
    text = " ".join(lines_of(PosePanel(), view, WIDTH, POSE_LINES))
    # What is too slow is told with figures.
    assert view.reason[0] in text
    assert reason.remedy in text


def test_other_bones_hide_no_question_to_the_operator() -> None:
    for verdict in (None, Verdict(Status.DEGRADED, 2.4, (Reason.DEGENERATE,))):
        alone, beside = (
            lines_of(
                PosePanel(),
                view_of(snapshots.review(verdict=verdict, others=others)),
                WIDTH,
                POSE_LINES,
            )
            for others in ((), OTHERS)
        )
        assert set(filter(None, alone)) <= set(beside)


def test_nothing_is_known_of_other_bones_in_a_silent_session() -> None:
    view = view_of(snapshots.navigating(others=(WELL,)), is_silent=True)
    (line,) = (line for line in lines_of(PosePanel(), view, WIDTH, POSE_LINES) if "tibia" in line)
    assert line.split() == ["tibia", NONE, "-", "-"]


@pytest.mark.parametrize("symbols", [UNICODE, ASCII])
def test_other_bones_fit_the_small_panel(symbols: Symbols) -> None:
    for name in ("femur", "tibia", "patella"):
        for status in Status:
            for age_ms in (None, 7.0, 499.9, 999.4, 1e12):
                other = OtherBone(name, Verdict(status, 1.99), age_ms)
                view = view_of(snapshots.navigating(others=(other,)), symbols)
                line = lines_of(PosePanel(), view, WIDTH, POSE_LINES)[-3]
                assert len(line) == WIDTH
                assert name in line
                assert line.isascii() or symbols is UNICODE


@pytest.mark.parametrize("snapshot", [snapshots.starting(), snapshots.registering()])
def test_who_has_to_wait_is_told_to_wait(snapshot: Snapshot) -> None:
    assert view_of(snapshot).reason[1].startswith("wait ")


@pytest.mark.parametrize("changes", [{"is_camera_silent": True}, {"state": SessionState.FAULT}])
def test_a_picture_that_stands_still_is_called_old(changes: dict[str, Any]) -> None:
    title = view_of(snapshots.navigating(reasons=(Reason.CAMERA_SILENT,), **changes)).picture_title
    assert "OLD PICTURE" in title
    view = view_of(snapshots.starting(is_camera_silent=True))
    assert "OLD PICTURE" not in view.picture_title


def test_a_mirror_away_from_its_place_is_named_with_what_to_do() -> None:
    mirror = DeviceLine("mirror", "m", DeviceHealth.TROUBLE, "46.0 deg, calibrated at 45.0 deg")
    snapshot = snapshots.navigating(
        reasons=(Reason.MIRROR_AWAY,),
        device_reasons=(Reason.MIRROR_AWAY,),
        devices=(*snapshots.DEVICES[:3], mirror),
    )
    view = view_of(snapshot)
    assert "mirror does not stand where" in view.reason[0]
    assert "reopen" in view.reason[1]
    lines = lines_of(DevicesPanel(), view, WIDTH, DEVICE_LINES)
    assert "mirror" in lines[0]
    assert "TROUBLE" in lines[0]


def test_devices_stand_in_pairs_while_all_is_well() -> None:
    lines = lines_of(DevicesPanel(), view_of(snapshots.navigating()), WIDTH, DEVICE_LINES)
    assert "camera" in lines[0]
    assert "display" in lines[0]
    assert len(lines) == DEVICE_LINES


def test_a_lost_device_stands_first_with_the_word() -> None:
    lines = lines_of(DevicesPanel(), view_of(snapshots.suspended()), WIDTH, DEVICE_LINES)
    assert "display" in lines[0]
    assert "LOST" in lines[0]
    assert lines[1] == "3 others without trouble"


def test_troubles_that_do_not_fit_are_counted() -> None:
    devices = tuple(DeviceLine(f"d{i}", "", DeviceHealth.LOST) for i in range(5))
    view = view_of(snapshots.navigating(devices=devices))
    assert lines_of(DevicesPanel(), view, WIDTH, DEVICE_LINES)[1] == "and 4 more in trouble"


def test_a_device_that_is_not_there_gives_way_to_one_that_is() -> None:
    rig = DeviceLine("rig", "sim:rig", DeviceHealth.UNKNOWN, "not checked: show the board")
    view = view_of(snapshots.navigating(devices=(*snapshots.DEVICES, rig)))
    lines = lines_of(DevicesPanel(), view, WIDTH, DEVICE_LINES)
    assert len(lines) == DEVICE_LINES
    assert f"{view.symbols.attention} rig" in lines[1]
    assert "projector" not in " ".join(lines)


def test_a_rig_that_moved_is_said_over_a_live_picture() -> None:
    snapshot = snapshots.navigating(
        state=SessionState.FAULT, reasons=(Reason.RIG_MOVED,), rig_alarm="rig moved, recalibrate"
    )
    view = view_of(snapshot)
    assert view.level is Level.BAD
    assert view.picture_title == "left view · RIG MOVED, the display is dark"
    text = " ".join(lines_of(PosePanel(), view, WIDTH, POSE_LINES))
    assert "NAVIGABLE  NO" in text
    assert "rig moved, recalibrate" in text


def test_its_last_picture_is_old_when_the_camera_is_lost_as_well() -> None:
    lost = DeviceLine("camera", "simulated stereo", DeviceHealth.LOST, "unplugged")
    view = view_of(
        snapshots.navigating(
            state=SessionState.FAULT,
            reasons=(Reason.RIG_MOVED,),
            rig_alarm="rig moved, recalibrate",
            devices=(lost, *snapshots.DEVICES[1:]),
        )
    )
    assert view.is_picture_old
    assert view.picture_title == "left view · OLD PICTURE, no new one comes"


def test_no_devices_are_no_lines() -> None:
    assert lines_of(DevicesPanel(), view_of(snapshots.navigating(devices=())), WIDTH, 2) == []


@pytest.mark.parametrize("rig_name", ["sim:rig", "oak 7"])
@pytest.mark.parametrize("is_simulated", [True, False])
def test_the_title_says_sim_when_the_session_is_simulated_whatever_the_rigs_name(
    rig_name: str, is_simulated: bool
) -> None:
    snapshot = snapshots.navigating(rig_name=rig_name, is_simulated=is_simulated)
    (line,) = lines_of(TitleLine(), view_of(snapshot), 80, 1)
    assert (" sim " in line) == is_simulated


@pytest.mark.parametrize("width", [80, 100, 160])
@pytest.mark.parametrize("make", [TitleLine, KeyFooter, StageStepper])
@pytest.mark.parametrize("symbols", [UNICODE, ASCII])
def test_lines_fit_their_width(width: int, make: Callable[[], TextView], symbols: Symbols) -> None:
    for stage in STAGES:
        snapshot = snapshots.blanked(stage=stage, is_recording=True, rig_name="simulated " * 9)
        (line, *_) = lines_of(make(), view_of(snapshot, symbols), width, 1)
        assert len(line) <= width
        if make is TitleLine:
            assert "NAVIGATING" in line
            assert "BLANKED" in line


def test_keys_keep_their_place_in_the_footer() -> None:
    places = {
        lines_of(KeyFooter(), view_of(snapshot), 80, 1)[0].index("q quit")
        for snapshot in (
            snapshots.navigating(),
            snapshots.registering(),
            snapshots.review(),
            snapshots.blanked(),
        )
    }
    assert len(places) == 1


def test_cancel_takes_the_place_of_register_while_that_runs() -> None:
    (line,) = lines_of(KeyFooter(), view_of(snapshots.registering()), 80, 1)
    assert "c cancel" in line
    assert "g register" not in line


def test_wide_stepper_tells_the_next_gate_and_what_was_measured() -> None:
    plane = ResectionPlane("femur", np.zeros(3), np.array([0.0, 0.0, -1.0]))
    tilt = np.array([np.tan(np.radians(0.31)), 0.0, -0.42])
    face = MeasuredFace(plane, tilt, 2.0 * np.eye(3), 0.6)
    cuts = (
        StepLine("femur_distal", "cut", is_made=True, measured=face),
        StepLine("lateral", "cut", is_made=True),
        StepLine("posterior", "cut", is_made=False),
    )
    lines = lines_of(StageStepper(), view_of(snapshots.navigating(steps=cuts)), 160, 3)
    assert "● the entry point was checked with the tip" in lines[1]
    assert f"{Level.ATTENTION.mark(UNICODE)} hole femoral_guide drilled" in lines[1]
    assert "femur_distal 0.31 deg -0.42 mm" in lines[2]
    assert "lateral not measurable" in lines[2]
    assert "posterior" not in lines[2]


def test_an_event_is_one_line_without_control_codes() -> None:
    event = Event(
        snapshots.START_NS + 3_725 * snapshots.S, "x", "a\nb \x1b[2J" + "c" * 99, EventLevel.ALARM
    )
    line = format_event_line(view_of(snapshots.navigating()), event, 60).plain
    assert line.startswith("  62:05 ✗ ALARM a b ")
    assert "\x1b" not in line
    assert "\n" not in line
    assert len(line) <= 60


@pytest.mark.parametrize(
    ("snapshot", "level"),
    [
        (snapshots.navigating(), Level.OK),
        (snapshots.navigating(reasons=(Reason.JUMPED,)), Level.BAD),
        (snapshots.suspended(), Level.BAD),
        (snapshots.blanked(), Level.ATTENTION),
        (snapshots.review(), Level.ATTENTION),
        (snapshots.starting(), Level.ATTENTION),
    ],
)
def test_levels(snapshot: Snapshot, level: Level) -> None:
    assert view_of(snapshot).level is level


@pytest.mark.parametrize(
    "snapshot",
    [
        snapshots.navigating(),
        snapshots.suspended(),
        snapshots.review(),
        snapshots.starting(),
        snapshots.blanked(),
    ],
)
def test_plain_terminals_get_ascii_only(snapshot: Snapshot) -> None:
    view = view_of(dataclasses.replace(snapshot), ASCII)
    for widget in (PosePanel(), DevicesPanel(), TitleLine(), KeyFooter(), StageStepper()):
        for line in lines_of(widget, view, 80, 3):
            assert line.isascii()
    assert view.picture_title.isascii()


def test_a_candidate_on_a_terminal_of_few_colours_is_not_to_be_judged_there() -> None:
    view = view_of(snapshots.review())
    text = "\n".join(str(line) for line in PosePanel().build(view, 24, 14))
    assert "colours" not in text
    few = dataclasses.replace(view, has_colours=False)
    lines = [str(line) for line in PosePanel().build(few, 24, 14)]
    assert "no outline in so few" in " ".join(lines)
    assert any("reject" in line for line in lines)
