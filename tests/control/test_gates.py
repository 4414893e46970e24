"""The time-out and the gates between stages, in a session on fakes."""

import json
from dataclasses import replace

import numpy as np
import pytest

from navapp.control.command_files import command_from_json, command_to_json
from navapp.control.commands import (
    Command,
    ConfirmCondition,
    ConfirmStep,
    EnterStage,
    OverrideGate,
    Quit,
    Register,
    WithdrawCondition,
    WithdrawStep,
)
from navapp.control.stages import STAGES, TIME_OUT
from navapp.control.states import Snapshot
from navapp.resection import HoleMeter
from navapp.values import (
    ConditionKind,
    DrillAxis,
    MeasuredHole,
    Reason,
    Status,
    SurgicalContent,
)
from tests.control.cuts import Faces, cut_plan
from tests.control.fakes import Bench, answer, navigating

PERSONAL = [one.name for one in TIME_OUT if one.kind is ConditionKind.PERSON]


@pytest.fixture
def bench() -> Bench:
    return navigating(Bench(plan=cut_plan(), has_gates=True))


def confirm(bench: Bench, *names: str) -> Snapshot:
    for name in names:
        bench.do(ConfirmCondition(name))
    return bench.snapshot


def is_met(snapshot: Snapshot) -> dict[str, bool]:
    return {line.name: line.is_met for line in snapshot.gate}


def test_names_are_those_of_one_condition() -> None:
    texts: dict[str, set[str]] = {}
    conditions = [one for stage in STAGES for one in (*stage.entry, *stage.exit)]
    for one in (*TIME_OUT, *conditions):
        texts.setdefault(one.name, set()).add(one.text)
    assert all(len(said) == 1 for said in texts.values())


def test_no_guides_before_the_time_out(bench: Bench) -> None:
    assert bench.snapshot.reasons == (Reason.TIME_OUT_OPEN,)
    assert not bench.shows_guides
    confirm(bench, *PERSONAL[:-1])
    assert not bench.frames(1).is_navigable
    assert confirm(bench, PERSONAL[-1]).is_navigable
    bench.frames(1)
    assert bench.shows_guides
    bench.do(WithdrawCondition("side"))
    assert not bench.frames(1).is_navigable


def test_the_time_out_names_patient_side_plan_and_rig(bench: Bench) -> None:
    lines = {line.name: line for line in bench.snapshot.time_out}
    assert lines["side"].text == "this is the plan's side: RIGHT"
    assert lines["plan"].text.endswith(cut_plan().digest[:8])
    assert lines["rig"].is_met
    assert not lines["rig"].is_personal


def test_a_gate_is_told_item_by_item_and_met_by_what_is_known_and_said(bench: Bench) -> None:
    assert is_met(bench.snapshot) == {
        "bone_exposed": False, "bone_ok": True, "checked_on_patient": False,
    }  # fmt: skip
    snapshot = bench.do(EnterStage(2))
    assert snapshot.stage.number == 1
    assert snapshot.refused_stage == 2
    assert bench.refused() == "stage 2 drilling refused: 2 open"
    told = [event.text for event in bench.events if event.kind == "gate"]
    assert told == [
        "open: the bone is exposed",
        "open: femur: checked on the patient: known points lie where shown",
    ]
    confirm(bench, "bone_exposed", "checked_on_patient")
    assert bench.do(EnterStage(2)).stage.number == 2
    assert bench.snapshot.refused_stage is None


def test_a_bone_that_is_not_ok_does_not_pass(bench: Bench) -> None:
    confirm(bench, "bone_exposed", "checked_on_patient")
    bench.script.tracked = answer(Status.DEGRADED, Reason.TRE_TOO_LARGE)
    bench.frames(1)
    assert bench.do(EnterStage(2)).stage.number == 1
    bench.script.tracked = answer()
    bench.frames(1)
    assert bench.do(EnterStage(2)).stage.number == 2


def test_a_check_on_the_patient_grows_old(bench: Bench) -> None:
    confirm(bench, "bone_exposed", "checked_on_patient")
    bench.clock.advance_ns(31 * 60 * 10**9)
    bench.frames(1)
    assert is_met(bench.snapshot) == {
        "bone_exposed": True, "bone_ok": True, "checked_on_patient": False,
    }  # fmt: skip
    notes = {line.name: line.note for line in bench.snapshot.gate}
    assert notes["checked_on_patient"] == "confirmed 31 min ago: too old"


def test_a_gate_is_overridden_only_after_it_was_told_and_with_a_reason(bench: Bench) -> None:
    assert bench.do(OverrideGate(2, "haste")).stage.number == 1
    assert "enter stage 2 first" in bench.refused()
    bench.do(EnterStage(2))
    assert bench.do(OverrideGate(3, "haste")).stage.number == 1
    assert bench.do(OverrideGate(2, "  ")).stage.number == 1
    assert "with a reason only" in bench.refused()
    assert bench.do(OverrideGate(2, "haste")).stage.number == 2
    (told,) = [event.text for event in bench.events if event.kind == "override"]
    assert told.startswith("gate of stage 2 overridden (haste); open: the bone is exposed;")


def test_a_jump_asks_for_everything_on_the_way_and_going_back_for_nothing(bench: Bench) -> None:
    bench.do(EnterStage(3))
    asked = is_met(bench.snapshot)
    assert {"bone_exposed", "entry_point", "checked_on_patient"} <= set(asked)
    assert bench.do(OverrideGate(3, "practice")).stage.number == 3
    assert bench.do(EnterStage(1)).stage.number == 1


def test_cuts_must_be_made_and_measured_or_checked_by_hand(bench: Bench, faces: Faces) -> None:
    bench.do(EnterStage(3))
    bench.do(OverrideGate(3, "practice"))
    confirm(bench, "component_size")
    assert is_met(bench.snapshot)["cut top"] is False
    bench.do(ConfirmCondition("cut top"))
    assert "nobody is asked for 'cut top'" in bench.refused()
    bench.do(ConfirmStep("top"))
    bench.do(ConfirmStep("side"))
    faces.shares["top"] = 0.8
    bench.frames(31)
    lines = {line.name: line for line in bench.snapshot.gate}
    assert lines["cut top"].is_met
    assert lines["cut top"].note == "0.57 deg, -0.40 mm"
    assert not lines["cut side"].is_met
    assert "not measured" in lines["cut side"].note
    assert bench.do(EnterStage(4)).stage.number == 3
    confirm(bench, "cut side")
    assert bench.do(EnterStage(4)).stage.number == 4


def test_without_gates_nothing_is_asked_for() -> None:
    bench = navigating(Bench())
    assert bench.snapshot.is_navigable
    assert bench.snapshot.time_out == bench.snapshot.gate == ()
    assert bench.do(EnterStage(5)).stage.number == 5
    bench.do(ConfirmCondition("patient"))
    assert "nobody is asked for 'patient'" in bench.refused()


@pytest.mark.parametrize(
    "command",
    [OverrideGate(3, "a reason"), ConfirmCondition("side"), WithdrawCondition("side")],
)
def test_commands_are_recorded(command: Command) -> None:
    assert command_from_json(json.loads(json.dumps(command_to_json(command)))) == command


def test_conditions_go_by_the_time_of_pictures_so_that_they_replay(bench: Bench) -> None:
    confirm(bench, "checked_on_patient")
    bench.clock.advance_ns(31 * 60 * 10**9)
    # No picture has come since.
    assert is_met(bench.do(WithdrawCondition("nothing")))["checked_on_patient"]
    bench.frames(1)
    assert not is_met(bench.snapshot)["checked_on_patient"]


def enter_implant(bench: Bench) -> None:
    bench.do(EnterStage(3))
    bench.do(OverrideGate(3, "practice"))


def register_again(bench: Bench) -> None:
    bench.do(Register())
    bench.frames(2)
    bench.accept()


def test_a_cut_beyond_tolerance_is_not_confirmed_by_hand_after_a_new_registration(
    bench: Bench, faces: Faces
) -> None:
    enter_implant(bench)
    faces.shares["top"], faces.offset_mm = 0.8, -2.4
    bench.do(ConfirmStep("top"))
    bench.frames(31)
    assert not is_met(bench.snapshot)["cut top"]
    faces.shares["top"] = None
    register_again(bench)
    bench.do(ConfirmCondition("cut top"))
    assert "nobody is asked for 'cut top'" in bench.refused()
    assert not is_met(bench.snapshot)["cut top"]
    # One that is made again may be.
    bench.do(WithdrawStep("top"))
    bench.do(ConfirmStep("top"))
    assert is_met(confirm(bench, "cut top"))["cut top"]


def test_a_cut_that_is_made_again_is_checked_again(bench: Bench) -> None:
    enter_implant(bench)
    bench.do(ConfirmStep("top"))
    assert is_met(confirm(bench, "cut top"))["cut top"]
    bench.do(WithdrawStep("top"))
    bench.do(ConfirmStep("top"))
    assert not is_met(bench.snapshot)["cut top"]


def test_a_cut_has_a_name_of_its_own(bench: Bench) -> None:
    """The plan has a cut `side`, the time-out an item of that name."""
    enter_implant(bench)
    bench.do(ConfirmStep("side"))
    confirm(bench, "side")
    assert not is_met(bench.snapshot)["cut side"]


def test_a_check_on_the_patient_is_one_of_a_bone_and_of_its_registration(bench: Bench) -> None:
    confirm(bench, "checked_on_patient")
    assert is_met(bench.snapshot)["checked_on_patient"]
    register_again(bench)
    assert not is_met(bench.snapshot)["checked_on_patient"]
    assert "registered again" in [line.note for line in bench.snapshot.gate][-1]
    confirm(bench, "checked_on_patient")
    bench.do(EnterStage(5))
    bench.do(OverrideGate(5, "practice"))
    assert not is_met(bench.snapshot)["checked_on_patient"]


def test_an_override_passes_once_and_what_was_told_alone(bench: Bench) -> None:
    bench.do(EnterStage(2))
    bench.script.tracked = answer(Status.DEGRADED, Reason.TRE_TOO_LARGE)
    bench.frames(1)
    assert bench.do(OverrideGate(2, "haste")).stage.number == 1
    assert bench.refused() == "stage 2 drilling refused: 3 open"
    assert bench.do(OverrideGate(2, "haste")).stage.number == 2
    bench.do(EnterStage(1))
    assert bench.do(OverrideGate(2, "haste")).stage.number == 1
    assert "enter stage 2 first" in bench.refused()


def test_what_the_end_leaves_open_is_told(bench: Bench) -> None:
    bench.do(EnterStage(5))
    bench.do(OverrideGate(5, "practice"))
    assert {"checked_on_patient", "cut flat", "gaps"} == set(is_met(bench.snapshot))
    bench.do(Quit())
    told = [event.text for event in bench.events if event.kind == "gate"]
    assert "open: the gaps were measured in extension and at 90 deg" in told


def test_a_plan_without_a_model_of_the_cut_bone_answers() -> None:
    bench = navigating(Bench(plan=replace(cut_plan(), bones={"femur": cut_plan().bones["femur"]})))
    bench.do(WithdrawStep("flat"))
    assert "'flat' was not confirmed" in bench.refused()


class Holes:
    """Stands for what is measured of the mouth of a hole."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.off_mm: float | None = None
        monkeypatch.setattr(HoleMeter, "measure", self._measure)

    def _measure(self, left, right, estimate, planned) -> MeasuredHole | None:
        if self.off_mm is None:
            return None
        offset_mm, little = np.array([self.off_mm, 0.0]), 1e-4 * np.eye(3)
        return MeasuredHole(planned, planned.entry_mm, offset_mm, 8.0, little, little, 0.9)


@pytest.fixture
def holes(monkeypatch: pytest.MonkeyPatch) -> Holes:
    return Holes(monkeypatch)


@pytest.fixture
def drilling() -> Bench:
    """In the stage with a hole, whose name is that of a condition."""
    hole = DrillAxis("femur", np.array([0.0, 0.0, -20.0]), np.array([0.0, 0.0, 1.0]), 20.0, 8.0)
    content = SurgicalContent(drills={"entry_point": hole})
    bench = navigating(Bench(plan=replace(cut_plan(), content=content, digest=""), has_gates=True))
    bench.do(EnterStage(2))
    bench.do(OverrideGate(2, "practice"))
    confirm(bench, "entry_point", "checked_on_patient")
    return bench


def test_a_hole_is_made_and_measured_or_checked_by_hand(drilling: Bench, holes: Holes) -> None:
    assert is_met(drilling.snapshot) == {
        "entry_point": True, "hole entry_point": False, "checked_on_patient": True,
    }  # fmt: skip
    drilling.do(ConfirmStep("entry_point"))
    assert drilling.do(EnterStage(3)).stage.number == 2
    assert is_met(confirm(drilling, "hole entry_point"))["hole entry_point"]
    holes.off_mm = 0.4
    drilling.frames(11)
    line = {line.name: line for line in drilling.snapshot.gate}["hole entry_point"]
    assert line.is_met
    assert line.note == "0.40 mm off its entry"


def test_a_hole_beyond_tolerance_stays_so_after_a_new_registration(
    drilling: Bench, holes: Holes
) -> None:
    holes.off_mm = 3.0
    drilling.do(ConfirmStep("entry_point"))
    drilling.frames(11)
    holes.off_mm = None
    register_again(drilling)
    confirm(drilling, "checked_on_patient")
    drilling.do(ConfirmCondition("hole entry_point"))
    assert "nobody is asked for 'hole entry_point'" in drilling.refused()
    assert drilling.do(EnterStage(3)).stage.number == 2
