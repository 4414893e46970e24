"""The operator has the depth marked in the picture of the screen, never on the display."""

from dataclasses import replace

import numpy as np

from navapp.control.command_files import command_from_json, command_to_json
from navapp.control.commands import ToggleDepth
from navapp.geometry.box import Box
from navapp.values import DisparityMap, Foreground, Origin, Surroundings
from tests.control.fakes import Bench, answer, navigating


def with_foreground() -> Foreground:
    shape = (4000, 4000)  # more than any picture shows
    disparity_px = np.zeros(shape, np.float32)
    origin = np.full(shape, Origin.FILLED_INTERIOR, np.uint8)
    is_in_front = np.zeros(shape, dtype=np.bool_)
    box = Box(-1000, -1000, 4000, 4000)
    surroundings = Surroundings(disparity_px, origin, box, False, np.zeros(shape, np.uint8))
    nothing = DisparityMap(*(np.empty((0, 0), np.float32),) * 2, np.empty((0, 0), np.uint8), 0, 0)
    return Foreground(surroundings, nothing, is_in_front)


def test_the_key_marks_the_depth_and_a_second_time_no_longer() -> None:
    bench = navigating(Bench())
    bench.script.tracked = replace(answer(), foreground=with_foreground())
    plain = bench.frames().picture
    shown = bench.results[-1].picture.image.copy()
    assert not bench.snapshot.shows_depth
    bench.do(ToggleDepth())
    marked = bench.frames()
    assert marked.shows_depth
    assert (marked.picture != plain).any(axis=2).mean() > 0.5
    np.testing.assert_array_equal(bench.results[-1].picture.image, shown)
    bench.do(ToggleDepth())
    assert not bench.frames().shows_depth
    np.testing.assert_array_equal(bench.snapshot.picture, plain)
    assert [event.text for event in bench.events if event.kind == "depth"] == [
        "depth marked",
        "depth no longer marked",
    ]


def test_without_a_pose_nothing_is_marked() -> None:
    bench = Bench()
    plain = bench.frames().picture
    bench.do(ToggleDepth())
    np.testing.assert_array_equal(bench.frames().picture, plain)


def test_it_is_recorded_as_a_command() -> None:
    assert command_from_json(command_to_json(ToggleDepth())) == ToggleDepth()
