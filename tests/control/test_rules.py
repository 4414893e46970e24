"""What the screen offers is what the controller obeys."""

from dataclasses import replace

import pytest

from navapp.control.commands import (
    Accept,
    Blank,
    Cancel,
    CheckMirror,
    Command,
    ConfirmCross,
    EnterStage,
    NudgeCross,
    Propose,
    Quit,
    Reconnect,
    Register,
    Reject,
    SetProjector,
    Show,
    ToggleEye,
    ToggleLayer,
)
from navapp.control.rules import why_refused
from navapp.control.states import DeviceHealth, DeviceLine, SessionState
from tests.control.fakes import Bench, a_pose, navigating

SENSELESS = [
    (Cancel(), "no registration is running"),
    (Accept(None), "no candidate"),
    (Reject(None), "no candidate"),
    (Show(), "not blanked"),
    (ToggleEye(), "no simulated mirror"),
    (ToggleLayer("clouds"), "no layer 'clouds'"),
    (SetProjector("on"), "none to be told"),
    (SetProjector("colour"), "no setting 'colour'"),
    (CheckMirror(), "not seen in a mirror"),
    (NudgeCross(1, 0), "no check of the mirror"),
    (ConfirmCross(), "no check of the mirror"),
    (EnterStage(0), "no stage 0"),
    (EnterStage(6), "no stage 6"),
    (EnterStage(1), "in force already"),
    (Reconnect(), "no device is lost"),
    (Propose(a_pose("tibia")), "not one of the femur"),
]


@pytest.mark.parametrize(("command", "why"), SENSELESS)
def test_a_senseless_command_is_answered_and_changes_nothing(command: Command, why: str) -> None:
    bench = navigating(Bench())
    assert why in why_refused(command, bench.snapshot)
    before = bench.snapshot
    after = bench.do(command)
    assert why in bench.refused()
    assert (after.state, after.stage, after.layers) == (before.state, before.stage, before.layers)


@pytest.mark.parametrize(("kind", "is_opened"), [("mirror", True), ("recording", False)])
def test_only_what_can_be_opened_again_is(kind: str, is_opened: bool) -> None:
    line = DeviceLine(kind, "one", DeviceHealth.TROUBLE)
    snapshot = replace(navigating(Bench()).snapshot, devices=(line,))
    assert (why_refused(Reconnect(), snapshot) == "") is is_opened


@pytest.mark.parametrize("command", [Register(), EnterStage(2), Blank(), Quit()])
def test_what_makes_sense_is_done_without_a_word_of_refusal(command: Command) -> None:
    bench = navigating(Bench())
    assert why_refused(command, bench.snapshot) == ""
    bench.do(command)
    assert bench.refused() == ""


def test_a_second_registration_waits_for_the_end_of_the_first() -> None:
    snapshot = replace(Bench().snapshot, state=SessionState.REGISTERING)
    assert "cancel it first" in why_refused(Register(), snapshot)
    assert why_refused(Cancel(), snapshot) == ""


def test_keys_in_quick_succession_decide_about_what_was_on_the_screen() -> None:
    """A stage, a rejection and an acceptance, all typed while the first candidate was shown."""
    bench = Bench()
    bench.script.found *= 2
    bench.frames(1)
    bench.do(Register())
    bench.frames(2)
    shown = bench.snapshot.candidate_id
    bench.do(EnterStage(2))
    assert bench.do(Reject(shown)).state is SessionState.REVIEW
    assert bench.do(Accept(shown)).state is SessionState.REVIEW
    assert "another candidate is under review now" in bench.refused()
    # The same, typed slowly.
    slow = bench.frames(2)
    assert slow.candidate_id == shown + 1
    assert bench.do(Accept(slow.candidate_id)).state is SessionState.NAVIGATING
