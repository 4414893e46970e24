"""A registration from where the operator has drawn the bone."""

import json
from dataclasses import replace

import numpy as np
import pytest

from navapp.control.command_files import command_from_json, command_to_json
from navapp.control.commands import EnterStage, Register
from navapp.control.rules import why_refused
from navapp.errors import SequenceError
from navapp.geometry.directions import ViewCone
from navapp.values import Pick, Prior
from tests.control.fakes import Bench, a_plan, a_pose

BOX = (300, 120, 400, 380)
AXIS = np.array([0.0, 0.6, 0.8])
KNOWN = Prior({"femur": a_pose(), "tibia": a_pose("tibia")}, {"femur": ViewCone(AXIS, 25.0)})


def test_the_bone_is_searched_for_in_the_box_and_seen_from_the_known_side() -> None:
    bench = Bench(prior=KNOWN)
    bench.frames()
    bench.do(Register(Prior(box=BOX)))
    bench.frames()
    (start,) = bench.script.priors
    assert start.box == BOX
    assert not start.left_from_bone
    np.testing.assert_array_equal(start.cones["femur"].axis, AXIS)
    assert start.cones["femur"].half_angle_deg == 25.0
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


def test_an_empty_start_goes_back_to_the_sessions_own() -> None:
    bench = Bench(prior=KNOWN)
    bench.frames()
    for start in (Prior(box=BOX), Prior(), None):
        bench.do(Register(start))
        bench.frames()
    assert bench.script.priors[0].box == BOX
    assert bench.script.priors[1] is bench.script.priors[2] is KNOWN
    told = [event.text for event in bench.events if event.text.startswith("searching")]
    assert [("box" in text) for text in told] == [True, False, False]


def test_what_was_drawn_for_another_bone_is_refused() -> None:
    bench = Bench(prior=KNOWN)
    bench.frames()
    bench.do(Register(Prior(box=BOX), "tibia"))
    bench.frames()
    assert bench.script.priors == []
    assert "it was drawn for the tibia; the stage shows the femur" in bench.events[-1].text


def test_a_method_that_needs_a_pose_refuses_a_box_and_keeps_its_prior() -> None:
    snapshot = replace(Bench(prior=KNOWN).snapshot, can_draw_start=False)
    assert "rough pose" in why_refused(Register(Prior(box=BOX)), snapshot)
    assert why_refused(Register(), snapshot) == ""


def test_without_anything_to_start_from_the_operator_is_asked_for_a_box() -> None:
    bench = Bench(prior=Prior())
    bench.script.found = []
    bench.frames()
    bench.do(Register())
    bench.frames()
    assert "draw a box around it" in bench.events[-1].text


def test_the_screen_has_the_whole_picture_and_what_can_be_picked_in_it() -> None:
    targets = {
        "femur/notch": np.zeros((1, 3)), "femur/hip": np.full((1, 3), 400.0),
        "tibia/a": np.zeros((1, 3)), "femur/where the error is judged": np.zeros((24, 3)),
    }  # fmt: skip
    bench = Bench(plan=replace(a_plan(), targets=targets))
    bench.frames()
    snapshot = bench.snapshot
    assert list(snapshot.landmarks) == ["femur/notch"]
    assert snapshot.landmarks["femur/notch"].shape == (3,)
    assert snapshot.left_picture is not None
    height, width = snapshot.left_picture.shape[:2]
    assert (width, height) == snapshot.picture_size_px


def test_what_was_drawn_is_recorded() -> None:
    given = Register(Prior(box=BOX), "femur")
    read = command_from_json(json.loads(json.dumps(command_to_json(given))))
    assert isinstance(read, Register)
    assert read.start is not None
    assert read.start.box == BOX
    assert read.bone == "femur"
    picked = Register(Prior(picks=(Pick("a", "femur", (1.0, 2.5), np.arange(3.0)),)), "femur")
    read = command_from_json(json.loads(json.dumps(command_to_json(picked))))
    assert isinstance(read, Register)
    assert read.start is not None
    (pick,) = read.start.picks
    assert (pick.name, pick.bone, pick.left_px) == ("a", "femur", (1.0, 2.5))
    np.testing.assert_array_equal(pick.model_mm, np.arange(3.0))
    assert command_from_json({"command": "register"}) == Register()


@pytest.mark.parametrize(
    "start", [3, {"box": [1, 2]}, {"box": "abcd"}, {"box": [1, 2, 3, 0]}, {"camera_from_model": 1}]
)
def test_a_damaged_recording_is_refused(start) -> None:
    with pytest.raises(SequenceError):
        command_from_json({"command": "register", "start": start})
