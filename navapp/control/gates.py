"""The time-out and the gates between stages: which conditions are met, and who said so.

A gate is what must be so on the way to a later stage, or from the last one to the operation's end:
the exit conditions of every stage that is left and the entry conditions of every stage that is
entered. Going back is always allowed.
"""

from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple, Protocol

from navapp.control.stages import STAGES, TIME_OUT
from navapp.control.states import ConditionLine, StepLine
from navapp.errors import UsageError
from navapp.values import Condition, ConditionKind, Measured, MeasuredHole, Plan, StageSpec

_NS_PER_MINUTE = 60 * 10**9


class Known(Protocol):
    """What a session knows that conditions ask for."""

    @property
    def time_ns(self) -> int:
        """Now, by the newest picture: a recorded session replays to the same answers."""
        ...

    @property
    def rig_problem(self) -> str:
        """Why the rig is not believed; empty while it is."""
        ...

    @property
    def bone(self) -> str:
        """Of the stage in force."""
        ...

    def registration_of(self, bone: str) -> int:
        """How many registrations of a bone were accepted by now."""
        ...

    def is_bone_ok(self, stage: StageSpec) -> bool:
        """Whether a stage's bone is the present one, accepted, and its newest pose is OK."""
        ...

    def steps_of(self, stage: StageSpec) -> tuple[StepLine, ...]:
        """The steps of a stage: planned, made, measured."""
        ...


class _Said(NamedTuple):
    """A person's word for a condition."""

    time_ns: int
    # The registration that was checked, or how often the step had been made; 0: it always counts.
    number: int


class Gates:
    """Answers for the conditions of a session; without gates nothing is asked for.

    Args:
        plan: of the operation.
        known: to the session.
        are_asked: whether there are gates at all.
        check_minutes: how long what is repeated counts.
        rig_made_on: day of the rig's calibration; empty when nobody said.
    """

    def __init__(
        self,
        plan: Plan,
        known: Known,
        *,
        are_asked: bool,
        check_minutes: float,
        rig_made_on: str = "",
    ) -> None:
        self._plan, self._known, self._are_asked = plan, known, are_asked
        self._check_ns = round(check_minutes * _NS_PER_MINUTE)
        self._rig_made_on = rig_made_on
        self._stages = tuple(plan.stage(stage) for stage in STAGES)
        # By the name of the condition, with its bone where it is one's.
        self._said: dict[str, _Said] = {}

    def confirm(self, name: str) -> None:
        """A person says that a condition is met, now; of a bone it is the present one.

        Raises:
            UsageError: no person answers for it, or there is no such condition.
        """
        key, number = self._find(name)
        self._said[key] = _Said(self._known.time_ns, number)

    def withdraw(self, name: str) -> None:
        """A condition is not met after all.

        Raises:
            UsageError: it was not confirmed, or there is no such condition.
        """
        key, _ = self._find(name)
        if self._said.pop(key, None) is None:
            raise UsageError(f"'{name}' was not confirmed", subject=name)

    def knows(self, name: str) -> bool:
        """Whether a person is asked for a condition."""
        return name in self._personal()

    def is_said(self, name: str) -> bool:
        """Whether a person's word for it is kept, of the present bone where it is one's."""
        return self._find(name)[0] in self._said

    def _find(self, name: str) -> tuple[str, int]:
        """Under which key what a person says of a condition is kept, and for which number."""
        bone = self._known.bone
        asked = self._personal()
        if name in asked:
            number = self._known.registration_of(bone) if asked[name].is_repeated else 0
            return _key(asked[name], bone), number
        steps = {
            _step_name(step): step.n_made
            for stage in self._stages
            for step in self._known.steps_of(stage)
            if self._are_asked and _may_be_checked_by_hand(step, stage)
        }
        if name in steps:
            return name, steps[name]
        names = ", ".join((*asked, *steps))
        remedy = f"choose one of {names}" if names else "nothing is asked for"
        raise UsageError(f"nobody is asked for '{name}'", subject=name, remedy=remedy)

    def _personal(self) -> dict[str, Condition]:
        """The conditions for which a person answers, by name."""
        if not self._are_asked:
            return {}
        asked = (*TIME_OUT, *(one for s in self._stages for one in (*s.entry, *s.exit)))
        return {one.name: one for one in asked if one.kind is ConditionKind.PERSON}

    def time_out(self) -> tuple[ConditionLine, ...]:
        """What must be so before the first guides."""
        if not self._are_asked:
            return ()
        sides = {bone.side for bone in self._plan.bones.values() if bone.side}
        asked = {
            "patient": self._plan.name,
            "side": " and ".join(sorted(sides)).upper() or "the plan does not say which",
            "plan": self._plan.digest[:8],
        }
        lines = [line for one in TIME_OUT for line in self._lines(one, self._stages[0])]
        return tuple(
            replace(line, text=f"{line.text}: {asked[line.name]}") if line.name in asked else line
            for line in lines
        )

    def before(self, number: int, present: StageSpec) -> tuple[ConditionLine, ...]:
        """What must be so on the way from the present stage to a later one; empty: nothing."""
        if not self._are_asked:
            return ()
        lines: dict[str, ConditionLine] = {}
        for stage in self._stages:
            asked: list[Condition] = []
            if present.number < stage.number <= number:
                asked += stage.entry
            if present.number <= stage.number < number:
                asked += stage.exit
            for condition in asked:
                for line in self._lines(condition, stage):
                    lines.setdefault(f"{line.name} {stage.bone}", line)
        return tuple(lines.values())

    def _lines(self, condition: Condition, stage: StageSpec) -> Iterator[ConditionLine]:
        """A condition as it stands: a line, or one for each cut."""
        known, name, text = self._known, condition.name, condition.text
        match condition.kind:
            case ConditionKind.PERSON:
                yield self._tell_said(condition, stage)
            case ConditionKind.BONE_OK:
                yield ConditionLine(name, f"{stage.bone}: {text}", known.is_bone_ok(stage))
            case ConditionKind.RIG_VALID:
                made = f"on {self._rig_made_on}" if self._rig_made_on else "nobody said when"
                note = known.rig_problem or made
                yield ConditionLine(name, text, not known.rig_problem, note=note)
            case ConditionKind.STEPS_MADE:
                for step in known.steps_of(stage):
                    yield self._tell_step(step, stage)

    def _tell_said(self, condition: Condition, stage: StageSpec) -> ConditionLine:
        """A condition for which a person answers."""
        said = self._said.get(_key(condition, stage.bone))
        text = f"{stage.bone}: {condition.text}" if condition.is_repeated else condition.text
        if said is None:
            return ConditionLine(condition.name, text, False, True)
        age_ns = self._known.time_ns - said.time_ns
        note = f"confirmed {age_ns // _NS_PER_MINUTE} min ago"
        if not condition.is_repeated:
            return ConditionLine(condition.name, text, True, True, note)
        if said.number != self._known.registration_of(stage.bone):
            note += ", before the bone was registered again"
            return ConditionLine(condition.name, text, False, True, note)
        is_met = age_ns <= self._check_ns
        return ConditionLine(
            condition.name, text, is_met, True, note + ("" if is_met else ": too old")
        )

    def _tell_step(self, step: StepLine, stage: StageSpec) -> ConditionLine:
        """Made, and within tolerance; of what cannot be measured a person says so."""
        name = _step_name(step)
        text = f"{name} within tolerance" if step.kind != "part" else f"{step.name} in its place"
        if not step.is_made:
            return ConditionLine(name, text, False, note="it is not confirmed as made")
        if step.kind == "part":
            return ConditionLine(name, text, True)
        if step.measured is not None:
            note = _tell_measured(step.measured)
            return ConditionLine(name, text, is_within(step.measured, stage), note=note)
        if not _may_be_checked_by_hand(step, stage):
            note = "it was measured beyond tolerance with an earlier registration"
            return ConditionLine(name, text, False, note=note)
        said = self._said.get(name)
        is_met = said is not None and said.number == step.n_made
        note = "checked by hand" if is_met else "not measured: check it by hand, or override"
        return ConditionLine(name, text, is_met, True, note)


def _key(condition: Condition, bone: str) -> str:
    """What is repeated is said of one bone."""
    return f"{condition.name} {bone}" if condition.is_repeated else condition.name


def _step_name(step: StepLine) -> str:
    """Of the condition: a plan may give a step the name of another condition."""
    return f"{step.kind} {step.name}"


def _may_be_checked_by_hand(step: StepLine, stage: StageSpec) -> bool:
    """A cut or hole that is not measured, nor was beyond tolerance since it was made."""
    if step.kind == "part" or not step.is_made or step.measured is not None:
        return False
    return step.last_measured is None or is_within(step.last_measured, stage)


def _tell_measured(measured: Measured) -> str:
    if isinstance(measured, MeasuredHole):
        return f"{measured.off_mm:.2f} mm off its entry"
    return f"{measured.angle_deg:.2f} deg, {measured.offset_mm:+.2f} mm"


def is_within(measured: Measured, stage: StageSpec) -> bool:
    """Whether a cut or a hole lies within the stage's tolerance, its 95 % bounds included."""
    if isinstance(measured, MeasuredHole):
        return measured.off_mm + measured.bound_mm <= stage.tolerance_mm
    return (
        measured.angle_deg + measured.bound_deg <= stage.tolerance_deg
        and abs(measured.offset_mm) + measured.bound_mm <= stage.tolerance_mm
    )
