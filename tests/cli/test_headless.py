"""Sessions without a screen: rigs that they refuse, and what they tell meanwhile."""

import dataclasses
import sys
from datetime import date

import pytest

from navapp.cli import run as run_verb
from navapp.cli.diagnostics import Diagnostics
from navapp.cli.headless import FrameLog, check_not_expired, run_session
from navapp.cli.main import run
from navapp.control.event_log import SessionHooks
from navapp.control.scripted_operator import ScriptedOperator, ScriptStep
from navapp.errors import RigError
from navapp.geometry import RigQuality
from tests.control.fakes import Bench
from tests.geometry.shapes import toed_in_rig

RIG = dataclasses.replace(
    toed_in_rig(), quality=RigQuality(True, expires_on=date(2026, 8, 28)), name="bench"
)


def test_an_expired_rig_is_refused_in_one_sentence() -> None:
    with pytest.raises(RigError, match="rig bench expired on 2026-08-28: calibrate again"):
        check_not_expired(RIG, date(2026, 8, 29))


@pytest.mark.parametrize("rig", [RIG, toed_in_rig()])
def test_a_rig_in_its_time_or_without_one_is_used(rig) -> None:
    check_not_expired(rig, date(2026, 8, 28))


REGISTER = (ScriptStep(do="register"),)


class Interrupting:
    """Somebody presses ctrl+c after some frames."""

    def __init__(self, n_frames, log):
        self.n_frames, self.log = n_frames, log

    def commands(self, _snapshot):
        if len(self.log.results) >= self.n_frames:
            raise KeyboardInterrupt
        return []


def run_bench(n_frames, make_operator=lambda _log: ScriptedOperator(REGISTER)):
    diagnostics = Diagnostics()
    log = FrameLog(n_frames, diagnostics)
    bench = Bench(hooks=SessionHooks(on_frame=(log,)))
    run_session(bench.controller, make_operator(log), log, diagnostics)
    return log


def test_a_terminal_sees_how_far_a_session_is(capsys, monkeypatch):
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    run_bench(6)
    lines = capsys.readouterr().err.split("\r\x1b[K")
    assert len(lines) == 7
    assert lines[1].startswith("frame 1 of 6, ")
    assert lines[-1].startswith("frame 6 of 6, ")
    assert lines[-1].endswith("OK\n")


def test_elsewhere_nothing_is_told_for_a_frame(capsys):
    run_bench(6)
    assert capsys.readouterr().err == ""


def test_a_session_without_an_end_is_told_when_it_is_interrupted(capsys, monkeypatch):
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    log = run_bench(None, lambda log: Interrupting(4, log))
    assert len(log.results) == 4
    told = capsys.readouterr().err
    assert "frame 4, " in told
    assert told.endswith("4 frames\n")


def test_an_interrupt_before_the_end_of_frames_ends_everything():
    with pytest.raises(KeyboardInterrupt):
        run_bench(8, lambda log: Interrupting(4, log))


@pytest.mark.parametrize("is_endless", [False, True])
def test_what_is_done_is_told_before_the_work(capsys, monkeypatch, is_endless):
    told = []

    def refuse(*_arguments, **_options):
        told.append(capsys.readouterr().err)
        raise RigError("no rig", remedy="find one")

    monkeypatch.setattr(run_verb, "prepare_session", refuse)
    assert run(["run", "--headless", *([] if is_endless else ["--frames", "5"])]) == 3
    length = "until it is interrupted" if is_endless else "5 frames"
    assert told == [f"navapp: session without a screen, simulated: {length}\n"]


def test_a_replay_says_what_it_replays(capsys, tmp_path):
    assert run(["replay", str(tmp_path / "none")]) != 0
    assert capsys.readouterr().err.startswith(f"navapp: replaying {tmp_path / 'none'}\n")
