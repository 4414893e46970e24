"""The operator draws layers, or no longer."""

from pathlib import Path

import numpy as np
import pytest

from navapp.control.command_files import command_from_json, command_to_json
from navapp.control.commands import EnterStage, ToggleLayer
from navapp.control.event_log import SessionHooks
from navapp.control.executors import RecordedExecutor
from navapp.control.operators import RecordedOperator, read_events
from navapp.control.recorder import SessionRecorder
from navapp.control.runner import run_headless
from navapp.overlay import LAYERS
from tests.control.fakes import CLEAR, Bench, FakeCamera, navigating


class NoFrames:
    """A recorder's sink that keeps nothing."""

    def add(self, frame, with_pictures: bool) -> None:
        pass

    def close(self) -> None:
        pass


def picture(bench: Bench) -> np.ndarray:
    """Of the last frame, without banner and mark."""
    image: np.ndarray = bench.results[-1].picture.image[CLEAR]
    return image


def test_the_layers_of_the_stage_are_drawn_in_the_order_of_their_table() -> None:
    bench = navigating(Bench())
    assert set(bench.snapshot.layers) == set(bench.snapshot.stage.layers)
    names = list(LAYERS)
    assert sorted(bench.snapshot.layers, key=names.index) == list(bench.snapshot.layers)


def test_a_layer_is_switched_off_and_on_again() -> None:
    bench = navigating(Bench())
    before = picture(bench).copy()
    assert before.any()
    assert "bone" not in bench.do(ToggleLayer("bone")).layers
    bench.frames(1)
    off = picture(bench)
    assert (off != before).sum() > 1000
    assert "bone" in bench.do(ToggleLayer("bone")).layers
    bench.frames(1)
    np.testing.assert_array_equal(picture(bench), before)
    assert [event.text for event in bench.events if event.kind == "layer"] == [
        "layer bone off",
        "layer bone on",
    ]


def test_a_layer_that_the_stage_lacks_can_be_drawn_too() -> None:
    bench = navigating(Bench())
    assert "planes" not in bench.snapshot.layers
    assert "planes" in bench.do(ToggleLayer("planes")).layers


def test_switching_ends_when_the_stage_is_left() -> None:
    bench = navigating(Bench())
    own = bench.snapshot.layers
    assert bench.do(ToggleLayer("bone")).layers != own
    assert bench.do(EnterStage(2)).layers == tuple(
        name for name in LAYERS if name in bench.snapshot.stage.layers
    )
    assert bench.do(EnterStage(1)).layers == own


def test_an_unknown_layer_is_refused() -> None:
    bench = navigating(Bench())
    before = bench.snapshot.layers
    assert bench.do(ToggleLayer("hologram")).layers == before
    assert bench.refused() == "layer refused: there is no layer 'hologram'"


@pytest.mark.parametrize("layers", [("scale", "bone"), ()])
def test_layers_that_were_asked_for_are_drawn_in_every_stage(layers: tuple[str, ...]) -> None:
    bench = navigating(Bench(layers=layers))
    for number in (1, 3):
        bench.do(EnterStage(number))
        assert set(bench.snapshot.layers) == set(layers)
    assert set(bench.do(ToggleLayer("scale")).layers) == set(layers) ^ {"scale"}


def test_it_is_recorded_as_a_command() -> None:
    command = ToggleLayer("risks")
    assert command_to_json(command) == {"command": "layer", "name": "risks"}
    assert command_from_json(command_to_json(command)) == command


def test_a_replay_switches_at_the_same_frames(tmp_path: Path) -> None:
    recorder = SessionRecorder(tmp_path, NoFrames())
    hooks = SessionHooks(
        on_event=(recorder.on_event,),
        on_command=(recorder.on_command,),
        on_take_over=(recorder.on_take_over,),
    )
    live = navigating(Bench(camera=FakeCamera(None, n_frames=12), hooks=hooks))
    live.do(ToggleLayer("bone"))
    live.do(ToggleLayer("hologram"))
    live.frames(2)
    live.do(ToggleLayer("bone"))
    live.frames(10)
    recorder.close()
    events = read_events(tmp_path / "events.jsonl")
    again = Bench(
        executor=RecordedExecutor(events.take_overs), camera=FakeCamera(None, n_frames=12)
    )
    run_headless(again.controller, RecordedOperator(events.commands))
    shown = [result.picture.image for result in live.results]
    assert len({image[CLEAR].any() for image in shown}) == 2
    for one, other in zip(shown, again.results, strict=True):
        np.testing.assert_array_equal(one, other.picture.image)
    assert ToggleLayer("hologram") not in [command for _, command in events.commands]
