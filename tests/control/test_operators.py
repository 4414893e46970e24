import json
from pathlib import Path

import pytest

from navapp.control.commands import (
    Accept,
    Blank,
    EnterStage,
    Register,
    Reject,
    Show,
)
from navapp.control.event_log import SessionHooks
from navapp.control.executors import RecordedExecutor, ThreadExecutor
from navapp.control.operators import (
    RecordedOperator,
    ReplayOperator,
    read_events,
)
from navapp.control.recorder import SessionRecorder
from navapp.control.runner import run_headless
from navapp.errors import DeviceLost, SequenceError
from navapp.values import Reason, Status
from tests.control.fakes import LOST, Bench, FakeCamera, a_pose, answer, navigating
from tests.control.operated import commands_of, kinds


@pytest.fixture
def bench() -> Bench:
    return Bench(camera=FakeCamera(None, n_frames=40))


class NoFrames:
    """A recorder's sink that keeps nothing."""

    def add(self, frame, with_pictures: bool) -> None:
        pass

    def close(self) -> None:
        pass


def test_a_replays_operator_accepts_what_is_not_lost(bench: Bench) -> None:
    bench.script.found = [answer(Status.DEGRADED, Reason.TRE_TOO_LARGE)]
    assert kinds(commands_of(bench, ReplayOperator())) == ["Register", "Accept"]


def test_a_replays_operator_rejects_a_lost_candidate(bench: Bench) -> None:
    bench.frames(1)
    bench.do(Register())
    bench.script.tracked = LOST
    bench.frames(2)
    assert ReplayOperator().commands(bench.snapshot) == [Reject(1)]


def test_a_lost_candidate_is_left_under_review_where_refused_poses_are_followed(
    bench: Bench,
) -> None:
    bench.frames(1)
    bench.do(Register())
    bench.script.tracked = LOST
    bench.frames(2)
    operator = ReplayOperator(follows_refused=True)
    assert operator.commands(bench.snapshot) == []
    bench.script.tracked = answer()
    bench.frames(2)
    assert kinds(operator.commands(bench.snapshot)) == ["Accept"]


def test_each_frame_can_be_registered_on_its_own(bench: Bench) -> None:
    given = commands_of(bench, ReplayOperator(each_frame=True))
    assert set(kinds(given)) == {"Register"}
    assert bench.script.calls.count("register femur") >= 39


def test_a_recorded_operator_gives_each_command_after_the_same_frame() -> None:
    recorded = [(-1, Show()), (2, Register()), (5, Accept(None)), (5, Blank())]
    told: list[tuple[int, object]] = []
    hooks = SessionHooks(on_command=(lambda c, s: told.append((s, c)),))
    bench = Bench(camera=FakeCamera(None, n_frames=40), hooks=hooks)
    run_headless(bench.controller, RecordedOperator(list(recorded)))
    assert told == recorded


def test_a_live_session_replays_with_the_same_states() -> None:
    """Worker, cancelled search and second search included."""
    import threading

    told: list[tuple[int, object]] = []
    executor = ThreadExecutor()
    live = Bench(
        executor=executor,
        camera=FakeCamera(None, n_frames=30),
        hooks=SessionHooks(on_command=(lambda c, s: told.append((s, c)),)),
    )
    from navapp.control.commands import Cancel

    live.script.found = [answer(), answer(pose=a_pose(x_mm=5.0))]
    for number in (1, 2):
        live.script.gate = threading.Event()
        live.script.started.clear()
        live.frames(2)
        live.do(Register())
        live.frames(4)
        assert live.script.started.wait(5.0)
        if number == 1:
            live.do(Cancel())
            live.script.gate.set()
        else:
            live.script.gate.set()
            executor.close()
    live.frames(3)
    live.do(Reject(live.snapshot.candidate_id))
    live.do(Accept(1))
    live.frames(1)
    live.do(Accept(live.snapshot.candidate_id))
    live.frames(30)
    live.controller.close()
    assert live.take_overs

    again = Bench(
        executor=RecordedExecutor(live.take_overs),
        camera=FakeCamera(None, n_frames=30),
    )
    again.script.found = live.script.found
    run_headless(again.controller, RecordedOperator(told))
    assert live.refused() == again.refused() != ""
    assert [r.state for r in again.results] == [r.state for r in live.results]
    assert again.take_overs == live.take_overs


def test_events_are_read_back_as_commands_and_take_overs(tmp_path: Path) -> None:
    lines = [
        {"type": "event", "sequence": -1, "text": "x"},
        {"type": "command", "sequence": 3, "command": "register"},
        {"type": "take_over", "sequence": 4},
        {"type": "command", "sequence": 6, "command": "stage", "number": 2},
        {"type": "command", "sequence": 7, "command": "reject"},
        {"type": "command", "sequence": 8, "command": "accept", "candidate_id": 2},
    ]
    path = tmp_path / "events.jsonl"
    path.write_text("".join(json.dumps(line) + "\n" for line in lines))
    events = read_events(path)
    assert events.commands == [
        (3, Register()),
        (6, EnterStage(2)),
        # Older recordings do not say which candidate was meant.
        (7, Reject(None)),
        (8, Accept(2)),
    ]
    assert events.take_overs == [4]


def test_a_command_that_was_refused_is_not_given_again(tmp_path: Path) -> None:
    """What refused it, a lost camera, is not there in the replay."""
    recorder = SessionRecorder(tmp_path, NoFrames())
    hooks = SessionHooks(
        on_event=(recorder.on_event,),
        on_command=(recorder.on_command,),
        on_take_over=(recorder.on_take_over,),
    )
    live = navigating(Bench(camera=FakeCamera(None, n_frames=12), hooks=hooks))
    live.camera.error = DeviceLost("unplugged")
    live.frames(1)
    live.do(Register())
    assert "the camera is lost" in live.refused()
    live.do(Blank())
    live.camera.error = None
    live.frames(40)
    recorder.close()
    events = read_events(tmp_path / "events.jsonl")
    again = Bench(
        executor=RecordedExecutor(events.take_overs), camera=FakeCamera(None, n_frames=12)
    )
    run_headless(again.controller, RecordedOperator(events.commands))
    assert [r.state for r in again.results] == [r.state for r in live.results]
    assert kinds(command for _, command in events.commands)[-1] == "Blank"


@pytest.mark.parametrize(
    "damage", ['{"type": "command", "sequ', "[]", '{"type": "event"}', '{"sequence": "x"}']
)
def test_damaged_events_name_their_line(tmp_path: Path, damage: str) -> None:
    path = tmp_path / "events.jsonl"
    path.write_text('{"type": "event", "sequence": 1}\n' + damage + "\n")
    with pytest.raises(SequenceError, match="line 2 of"):
        read_events(path)
