"""Steps are confirmed and withdrawn in a session, and the faces of cuts measured."""

import threading
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from navapp.control.command_files import command_from_json, command_to_json
from navapp.control.commands import (
    ConfirmStep,
    EnterStage,
    ReadThickness,
    Register,
    WithdrawStep,
)
from navapp.control.executors import ThreadExecutor
from navapp.control.states import Snapshot
from navapp.errors import UsageError
from navapp.values import BoneModel, Plan, ResectionPlane, Status, SurgicalContent
from tests.control.cuts import Faces, cut_plan
from tests.control.fakes import Bench, a_frame, a_pose, answer, navigating, wait_for
from tests.geometry.shapes import sphere


@pytest.fixture
def bench() -> Bench:
    return navigating(Bench(plan=cut_plan()))


def told(snapshot: Snapshot) -> dict[str, bool]:
    return {cut.name: cut.is_made for cut in snapshot.steps}


def used_by_tracker(bench: Bench) -> np.ndarray:
    """(V,) vertices of the femur that its tracker registers to."""
    return ~bench.trackers["femur"].bone.is_removed


def test_the_steps_of_the_stages_bone_are_told(bench: Bench) -> None:
    assert told(bench.snapshot) == {"top": False, "side": False}
    assert told(bench.do(EnterStage(5))) == {"flat": False}


def test_what_is_cut_no_longer_belongs_to_the_model(bench: Bench) -> None:
    assert used_by_tracker(bench).all()
    snapshot = bench.do(ConfirmStep("top"))
    assert told(snapshot) == {"top": True, "side": False}
    assert snapshot.bone_version == 1
    assert not snapshot.is_navigable
    assert "top confirmed: version 1 of the femur is in force" in bench.events[-1].text
    assert bench.frames(1).is_navigable
    heights_mm = cut_plan().bones["femur"].mesh.vertices_mm[:, 2]
    np.testing.assert_array_equal(used_by_tracker(bench), heights_mm <= 6.5)


def test_a_cut_that_is_withdrawn_comes_back(bench: Bench) -> None:
    bench.do(ConfirmStep("top"))
    snapshot = bench.do(WithdrawStep("top"))
    assert told(snapshot) == {"top": False, "side": False}
    assert snapshot.bone_version == 0
    bench.frames(1)
    assert used_by_tracker(bench).all()


@pytest.mark.parametrize(
    ("command", "why"),
    [
        (ConfirmStep("nose"), "the plan has no step 'nose'"),
        (WithdrawStep("top"), "'top' was not confirmed"),
        (WithdrawStep("nose"), "'nose' was not confirmed"),
    ],
)
def test_what_cannot_be_done_is_refused_with_a_reason(bench: Bench, command, why: str) -> None:
    before = bench.snapshot
    after = bench.do(command)
    assert why in bench.refused()
    assert told(after) == told(before)
    assert after.is_navigable == before.is_navigable


def test_another_bones_cut_leaves_the_pose_alone(bench: Bench) -> None:
    snapshot = bench.do(ConfirmStep("flat"))
    assert snapshot.is_navigable
    assert snapshot.bone_version == 0


def test_faces_are_measured_in_turns_and_become_known(bench: Bench, faces: Faces) -> None:
    faces.shares["top"] = 0.8
    bench.do(ConfirmStep("top"))
    versions = [bench.frames(1).bone_version for _ in range(40)]
    assert versions[0] == 1
    assert versions[-1] == 2
    measured = [result.measured for result in bench.results if result.measured]
    # In every fifth frame.
    assert 6 <= len(measured) <= 9
    assert versions.index(2) <= 20
    (top, _) = bench.snapshot.steps
    assert top.measured is not None
    assert top.measured.offset_mm == pytest.approx(-0.4)
    assert top.seen_share == 0.8
    assert top.thickness.mm > top.thickness.planned_mm > 0.0
    # Once it is known, it is looked for there.
    assert faces.expected[0] is None
    assert faces.expected[-1] is not None
    assert faces.expected[-1].point_mm[2] == pytest.approx(7.6, abs=1e-3)
    assert any("faces measured: version 2" in event.text for event in bench.events)


def test_a_face_of_which_little_is_seen_is_not_told(bench: Bench, faces: Faces) -> None:
    faces.shares["top"] = 0.1
    bench.do(ConfirmStep("top"))
    bench.frames(40)
    (top, side) = bench.snapshot.steps
    assert top.measured is None
    assert top.seen_share == 0.1
    assert side.seen_share is None
    assert not any(result.measured for result in bench.results)
    assert bench.snapshot.bone_version == 1


def test_nothing_is_measured_with_a_pose_that_is_not_ok(bench: Bench, faces: Faces) -> None:
    faces.shares["top"] = 0.8
    bench.do(ConfirmStep("top"))
    bench.script.tracked = answer(Status.DEGRADED)
    bench.frames(20)
    assert not faces.expected


def test_with_several_cuts_the_faces_take_turns(bench: Bench, faces: Faces) -> None:
    faces.shares = {"top": 0.8, "side": 0.6}
    bench.do(ConfirmStep("top"))
    bench.do(ConfirmStep("side"))
    bench.frames(40)
    measured = [tuple(result.measured) for result in bench.results if result.measured]
    assert set(measured) == {("top",), ("side",)}
    assert all(one != other for one, other in pairwise(measured))
    assert bench.snapshot.bone_version == 4


def test_nothing_is_kept_of_a_candidate_that_nobody_has_accepted(faces: Faces) -> None:
    faces.shares["top"] = 0.8
    bench = Bench(plan=cut_plan(), made_steps=("top",))
    bench.frames(1)
    bench.do(Register())
    bench.frames(30)
    assert bench.snapshot.is_candidate
    assert not faces.expected
    bench.accept()
    bench.frames(20)
    assert bench.snapshot.steps[0].measured is not None


def test_a_cut_withdrawn_and_made_again_is_measured_again(bench: Bench, faces: Faces) -> None:
    faces.shares["top"] = 0.8
    bench.do(ConfirmStep("top"))
    bench.frames(30)
    bench.do(ConfirmStep("top"))
    assert "is confirmed already" in bench.refused()
    assert bench.snapshot.steps[0].measured is not None
    bench.do(WithdrawStep("top"))
    snapshot = bench.do(ConfirmStep("top"))
    assert snapshot.steps[0].measured is None
    assert snapshot.steps[0].seen_share is None


FLAT = ResectionPlane("patella", np.zeros(3), np.array([0.0, 0.0, 1.0]), (60.0, 60.0))


def patella_plan() -> Plan:
    """The ball of the plan's femur is a patella, cut through its middle."""
    ball = BoneModel("patella", sphere(20.0, 40))
    plan = cut_plan()
    planes = {**plan.content.planes, "flat_patella": FLAT}
    return replace(
        plan,
        bones={**plan.bones, "patella": ball},
        content=SurgicalContent(planes=planes),
        digest="",
    )


def test_a_plan_that_allows_no_reading_is_told() -> None:
    plan = patella_plan()
    beside = replace(FLAT, point_mm=np.array([0.0, 0.0, 50.0]))
    content = SurgicalContent(planes={"flat_patella": beside})
    bench = navigating(Bench(plan=replace(plan, content=content, digest="")))
    bench.do(EnterStage(4))
    step = bench.do(ConfirmStep("flat_patella")).steps[0]
    assert not step.is_caliper_readable
    assert "does not meet the patella" in step.caliper_refusal


def test_a_thickness_that_was_read_makes_another_bone_of_the_patella() -> None:
    bench = navigating(Bench(plan=patella_plan()))
    bench.do(EnterStage(4))
    snapshot = bench.do(ConfirmStep("flat_patella"))
    assert snapshot.bone_version == 1
    step = snapshot.steps[0]
    planned_mm = [one.thickness_mm for one in step.caliper_points]
    np.testing.assert_allclose(planned_mm, np.sqrt(20.0**2 - 10.0**2), rtol=0.02)
    assert step.thickness is None
    reading = tuple(one - 0.5 for one in planned_mm)
    snapshot = bench.do(ReadThickness("flat_patella", reading))
    assert snapshot.bone_version == 2
    assert "thickness below flat_patella read" in bench.events[-1].text
    step = snapshot.steps[0]
    assert step.measured is None
    assert step.thickness.mm == pytest.approx(20.5, abs=0.1)
    assert step.thickness.planned_mm == pytest.approx(20.0, abs=0.1)
    assert step.remaining_mm == reading
    # A new registration takes nothing of it back; read again, it counts anew.
    bench.do(Register())
    bench.frames(3)
    snapshot = bench.accept()
    assert snapshot.bone_version == 2
    assert snapshot.steps[0].remaining_mm == reading
    snapshot = bench.do(ReadThickness("flat_patella", tuple(planned_mm)))
    assert snapshot.bone_version == 3
    assert snapshot.steps[0].is_caliper_readable
    assert bench.do(WithdrawStep("flat_patella")).bone_version == 0


@pytest.mark.parametrize(
    ("command", "why"),
    [
        (ReadThickness("nose", (10.0,) * 4), "'nose' is no cut that was confirmed"),
        (ReadThickness("flat_patella", (10.0,) * 4), "is no cut that was confirmed"),
        (ReadThickness("top", (10.0,) * 4), "the femur is followed by its surface"),
    ],
)
def test_a_thickness_that_says_nothing_is_refused(command, why: str) -> None:
    bench = navigating(Bench(plan=patella_plan(), made_steps=("top",)))
    bench.do(command)
    assert why in bench.refused()


@pytest.mark.parametrize("reading", [(10.0, 10.0), (30.0, 30.0, 10.0, 10.0)])
def test_a_thickness_that_tells_no_face_is_refused(reading: tuple[float, ...]) -> None:
    bench = navigating(Bench(plan=patella_plan()))
    bench.do(EnterStage(4))
    bench.do(ConfirmStep("flat_patella"))
    snapshot = bench.do(ReadThickness("flat_patella", reading))
    assert "thickness" in bench.refused()
    assert snapshot.bone_version == 1
    assert snapshot.steps[0].thickness is None


@pytest.mark.parametrize(
    "command",
    [
        ConfirmStep("femur_distal"),
        WithdrawStep("femur_distal"),
        ReadThickness("patella", (13.5, 13.25, 12.0, 14.0)),
    ],
)
def test_commands_are_recorded(command) -> None:
    assert command_from_json(command_to_json(command)) == command


def test_a_plan_without_that_plane_is_refused_before_the_start() -> None:
    with pytest.raises(UsageError, match=r"no step 'nose'.*choose of top, side, flat"):
        Bench(plan=cut_plan(), made_steps=("nose",))


def test_a_session_can_begin_with_cuts_made() -> None:
    bench = navigating(Bench(plan=cut_plan(), made_steps=("top", "side")))
    assert told(bench.snapshot) == {"top": True, "side": True}
    vertices_mm = cut_plan().bones["femur"].mesh.vertices_mm
    is_left = (vertices_mm[:, 2] <= 6.5) & (vertices_mm[:, 0] <= 23.5)
    np.testing.assert_array_equal(used_by_tracker(bench), is_left)


@pytest.mark.parametrize(("skew_ns", "is_measured"), [(0, True), (4_000_000, False)])
def test_a_bone_that_moves_is_measured_only_in_pictures_that_are_exposed_at_once(
    bench: Bench, faces: Faces, skew_ns: int, is_measured: bool
) -> None:
    faces.shares["top"] = 0.8
    bench.do(ConfirmStep("top"))
    steps, frame = bench.controller._session._steps, replace(a_frame(), skew_ns=skew_ns)
    found = {}
    for k in range(3):
        pose = a_pose().move((0.8 * k, 0, 0, 0, 0, 0), np.zeros(3))
        at = replace(frame, captured_ns=frame.captured_ns + k * 33_000_000, sequence=k)
        found |= steps.measure(at, answer(pose=pose), is_accepted=True)
    assert ("top" in found) == is_measured


def test_a_new_registration_forgets_what_was_measured_with_the_old_one(
    bench: Bench, faces: Faces
) -> None:
    faces.shares["top"] = 0.8
    bench.do(ConfirmStep("top"))
    assert bench.frames(30).bone_version == 2
    bench.do(Register())
    bench.frames(3)
    snapshot = bench.accept()
    assert snapshot.steps[0].is_made
    assert snapshot.steps[0].measured is None
    assert snapshot.bone_version == 1
    bench.frames(1)
    heights_mm = cut_plan().bones["femur"].mesh.vertices_mm[:, 2]
    np.testing.assert_array_equal(used_by_tracker(bench), heights_mm <= 6.5)


def test_a_search_begins_anew_when_the_bone_is_cut_meanwhile() -> None:
    bench = Bench(plan=cut_plan(), executor=ThreadExecutor())
    bench.frames(1)
    bench.script.gate = threading.Event()
    bench.do(Register())
    bench.frames(1)
    assert bench.script.started.wait(5.0)
    bench.script.started.clear()
    bench.do(ConfirmStep("top"))
    bench.frames(1)
    assert bench.script.started.wait(5.0)
    bench.script.gate.set()
    wait_for(lambda: bench.frames(1).is_candidate, "a candidate")
    assert bench.script.calls.count("register femur") == 2
    assert bench.trackers["femur"].bone.is_removed.any()
    bench.controller.close()


@pytest.mark.parametrize(
    ("name", "command"),
    [("confirm_cut", ConfirmStep("top")), ("withdraw_cut", WithdrawStep("top"))],
)
def test_recordings_from_before_holes_and_parts_are_read(name: str, command) -> None:
    assert command_from_json({"command": name, "name": "top"}) == command
