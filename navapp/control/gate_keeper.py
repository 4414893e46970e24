"""Lets a session pass from stage to stage: by gates that are met, or overridden with a reason."""

from collections.abc import Sequence

from navapp.control.gates import Gates
from navapp.control.patient_checking import PatientChecking
from navapp.control.session import Session
from navapp.control.stages import CHECKED_ON_PATIENT, STAGES
from navapp.control.states import ConditionLine, EventLevel
from navapp.errors import UsageError
from navapp.tools.patient_check import CheckAnswer
from navapp.values import StageSpec


class GateKeeper:
    """Tells what is open before a stage, and enters it when nothing is.

    Args:
        session: that passes.
        gates: of its stages.
        patient: the check on the patient, which a condition asks for.
    """

    def __init__(self, session: Session, gates: Gates, patient: PatientChecking) -> None:
        self._session, self._gates, self._patient = session, gates, patient
        # Which stage was refused last, from which one, and the names of what was open then.
        self._refused: tuple[int, int, frozenset[str]] | None = None

    @property
    def time_out(self) -> tuple[ConditionLine, ...]:
        """What must be so before the first guides."""
        return self._gates.time_out()

    @property
    def refused_stage(self) -> int | None:
        """The stage whose gate was told as not met, and may be overridden."""
        if self._refused is None or self._refused[0] != self._session.stage.number:
            return None
        return self._refused[1]

    @property
    def gate(self) -> tuple[ConditionLine, ...]:
        """What must be so before the refused stage, or else the next one or the end."""
        present = self._session.stage
        return self._gates.before(self.refused_stage or present.number + 1, present)

    def confirm(self, name: str) -> None:
        """A person says that a condition is met.

        Raises:
            UsageError: no person answers for it, or a measurement speaks against it.
        """
        if name == CHECKED_ON_PATIENT and self._patient.why_unconfirmed:
            raise UsageError(self._patient.why_unconfirmed, subject=name)
        self._gates.confirm(name)
        self._session.add_event("gate", f"confirmed: {name}")

    def withdraw(self, name: str) -> None:
        """A condition is not met after all.

        Raises:
            UsageError: it was not confirmed.
        """
        self._gates.withdraw(name)
        self._session.add_event("gate", f"withdrawn: {name}", EventLevel.WARNING)

    def take_check(self, answer: CheckAnswer) -> None:
        """A check on the patient was decided: its condition is met, or is not any more."""
        if not self._gates.knows(CHECKED_ON_PATIENT):
            return
        if answer is CheckAnswer.PASSED:
            self.confirm(CHECKED_ON_PATIENT)
        elif answer is CheckAnswer.FAILED and self._gates.is_said(CHECKED_ON_PATIENT):
            self.withdraw(CHECKED_ON_PATIENT)

    def enter(self, stage: StageSpec) -> None:
        """Enter a stage, or tell item by item why not; then its gate may be overridden."""
        gate = self._gates.before(stage.number, self._session.stage)
        open_lines = [line for line in gate if not line.is_met]
        if open_lines:
            self._refuse(stage, open_lines)
        else:
            self._pass(stage, "gate met" if gate else "")

    def override(self, stage: StageSpec, reason: str) -> None:
        """Enter a stage whatever was told as open; what has become open since is told first."""
        gate = self._gates.before(stage.number, self._session.stage)
        open_lines = [line for line in gate if not line.is_met]
        told = frozenset[str]() if self._refused is None else self._refused[2]
        if not told.issuperset(line.name for line in open_lines):
            self._refuse(stage, open_lines)
            return
        texts = "; ".join(line.text for line in open_lines)
        text = f"gate of stage {stage.number} overridden ({reason.strip()}); open: {texts}"
        self._session.add_event("override", text, EventLevel.WARNING)
        self._pass(stage, "gate overridden")

    def tell_open_at_end(self) -> None:
        """What the operation's end leaves open, when the last stage is in force."""
        present = self._session.stage
        if present.number == len(STAGES):
            self._tell_open(self._gates.before(present.number + 1, present))

    def _pass(self, stage: StageSpec, how: str) -> None:
        self._refused = None
        self._session.enter_stage(stage, how)

    def _refuse(self, stage: StageSpec, open_lines: Sequence[ConditionLine]) -> None:
        names = frozenset(line.name for line in open_lines)
        self._refused = self._session.stage.number, stage.number, names
        text = f"stage {stage.number} {stage.name} refused: {len(open_lines)} open"
        self._session.add_event("refused", text, EventLevel.WARNING)
        self._tell_open(open_lines)

    def _tell_open(self, lines: Sequence[ConditionLine]) -> None:
        for line in lines:
            if not line.is_met:
                note = f" ({line.note})" if line.note else ""
                self._session.add_event("gate", f"open: {line.text}{note}", EventLevel.WARNING)
