"""The simulated room and a session agree on what is made."""

import pytest

from navapp.cli.practice_steps import PracticeSteps
from navapp.control.commands import ConfirmStep, ReadThickness, WithdrawStep
from sim_devices.operation import State, enter

PLANNED = ("femoral_guide", "femur_distal", "femur_anterior", "femoral_implant", "tibia_proximal")
READ = (13.5, 13.75, 13.25, 14.5)


class FakeRoom:
    """The simulator's own steps, without pictures."""

    def __init__(self) -> None:
        self.state = enter("opening")

    def set_stage(self, name: str) -> frozenset[str]:
        self.state = enter(name)
        return self.state.made

    def go_on(self, name: str) -> frozenset[str]:
        self.state = self.state.go_on(name)
        return self.state.made

    def make(self, step: str) -> None:
        self.state = State(self.state.stage, self.state.made | {step})

    def unmake(self, step: str) -> None:
        self.state = State(self.state.stage, self.state.made - {step})


class Session:
    """Tells every command that is submitted, as the controller does when it handles one."""

    def __init__(self, stage: str, planned=PLANNED, thickness_mm=None) -> None:
        self.room, self.sent = FakeRoom(), []
        self.steps = PracticeSteps(self.room, planned, thickness_mm)
        self.steps.enter_stage(stage)
        assert self.sent == []
        self.steps.connect(self.submit)

    def submit(self, command) -> None:
        self.sent.append(command)
        self.steps.on_command(command, 7)

    def enter(self, stage: str) -> list:
        self.sent.clear()
        self.steps.enter_stage(stage)
        return self.sent


def test_a_session_is_told_how_its_first_stage_is_usually_entered() -> None:
    session = Session("implant")
    assert session.sent == [ConfirmStep(name) for name in sorted(PLANNED[:3])]


def test_what_the_operator_confirms_is_made_in_the_room_and_undone_when_withdrawn() -> None:
    session = Session("opening")
    assert session.enter("implant") == [ConfirmStep("femoral_guide")]
    session.submit(ConfirmStep("femur_distal"))
    assert session.room.state.made == {"femoral_guide", "femur_distal"}
    session.submit(WithdrawStep("femur_distal"))
    assert session.room.state.made == {"femoral_guide"}


def test_where_a_thickness_is_needed_the_practice_reads_it_after_the_step_is_made() -> None:
    session = Session("opening", (*PLANNED, "patella"), {"patella": READ})
    session.enter("patella")
    session.sent.clear()
    session.submit(ConfirmStep("patella"))
    assert "patella" in session.room.state.made
    assert session.sent == [ConfirmStep("patella"), ReadThickness("patella", READ)]
    # Confirmed again it is refused: nothing is read.
    session.submit(ConfirmStep("patella"))
    assert session.sent[-1] == ConfirmStep("patella")
    session.submit(WithdrawStep("patella"))
    session.submit(ConfirmStep("patella"))
    assert session.sent[-1] == ReadThickness("patella", READ)


def test_a_step_that_a_stage_took_back_is_read_again_when_it_is_confirmed_again() -> None:
    session = Session("opening", (*PLANNED, "patella"), {"patella": READ})
    session.enter("patella")
    session.submit(ConfirmStep("patella"))
    assert WithdrawStep("patella") in session.enter("implant")
    session.enter("patella")
    session.sent.clear()
    session.submit(ConfirmStep("patella"))
    assert ReadThickness("patella", READ) in session.sent


@pytest.mark.parametrize("name", ["nose", "femur_posterior"])
def test_what_the_sessions_plan_does_not_hold_is_neither_made_nor_told(name: str) -> None:
    session = Session("implant", PLANNED)
    before = session.room.state
    session.submit(ConfirmStep(name))
    assert session.room.state == before
    assert ConfirmStep("femur_posterior") not in session.sent[:-1]


def test_another_stage_is_shown_as_far_as_it_was_made() -> None:
    session = Session("opening")
    session.enter("implant")
    session.submit(ConfirmStep("femur_distal"))
    assert session.enter("spacer") == [
        ConfirmStep("femoral_implant"), ConfirmStep("femur_anterior"),
    ]  # fmt: skip
    assert {"patella", "patellar_implant"} <= session.room.state.made
    session.submit(ConfirmStep("tibia_proximal"))
    assert session.enter("implant") == [WithdrawStep("tibia_proximal")]
    assert session.enter("opening")[0] == WithdrawStep("femoral_guide")
    assert not session.room.state.made
