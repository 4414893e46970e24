import json
from dataclasses import replace
from pathlib import Path

import pytest

from navapp.control.commands import (
    EnterStage,
    Propose,
    Register,
)
from navapp.control.event_log import SessionHooks
from navapp.control.operators import read_events
from navapp.control.recorder import BackgroundSink, SessionRecorder
from navapp.errors import InputError
from navapp.values import Reason, Status
from tests.control.fakes import Bench, a_pose, answer


class Sink:
    def __init__(self, error_at: int | None = None) -> None:
        self.kept: list[tuple[int, bool]] = []
        self.is_closed = False
        self.error_at = error_at

    def add(self, frame, with_pictures: bool) -> None:
        if frame.sequence == self.error_at:
            raise InputError("the disk is full")
        self.kept.append((frame.sequence, with_pictures))

    def close(self) -> None:
        self.is_closed = True


def recorded(folder: Path, sink: Sink) -> tuple[Bench, SessionRecorder]:
    recorder = SessionRecorder(folder, sink, with_pictures=False)
    hooks = SessionHooks(
        on_frame=(recorder.on_frame,),
        on_event=(recorder.on_event,),
        on_command=(recorder.on_command,),
        on_take_over=(recorder.on_take_over,),
    )
    return Bench(hooks=hooks), recorder


def lines(path: Path) -> list[dict]:
    text = path.read_text()
    assert text.endswith("\n")
    return [json.loads(line) for line in text.splitlines()]


def test_every_line_is_whole_at_any_moment(tmp_path: Path) -> None:
    bench, recorder = recorded(tmp_path, Sink())
    bench.frames(1)
    bench.do(Register())
    bench.frames(1)
    # Nothing is closed yet.
    assert [line["state"] for line in lines(tmp_path / "poses.jsonl")] == ["ready", "review"]
    assert any(line["type"] == "command" for line in lines(tmp_path / "events.jsonl"))
    recorder.close()


def test_a_session_is_recorded_with_all_that_a_replay_needs(tmp_path: Path) -> None:
    sink = Sink()
    bench, recorder = recorded(tmp_path, sink)
    bench.frames(1)
    bench.do(Register())
    bench.frames(1)
    bench.accept()
    bench.frames(1)
    bench.script.tracked = answer(Status.LOST, Reason.OUT_OF_VIEW, has_pose=False)
    bench.frames(1)
    bench.do(EnterStage(5))
    pose = a_pose("tibia", x_mm=2.0)
    bench.do(Propose(pose))
    recorder.close()
    assert sink.is_closed
    assert sink.kept == [(n, False) for n in range(4)]
    events = read_events(tmp_path / "events.jsonl")
    assert events.take_overs == [1]
    assert [(n, type(c).__name__) for n, c in events.commands] == [
        (0, "Register"), (1, "Accept"), (3, "EnterStage"), (3, "Propose"),
    ]  # fmt: skip
    read_back = events.commands[-1][1].left_from_bone
    assert read_back.matrix.tobytes() == pose.matrix.tobytes()
    poses = lines(tmp_path / "poses.jsonl")
    assert [line["status"] for line in poses] == [None, "OK", "OK", "LOST"]
    assert poses[0]["camera_from_model"] is None
    assert poses[1]["camera_from_model"] == a_pose().to_list()
    assert poses[3]["camera_from_model"] is None


def test_the_other_bones_are_kept_with_the_frame_whose_turn_they_were(tmp_path: Path) -> None:
    bench, recorder = recorded(tmp_path, Sink())
    bench.script.tracked_of = {"tibia": answer(pose=a_pose("tibia", x_mm=5.0))}
    for stage in (5, 1):
        bench.do(EnterStage(stage))
        bench.do(Register())
        bench.frames(1)
        bench.accept()
    bench.frames(4)
    recorder.close()
    poses = lines(tmp_path / "poses.jsonl")[-4:]
    said = {"status": "OK", "camera_from_model": a_pose("tibia", x_mm=5.0).to_list()}
    assert [line["bone"] for line in poses] == ["femur"] * 4
    assert [line["bodies"] for line in poses] == [{"tibia": said}, {}] * 2


def a_frame(number: int):
    frame = Bench().camera.read(0.1)
    return replace(frame, sequence=number)


def test_frames_are_kept_in_the_background_all_and_in_order() -> None:
    sink = Sink()
    background = BackgroundSink(sink, max_waiting=2)
    frame = a_frame(0)
    for number in range(30):
        background.add(replace(frame, sequence=number), True)
    background.close()
    assert sink.kept == [(number, True) for number in range(30)]
    assert sink.is_closed


def test_what_goes_wrong_in_the_background_is_raised_at_the_latest_at_the_end() -> None:
    sink = Sink(error_at=0)
    background = BackgroundSink(sink)
    background.add(a_frame(0), True)
    with pytest.raises(InputError, match="disk is full"):
        background.close()
    assert sink.is_closed


def test_a_full_disk_stops_the_recording_once_and_the_rest_is_ignored(tmp_path: Path) -> None:
    bench, recorder = recorded(tmp_path, Sink(error_at=2))
    bench.frames(5)
    told = [event for event in bench.snapshot.events if event.kind == "recording"]
    assert bench.state == "ready"
    assert len(lines(tmp_path / "poses.jsonl")) == 2
    assert [event.text for event in told] == ["recording stopped: the disk is full"]
    recorder.close()
    assert not read_events(tmp_path / "events.jsonl").is_complete


def test_a_recording_that_ran_to_its_end_says_so(tmp_path: Path) -> None:
    bench, recorder = recorded(tmp_path, Sink())
    bench.frames(2)
    assert not read_events(tmp_path / "events.jsonl").is_complete
    recorder.close()
    assert read_events(tmp_path / "events.jsonl").is_complete
