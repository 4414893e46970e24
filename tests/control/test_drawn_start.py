"""A registration from where the operator has drawn the bone."""

import json
from dataclasses import replace

import numpy as np
import pytest

from navapp.control.command_files import command_from_json, command_to_json
from navapp.control.commands import EnterStage, Register
from navapp.errors import SequenceError
from navapp.values import Prior
from tests.control.fakes import Bench, a_plan, a_pose

BOX = (300, 120, 400, 380)
AXIS = np.array([0.0, 0.6, 0.8])
KNOWN = Prior({"femur": a_pose(), "tibia": a_pose("tibia")}, AXIS, 25.0)


def test_the_bone_is_searched_for_in_the_box_and_seen_from_the_known_side() -> None:
    bench = Bench(prior=KNOWN)
    bench.frames()
    bench.do(Register(Prior(box=BOX)))
    bench.frames()
    (start,) = bench.script.priors
    assert start.box == BOX
    assert not start.left_from_bone
    np.testing.assert_array_equal(start.approach_axis, AXIS)
    assert start.approach_half_angle_deg == 25.0
    assert any("in the box that was drawn" in event.text for event in bench.events)


def test_the_next_registration_of_that_bone_begins_there_too_and_of_no_other() -> None:
    bench = Bench(prior=KNOWN)
    bench.frames()
    bench.do(Register(Prior(box=BOX)))
    bench.frames()
    bench.do(Register())
    bench.frames()
    bench.do(EnterStage(5))
    bench.do(Register())
    bench.frames()
    drawn, again, of_tibia = bench.script.priors
    assert again.box == drawn.box == BOX
    assert of_tibia is KNOWN


def test_without_anything_to_start_from_the_operator_is_asked_for_a_box() -> None:
    bench = Bench(prior=Prior())
    bench.script.found = []
    bench.frames()
    bench.do(Register())
    bench.frames()
    assert "draw a box around it" in bench.events[-1].text


def test_the_screen_has_the_whole_picture_and_what_can_be_picked_in_it() -> None:
    targets = {"femur/notch": np.zeros(3), "femur/hip": np.full(3, 400.0), "tibia/a": np.zeros(3)}
    bench = Bench(plan=replace(a_plan(), targets=targets))
    bench.frames()
    snapshot = bench.snapshot
    assert list(snapshot.landmarks) == ["femur/notch"]
    assert snapshot.left_picture is not None
    height, width = snapshot.left_picture.shape[:2]
    assert (width, height) == snapshot.picture_size_px


def test_what_was_drawn_is_recorded() -> None:
    given = Register(Prior(box=BOX))
    read = command_from_json(json.loads(json.dumps(command_to_json(given))))
    assert isinstance(read, Register)
    assert read.start is not None
    assert read.start.box == BOX
    assert command_from_json({"command": "register"}) == Register()


@pytest.mark.parametrize("start", [3, {"box": [1, 2]}, {"box": "abcd"}, {"camera_from_model": 1}])
def test_a_damaged_recording_is_refused(start) -> None:
    with pytest.raises(SequenceError):
        command_from_json({"command": "register", "start": start})
