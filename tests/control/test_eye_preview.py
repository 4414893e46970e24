"""The operator's screen shows what an eye sees in a simulated mirror, when asked to."""

from pathlib import Path

import numpy as np
import pytest

from navapp.control.command_files import command_from_json, command_to_json
from navapp.control.commands import (
    Register,
    Reject,
    ToggleEye,
)
from navapp.control.event_log import SessionHooks
from navapp.control.executors import RecordedExecutor
from navapp.control.eye_preview import EyePreview
from navapp.control.operators import RecordedOperator, read_events
from navapp.control.recorder import SessionRecorder
from navapp.control.runner import run_headless
from navapp.values import Reason, Status
from tests.control.fakes import PERIOD_NS, Bench, FakeCamera, SlowExecutor, answer, navigating
from tests.control.test_layer_switching import NoFrames

LIT, SITE, VIDEO = 200, 90, 0
PERIODS_OF_A_LOOK = -(-250_000_000 // PERIOD_NS)


class Slow:
    """A preview that is on, whose looks end when a test says so."""

    def __init__(self) -> None:
        self.executor, self.now_ns, self.eye = SlowExecutor(), 0, Eye()
        self.preview = EyePreview(self.eye, self.executor)
        self.preview.toggle()

    def update(self, after_ms: int = 0, *, has_guides: bool = True, **what: bool) -> int | None:
        """Grey of what is shown; None: the video."""
        self.now_ns += after_ms * 1_000_000
        seen = self.preview.update(self.now_ns, has_guides=has_guides, **what)
        return None if seen is None else int(seen[0][2, 2, 0])

    def end_look(self) -> None:
        self.executor.let_go()


class Eye:
    """Sees an even grey; counts the looks."""

    def __init__(self) -> None:
        self.n_looks = 0

    def __call__(self) -> tuple[np.ndarray, np.ndarray]:
        self.n_looks += 1
        return np.full((300, 480, 3), LIT, np.uint8), np.full((300, 480, 3), SITE, np.uint8)


def level(bench: Bench) -> int:
    """Grey in the middle of the operator's picture."""
    preview = bench.snapshot.picture
    assert preview is not None
    return int(preview[2, 2, 0])


def test_the_key_shows_what_the_eye_sees_and_a_second_time_the_video() -> None:
    bench = navigating(Bench(look=Eye()))
    assert bench.snapshot.has_eye
    assert not bench.snapshot.shows_eye
    video = bench.snapshot.picture
    bench.do(ToggleEye())
    assert bench.frames().shows_eye
    assert level(bench) == LIT
    assert bench.snapshot.picture.shape == (300, 480, 3)
    # The display and the pipeline get what they always get.
    assert bench.results[-1].picture.image.shape == (240, 320, 3)
    bench.do(ToggleEye())
    assert not bench.frames().shows_eye
    np.testing.assert_array_equal(bench.snapshot.picture, video)
    assert [event.text for event in bench.events if event.kind == "eye"] == [
        "the screen shows what the eye sees in the mirror",
        "the screen shows the video",
    ]


def test_nobody_looks_while_it_is_off_and_seldom_while_it_is_on() -> None:
    eye = Eye()
    bench = navigating(Bench(look=eye))
    bench.frames(10)
    assert eye.n_looks == 0
    bench.do(ToggleEye())
    bench.frames(4 * PERIODS_OF_A_LOOK)
    assert eye.n_looks == 4
    bench.do(ToggleEye())
    bench.frames(10)
    assert eye.n_looks == 4


def test_without_guides_none_are_seen_that_were_there_before() -> None:
    bench = navigating(Bench(look=Eye()))
    bench.do(ToggleEye())
    bench.frames(1)
    assert level(bench) == LIT
    bench.script.tracked = answer(Status.LOST, Reason.NO_SURFACE, has_pose=False)
    bench.frames(1)
    assert level(bench) == SITE
    # Later the eye has looked again: at a display without guides.
    bench.frames(PERIODS_OF_A_LOOK)
    assert level(bench) == LIT


def test_guides_that_grow_old_are_not_seen_either() -> None:
    bench = navigating(Bench(look=Eye()))
    bench.do(ToggleEye())
    bench.frames(1)
    bench.clock.advance_ns(600_000_000)
    aged = bench.controller.snapshot_now()
    assert not aged.is_navigable
    assert aged.picture[2, 2, 0] == SITE


def test_a_look_that_hangs_shows_no_old_guides() -> None:
    slow = Slow()
    assert slow.update() is None
    slow.end_look()
    assert slow.update(100) == LIT
    # The next look begins, and does not end.
    assert slow.update(300) == LIT
    assert slow.update(500) == LIT
    assert slow.update(200) is None
    assert slow.update(60_000) is None
    # What it saw a minute ago is no news either; a look that is begun now is.
    slow.end_look()
    assert slow.update() is None
    assert slow.update(10) is None
    assert slow.eye.n_looks == 2
    slow.end_look()
    assert slow.update(10) == LIT


def test_a_look_from_before_it_was_switched_off_is_not_shown_when_it_is_on_again() -> None:
    slow = Slow()
    slow.update()
    slow.preview.toggle()
    slow.preview.toggle()
    slow.end_look()
    assert slow.update(100) is None
    assert slow.update(10) is None
    slow.end_look()
    assert slow.update(10) == LIT


def test_what_was_seen_before_a_review_is_not_shown_after_it() -> None:
    slow = Slow()
    slow.update()
    slow.end_look()
    assert slow.update(10) == LIT
    assert slow.update(10, is_hidden=True) is None
    assert slow.update(10) is None
    slow.end_look()
    assert slow.update(10) == LIT


@pytest.mark.parametrize("when", ["before", "meanwhile"])
def test_guides_that_were_lit_during_a_look_are_not_seen_without_guides(when: str) -> None:
    slow = Slow()
    slow.update(has_guides=when == "before")
    slow.update(10, has_guides=when == "meanwhile")
    slow.end_look()
    assert slow.update(10, has_guides=False) == SITE


def test_a_candidate_is_looked_at_over_the_video() -> None:
    bench = navigating(Bench(look=Eye()))
    bench.do(ToggleEye())
    bench.frames(1)
    bench.script.found = [answer()]
    bench.do(Register())
    bench.frames(2)
    assert bench.snapshot.is_candidate
    assert not bench.snapshot.shows_eye
    assert level(bench) != LIT
    bench.do(Reject(None))
    assert bench.frames(2).shows_eye


def test_it_is_refused_without_a_simulated_mirror() -> None:
    bench = navigating(Bench())
    assert not bench.snapshot.has_eye
    bench.do(ToggleEye())
    assert "navapp run --mirror" in bench.refused()
    assert not bench.frames().shows_eye


def test_it_is_recorded_as_a_command() -> None:
    assert command_to_json(ToggleEye()) == {"command": "eye"}
    assert command_from_json(command_to_json(ToggleEye())) == ToggleEye()


def test_a_replay_switches_at_the_same_frame_and_refuses_where_no_mirror_is(tmp_path: Path) -> None:
    recorder = SessionRecorder(tmp_path, NoFrames())
    hooks = SessionHooks(
        on_event=(recorder.on_event,),
        on_command=(recorder.on_command,),
        on_take_over=(recorder.on_take_over,),
    )
    live = navigating(Bench(camera=FakeCamera(None, n_frames=8), hooks=hooks, look=Eye()))
    live.do(ToggleEye())
    live.frames(6)
    recorder.close()
    events = read_events(tmp_path / "events.jsonl")
    for look in (Eye(), None):
        again = Bench(
            executor=RecordedExecutor(events.take_overs),
            camera=FakeCamera(None, n_frames=8),
            look=look,
        )
        run_headless(again.controller, RecordedOperator(events.commands))
        told = [(event.kind, event.sequence) for event in again.events]
        assert ("eye" if look else "refused", live_sequence(live)) in told
        for one, other in zip(live.results, again.results, strict=True):
            np.testing.assert_array_equal(one.picture.image, other.picture.image)


def live_sequence(bench: Bench) -> int:
    """Of the frame after which the eye was switched on."""
    return next(event.sequence for event in bench.events if event.kind == "eye")
