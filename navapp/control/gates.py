"""The time-out and the gates between stages: which conditions are met, and who said so.

A gate is what must be so on the way to a later stage: the exit conditions of every stage that is
left and the entry conditions of every stage that is entered. Going back is always allowed.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Protocol

from navapp.control.stages import STAGES, TIME_OUT
from navapp.control.states import ConditionLine, CutLine
from navapp.errors import UsageError
from navapp.values import Condition, ConditionKind, MeasuredFace, Plan, StageSpec

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

    def is_bone_ok(self, stage: StageSpec) -> bool:
        """Whether a stage's bone is accepted, and its newest pose is OK and not too old."""
        ...

    def cuts_of(self, stage: StageSpec) -> tuple[CutLine, ...]:
        """The cuts of a stage: planned, made, measured."""
        ...


class Gates:
    """Answers for the conditions of a session; without gates nothing is asked for.

    Args:
        plan: of the operation.
        known: to the session.
        are_asked: whether there are gates at all.
        check_minutes: how long what is repeated counts.
    """

    def __init__(self, plan: Plan, known: Known, *, are_asked: bool, check_minutes: float) -> None:
        self._plan, self._known, self._are_asked = plan, known, are_asked
        self._check_ns = round(check_minutes * _NS_PER_MINUTE)
        self._stages = tuple(plan.stage(stage) for stage in STAGES)
        self._confirmed_ns: dict[str, int] = {}

    def confirm(self, name: str) -> None:
        """A person says that a condition is met, now.

        Raises:
            UsageError: no person answers for it, or there is no such condition.
        """
        names = self._personal_names()
        if name not in names:
            remedy = f"choose one of {', '.join(names)}" if names else "nothing is asked for"
            raise UsageError(f"nobody is asked for '{name}'", subject=name, remedy=remedy)
        self._confirmed_ns[name] = self._known.time_ns

    def withdraw(self, name: str) -> None:
        """A condition is not met after all.

        Raises:
            UsageError: it was not confirmed.
        """
        if name not in self._confirmed_ns:
            raise UsageError(f"'{name}' was not confirmed", subject=name)
        del self._confirmed_ns[name]

    def time_out(self) -> tuple[ConditionLine, ...]:
        """What must be so before the first guides."""
        if not self._are_asked:
            return ()
        sides = {bone.side for bone in self._plan.bones.values() if bone.side}
        asked = {
            "patient": self._plan.name,
            "side": " and ".join(sorted(sides)).upper() or "not known",
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
                yield self._personal(condition)
            case ConditionKind.BONE_OK:
                yield ConditionLine(name, f"{stage.bone}: {text}", known.is_bone_ok(stage))
            case ConditionKind.RIG_VALID:
                yield ConditionLine(name, text, not known.rig_problem, note=known.rig_problem)
            case ConditionKind.CUTS_MEASURED:
                for cut in known.cuts_of(stage):
                    yield self._cut(cut, stage)

    def _personal(self, condition: Condition) -> ConditionLine:
        said_ns = self._confirmed_ns.get(condition.name)
        if said_ns is None:
            return ConditionLine(condition.name, condition.text, False, True)
        age_ns = self._known.time_ns - said_ns
        is_met = not condition.is_repeated or age_ns <= self._check_ns
        note = f"confirmed {age_ns // _NS_PER_MINUTE} min ago{'' if is_met else ': too old'}"
        return ConditionLine(condition.name, condition.text, is_met, True, note)

    def _cut(self, cut: CutLine, stage: StageSpec) -> ConditionLine:
        """A cut is measured within tolerance; of one that cannot be measured a person says so."""
        text = f"cut {cut.name} within tolerance"
        if not cut.is_made:
            return ConditionLine(cut.name, text, False, note="it is not confirmed as made")
        if cut.face is not None:
            is_met = is_within(cut.face, stage)
            note = f"{cut.face.angle_deg:.2f} deg, {cut.face.offset_mm:+.2f} mm"
            return ConditionLine(cut.name, text, is_met, note=note)
        is_met = cut.name in self._confirmed_ns
        note = "checked by hand" if is_met else "not measurable: check it by hand, or override"
        return ConditionLine(cut.name, text, is_met, True, note)

    def _personal_names(self) -> tuple[str, ...]:
        """All that a person may confirm."""
        if not self._are_asked:
            return ()
        asked: Sequence[Condition] = [
            *TIME_OUT, *(one for stage in self._stages for one in (*stage.entry, *stage.exit)),
        ]  # fmt: skip
        names = [one.name for one in asked if one.kind is ConditionKind.PERSON]
        names += [
            cut.name
            for stage in self._stages
            for cut in self._known.cuts_of(stage)
            if cut.is_made and cut.face is None
        ]
        return tuple(dict.fromkeys(names))


def is_within(face: MeasuredFace, stage: StageSpec) -> bool:
    """Whether a face lies within the stage's tolerance, its 95 % bounds included."""
    return (
        face.angle_deg + face.bound_deg <= stage.tolerance_deg
        and abs(face.offset_mm) + face.bound_mm <= stage.tolerance_mm
    )
