"""The check on the patient in a session on fakes: touches, answers, gates."""

import dataclasses

import numpy as np
import pytest

from navapp.control.command_files import command_from_json, command_to_json
from navapp.control.commands import (
    CheckPicks,
    ConfirmCondition,
    DropPoint,
    EnterStage,
    ForgetPoints,
    Register,
    TouchPoint,
)
from navapp.control.stages import CHECKED_ON_PATIENT
from navapp.control.states import PatientCheck
from navapp.tools.patient_check import FEWEST_TOUCHES, CheckAnswer
from navapp.values import BoneModel, Pick, Plan, Reason
from tests.control.fakes import Bench, a_plan, navigating
from tests.control.held_pointer import POINTER, HeldPointer
from tests.registration.shapes import ball_mesh

RADIUS_MM = 30.0
TARGETS = {
    "femur/medial_condyle": np.array([[25.0, 0.0, -16.0]]),
    "femur/lateral_condyle": np.array([[-25.0, 0.0, -16.0]]),
    "femur/notch": np.array([[0.0, 25.0, -16.0]]),
}


def bumpy_plan() -> Plan:
    """A ball with bumps: unlike on a ball every motion shows."""
    mesh = ball_mesh(RADIUS_MM)
    points = mesh.vertices_mm
    bumps = 1.0 + 0.15 * np.sin(4.0 * points[:, :1] / RADIUS_MM) * np.cos(
        3.0 * points[:, 1:2] / RADIUS_MM
    )
    bumpy = type(mesh)(points * bumps, mesh.faces)
    return dataclasses.replace(
        a_plan(), bones={"femur": BoneModel("femur", bumpy, "right")}, targets=TARGETS, digest=""
    )


PLAN = bumpy_plan()
SEEN = np.flatnonzero(PLAN.bones["femur"].mesh.normals[:, 2] < -0.4)


@pytest.fixture
def held(monkeypatch: pytest.MonkeyPatch) -> HeldPointer:
    return HeldPointer(monkeypatch)


@pytest.fixture
def bench(held: HeldPointer) -> Bench:
    return navigating(Bench(plan=PLAN, tools={"pointer": POINTER}, has_gates=True))


def touch(
    bench: Bench, held: HeldPointer, number: int, off_mm: tuple[float, float, float] = (0, 0, 0)
) -> PatientCheck:
    """The tip rests on a place of the bone, which lies off its model; the check after it."""
    rng = np.random.default_rng(number)
    point = PLAN.bones["femur"].mesh.vertices_mm[rng.choice(SEEN)]
    held.tip_mm = point + np.array([0.0, 0.0, 300.0]) + off_mm
    bench.do(TouchPoint())
    check = bench.frames(12).patient_check
    assert check is not None
    return check


def is_met(bench: Bench) -> bool:
    bench.do(EnterStage(2))
    return {line.name: line.is_met for line in bench.snapshot.gate}[CHECKED_ON_PATIENT]


def test_a_right_registration_passes_and_meets_the_gate(bench: Bench, held: HeldPointer) -> None:
    assert not is_met(bench)
    numbers = iter(range(40))
    while (check := touch(bench, held, next(numbers))).answer is CheckAnswer.OPEN:
        assert check.result is not None
    assert check.answer is CheckAnswer.PASSED
    assert check.n_touches >= FEWEST_TOUCHES
    assert check.result.most_mm <= check.result.limit_mm == 1.0
    assert is_met(bench)
    assert any("checked on the patient" in event.text for event in bench.events)


def test_a_wrong_registration_fails_and_nobody_may_say_otherwise(
    bench: Bench, held: HeldPointer
) -> None:
    bench.do(ConfirmCondition(CHECKED_ON_PATIENT))
    assert is_met(bench)
    numbers = iter(range(40))
    while (check := touch(bench, held, next(numbers), (1.2, 0.0, 1.2))).answer is CheckAnswer.OPEN:
        pass
    assert check.answer is CheckAnswer.FAILED
    assert not is_met(bench)
    bench.do(ConfirmCondition(CHECKED_ON_PATIENT))
    assert not is_met(bench)
    assert any(
        event.kind == "refused" and "the check on the patient failed" in event.text
        for event in bench.events
    )
    # Registered anew, the old check says nothing.
    bench.do(Register())
    bench.frames(1)
    bench.accept()
    bench.do(ConfirmCondition(CHECKED_ON_PATIENT))
    assert is_met(bench)


def test_more_points_are_asked_for_where_they_tell_most(bench: Bench, held: HeldPointer) -> None:
    check = touch(bench, held, 1)
    assert check.answer is CheckAnswer.OPEN
    assert check.wanted.startswith("at the cross, ")
    assert check.wanted_mm is not None
    # It faces the cameras.
    assert check.wanted_mm[2] < 0.0


def test_a_tip_that_does_not_rest_gives_no_point(bench: Bench, held: HeldPointer) -> None:
    held.tip_mm = np.array([0.0, 0.0, 270.0])
    bench.do(TouchPoint())
    for k in range(60):
        held.tip_mm = np.array([0.5 * k, 0.0, 270.0])
        bench.frames(1)
    assert bench.snapshot.patient_check is None
    assert any("the tip did not rest" in event.text for event in bench.events)


def test_a_touch_far_from_the_bone_is_none(bench: Bench, held: HeldPointer) -> None:
    held.tip_mm = np.array([0.0, 0.0, 200.0])
    bench.do(TouchPoint())
    bench.frames(12)
    assert bench.snapshot.patient_check is None
    assert any("no point was taken: the tip is" in event.text for event in bench.events)


def test_points_are_dropped_and_forgotten(bench: Bench, held: HeldPointer) -> None:
    touch(bench, held, 1)
    assert touch(bench, held, 2).n_touches == 2
    bench.do(DropPoint())
    assert bench.snapshot.patient_check.n_touches == 1
    bench.do(ForgetPoints())
    assert bench.snapshot.patient_check is None


def test_touched_landmarks_count_in_all_directions(bench: Bench, held: HeldPointer) -> None:
    name = "femur/notch"
    point = PLAN.landmarks_of("femur")[name]
    held.tip_mm = point + np.array([0.3, 0.0, 300.4])
    bench.do(TouchPoint(name))
    check = bench.frames(12).patient_check
    assert check.n_touches == 1
    assert any(f"point 1, {name}: 0.50 mm off" in event.text for event in bench.events)


def test_picked_landmarks_are_compared_without_a_pointer(held: HeldPointer) -> None:
    bench = navigating(Bench(plan=PLAN))
    known = PLAN.landmarks_of("femur")
    rig_px = 200.0
    picks = tuple(
        Pick(
            name,
            "femur",
            (
                159.5 + rig_px * point[0] / (300.0 + point[2]),
                119.5 + rig_px * point[1] / (300.0 + point[2]),
            ),
            point,
        )
        for name, point in known.items()
    )
    bench.do(CheckPicks(picks))
    check = bench.snapshot.patient_check
    assert check.n_touches == 3
    assert check.result.measured_mm < 0.05
    # Nothing of the depth: they can find an error, but never pass.
    assert check.answer is CheckAnswer.CANNOT_TELL
    assert "no depth" in check.result.reason
    assert command_from_json(command_to_json(CheckPicks(picks))).picks[0].name == picks[0].name


@pytest.mark.parametrize(
    ("command", "words"),
    [
        (TouchPoint(), "no pointer is known"),
        (CheckPicks((Pick("femur/nose", "femur", (1.0, 1.0), np.zeros(3)),)), "no landmark"),
    ],
)
def test_what_cannot_be_checked_is_refused(command, words: str) -> None:
    bench = navigating(Bench(plan=PLAN))
    bench.do(command)
    assert words in bench.events[-1].text
    assert bench.events[-1].kind == "refused"


def test_touches_before_the_bone_is_accepted_are_refused(held: HeldPointer) -> None:
    bench = Bench(plan=PLAN, tools={"pointer": POINTER})
    bench.frames(1)
    bench.do(TouchPoint())
    assert "the check needs an accepted bone" in bench.events[-1].text


@pytest.mark.parametrize("command", [TouchPoint("femur/notch"), DropPoint(), ForgetPoints()])
def test_commands_are_recorded(command) -> None:
    assert command_from_json(command_to_json(command)) == command


def test_the_displays_picture_says_it(bench: Bench, held: HeldPointer) -> None:
    from navapp.control.pictures import banner

    check = touch(bench, held, 1)
    shown = dataclasses.replace(bench.snapshot, reasons=(), patient_check=check)
    assert banner(shown).endswith("check on the patient: 1 points, more are needed")
    assert banner(dataclasses.replace(shown, patient_check=None)).endswith(
        "not verified on the patient"
    )


def test_a_failed_check_takes_the_guides_and_cannot_be_forgotten(
    bench: Bench, held: HeldPointer
) -> None:
    for name in ("patient", "side", "plan"):
        bench.do(ConfirmCondition(name))
    assert bench.frames(1).is_navigable
    numbers = iter(range(40))
    while touch(bench, held, next(numbers), (1.2, 0.0, 1.2)).answer is CheckAnswer.OPEN:
        pass
    assert Reason.CHECK_FAILED in bench.frames(1).reasons
    bench.do(ForgetPoints())
    assert Reason.CHECK_FAILED in bench.frames(1).reasons
    bench.do(ConfirmCondition(CHECKED_ON_PATIENT))
    assert "the check on the patient failed" in bench.events[-1].text
    bench.do(Register())
    bench.frames(1)
    bench.accept()
    assert Reason.CHECK_FAILED not in bench.frames(1).reasons


def test_a_touch_that_waits_is_not_taken_of_another_registration(
    bench: Bench, held: HeldPointer
) -> None:
    assert touch(bench, held, 1).n_touches == 1
    held.tip_mm = None
    bench.do(TouchPoint())
    bench.frames(2)
    bench.do(Register())
    bench.frames(1)
    bench.accept()
    held.tip_mm = np.array([0.0, 0.0, 270.0])
    bench.frames(12)
    assert bench.snapshot.patient_check is None
    assert any("another bone or registration" in event.text for event in bench.events)


def test_a_landmark_counts_once(bench: Bench, held: HeldPointer) -> None:
    point = PLAN.landmarks_of("femur")["femur/notch"]
    held.tip_mm = point + np.array([0.0, 0.0, 300.0])
    for _ in range(3):
        bench.do(TouchPoint("femur/notch"))
        check = bench.frames(12).patient_check
    assert check.n_touches == 1


def test_a_dropped_point_is_told_and_decides_anew(bench: Bench, held: HeldPointer) -> None:
    numbers = iter(range(40))
    while (check := touch(bench, held, next(numbers))).answer is CheckAnswer.OPEN:
        pass
    assert check.answer is CheckAnswer.PASSED
    while bench.snapshot.patient_check.n_touches >= FEWEST_TOUCHES:
        bench.do(DropPoint())
    assert bench.snapshot.patient_check.answer is CheckAnswer.OPEN
    assert any("dropped" in event.text for event in bench.events)


def test_a_check_grows_old(bench: Bench, held: HeldPointer) -> None:
    numbers = iter(range(40))
    while touch(bench, held, next(numbers)).answer is CheckAnswer.OPEN:
        pass
    assert bench.snapshot.patient_check.is_valid
    bench.clock.advance_ns(31 * 60 * 10**9)
    assert not bench.frames(1).patient_check.is_valid
