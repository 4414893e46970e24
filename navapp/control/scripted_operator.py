"""An operator that follows a script, for sessions without a screen."""

from collections import deque
from collections.abc import Mapping
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from navapp.config import Section, validate
from navapp.control.commands import (
    Accept,
    Blank,
    Command,
    ConfirmCondition,
    ConfirmStep,
    EnterStage,
    OverrideGate,
    Propose,
    Quit,
    ReadThickness,
    Register,
    Reject,
    Show,
    StepCommand,
    WithdrawCondition,
    WithdrawStep,
)
from navapp.control.stages import TIME_OUT, stage_by_name
from navapp.control.states import SessionState, Snapshot
from navapp.errors import ConfigurationError
from navapp.values import ConditionKind, Prior, Status

_MAX_ATTEMPTS = 8
_MAY_REGISTER = (SessionState.READY, SessionState.SUSPENDED, SessionState.NAVIGATING)
# What a step waits for besides a state of the session.
_GUIDES, _DARK, _MEASURED, _GATE = "guides", "dark", "measured", "gate"


class ScriptStep(Section):
    """One line of an operator's script."""

    do: Literal[
        "register",
        "propose",
        "confirm",
        "withdraw",
        "stage",
        "override",
        "made",
        "unmade",
        "thickness",
        "blank",
        "show",
        "wait",
        "expect",
        "quit",
    ]
    """propose offers the found pose, turned, to see the judge refuse it; wait goes on when the
    session is there, expect when a text is told; both fail when that takes too many frames."""
    box: tuple[int, int, int, int] | None = None
    """Of register: drawn around the bone in the left picture: x, y, width, height in px."""
    turn_deg: float = 15.0
    """Of a proposed pose."""
    stage: str = ""
    """Of stage and override: name or number."""
    name: str = ""
    """Of confirm and withdraw: the condition; of made, unmade and thickness: the cut, hole or
    part."""
    thickness_mm: tuple[float, ...] = ()
    """Of thickness: what a caliper reads below the cut, in the order of docs/resection.md."""
    reason: str = ""
    """Of override."""
    until: str = ""
    """Of wait: a state of the session, or guides, dark, measured (every cut and hole that was
    made), gate (nothing is open before the next stage or the end)."""
    text: str = ""
    """Of expect: part of a reason on the screen, or of an event since the step before."""
    frames: Annotated[int, Field(ge=1)] = 60
    """Of wait and expect: the most that it may take."""
    at_frame: Annotated[int, Field(ge=0)] = 0
    """Not before this frame."""

    def __str__(self) -> str:
        """For people."""
        words = (self.do, self.stage, self.name, self.until, self.text)
        return " ".join(word for word in words if word)


class Script(Section):
    """An operator's script as a TOML file holds it."""

    step: Annotated[tuple[ScriptStep, ...], Field(min_length=1)]
    """[[step]] tables, in order."""


# Goes through the time-out, then offers a wrong pose, which the judge must refuse.
DEFAULT_SCRIPT = (
    *(
        ScriptStep(do="confirm", name=one.name)
        for one in TIME_OUT
        if one.kind is ConditionKind.PERSON
    ),
    ScriptStep(do="propose"),
    ScriptStep(do="register"),
)


class ScriptedOperator:
    """Follows a script; accepts a candidate only when the judge says OK, rejects all others.

    Attributes:
        failure: why the script ended before its end; empty when it did not.
    """

    def __init__(self, steps: tuple[ScriptStep, ...] = DEFAULT_SCRIPT) -> None:
        self.failure = ""
        self._steps = deque(steps)
        self._n_steps = len(steps)
        self._n_attempts = 0
        self._phase: Literal["idle", "registering", "proposed"] = "idle"
        self._since_frame: int | None = None
        self._told_ns = 0
        # The stage that was asked for last, until it is known whether it was entered.
        self._entering: int | None = None
        # What was given last is a word of a person, which may be refused.
        self._is_word = False

    def commands(self, snapshot: Snapshot) -> list[Command]:
        """The next action of the script, when its time has come; a script that failed ends."""
        if snapshot.state is SessionState.REVIEW:
            return self._decide(snapshot)
        self._check_entered(snapshot)
        self._check_obeyed(snapshot)
        if self.failure:
            return [Quit()]
        if not self._steps or snapshot.sequence < self._steps[0].at_frame:
            return []
        step = self._steps[0]
        if step.do in ("register", "propose"):
            return self._begin(snapshot)
        if step.do in ("wait", "expect"):
            self._look(step, snapshot)
            return []
        self._next_step()
        self._told_ns = snapshot.time_ns
        command = _command_of(step)
        if isinstance(command, EnterStage | OverrideGate):
            self._entering = command.number
        # A session without gates asks for nothing, and says so of every condition.
        is_asked = isinstance(command, ConfirmCondition | WithdrawCondition) and snapshot.time_out
        self._is_word = isinstance(command, StepCommand) or bool(is_asked)
        return [command]

    @property
    def unfinished(self) -> str:
        """What of the script was not done; empty when nothing is left."""
        if not self._steps:
            return ""
        number = self._n_steps - len(self._steps) + 1
        return f"the session ended before step {number} of the operator's script ({self._steps[0]})"

    def _check_entered(self, snapshot: Snapshot) -> None:
        """A gate that refuses ends the script, unless its next step expects or overrides that."""
        number, self._entering = self._entering, None
        if number is None or snapshot.stage.number == number:
            return
        if not (self._steps and self._steps[0].do in ("expect", "override")):
            why = "; ".join(line.text for line in snapshot.gate if not line.is_met)
            number = self._n_steps - len(self._steps)
            self.failure = f"step {number} of the operator's script: refused, open: {why}"
            self._steps.clear()

    def _check_obeyed(self, snapshot: Snapshot) -> None:
        """A word that is refused ends the script, unless its next step expects that."""
        is_word, self._is_word = self._is_word, False
        if not is_word or (self._steps and self._steps[0].do == "expect"):
            return
        for event in snapshot.events:
            if event.kind == "refused" and event.time_ns >= self._told_ns:
                number = self._n_steps - len(self._steps)
                self.failure = f"step {number} of the operator's script: {event.text}"
                self._steps.clear()
                return

    def _begin(self, snapshot: Snapshot) -> list[Command]:
        if snapshot.state not in _MAY_REGISTER:
            return []
        self._n_attempts += 1
        if self._n_attempts > _MAX_ATTEMPTS:
            self._fail(f"no pose was OK in {_MAX_ATTEMPTS} registrations")
            return []
        self._phase = "registering"
        box = self._steps[0].box if self._steps else None
        return [Register(None if box is None else Prior(box=box))]

    def _look(self, step: ScriptStep, snapshot: Snapshot) -> None:
        """Go on when what is waited for is there."""
        since = snapshot.sequence if self._since_frame is None else self._since_frame
        self._since_frame = since
        is_there = self._is_told(step.text, snapshot) if step.do == "expect" else False
        if is_there or (step.do == "wait" and _is_there(step.until, snapshot)):
            self._next_step()
        elif snapshot.sequence - since > step.frames:
            said = ", ".join(reason.value for reason in snapshot.reasons) or "guides are shown"
            self._fail(f"not within {step.frames} frames; {snapshot.state.value}: {said}")

    def _is_told(self, text: str, snapshot: Snapshot) -> bool:
        reasons = [reason.value for reason in snapshot.reasons]
        events = [event.text for event in snapshot.events if event.time_ns >= self._told_ns]
        return any(text in said for said in (*reasons, *events))

    def _decide(self, snapshot: Snapshot) -> list[Command]:
        """On a candidate: turn it, accept it or reject it."""
        if snapshot.verdict is None:
            return []
        step = self._steps[0] if self._steps else ScriptStep(do="register")
        pose = snapshot.left_from_bone
        if step.do == "propose" and self._phase == "registering" and pose is not None:
            self._phase = "proposed"
            turn = np.array([0.0, 0.0, 0.0, np.radians(step.turn_deg), 0.0, 0.0])
            # About a point of the bone: where the model's origin is, in the camera.
            return [Reject(snapshot.candidate_id), Propose(pose.move(turn, pose.translation_mm))]
        if snapshot.verdict.status is not Status.OK:
            if self._phase == "proposed":
                self._next_step()
            return [Reject(snapshot.candidate_id)]
        if step.do in ("register", "propose"):
            self._next_step()
        return [Accept(snapshot.candidate_id)]

    def _next_step(self) -> None:
        self._phase = "idle"
        self._n_attempts, self._since_frame = 0, None
        if self._steps:
            self._steps.popleft()

    def _fail(self, why: str) -> None:
        number = self._n_steps - len(self._steps) + 1
        self.failure = f"step {number} of the operator's script ({self._steps[0]}): {why}"
        self._steps.clear()


def _command_of(step: ScriptStep) -> Command:
    """What a step that waits for nothing asks for."""
    match step.do:
        case "stage":
            return EnterStage(stage_by_name(step.stage).number)
        case "override":
            return OverrideGate(stage_by_name(step.stage).number, step.reason)
        case "confirm":
            return ConfirmCondition(step.name)
        case "withdraw":
            return WithdrawCondition(step.name)
        case "made":
            return ConfirmStep(step.name)
        case "unmade":
            return WithdrawStep(step.name)
        case "thickness":
            return ReadThickness(step.name, step.thickness_mm)
        case "blank":
            return Blank()
        case "show":
            return Show()
        case "quit":
            return Quit()
    raise ValueError(f"the step '{step.do}' is no command")


def _is_there(until: str, snapshot: Snapshot) -> bool:
    if until == _GUIDES:
        return snapshot.is_navigable
    if until == _DARK:
        return not snapshot.is_navigable
    if until == _GATE:
        return all(line.is_met for line in snapshot.gate)
    if until == _MEASURED:
        made = [step for step in snapshot.steps if step.is_made and step.kind != "part"]
        return bool(made) and all(step.measured is not None for step in made)
    return snapshot.state.value == until


def read_script(content: Mapping[str, Any], name: str) -> tuple[ScriptStep, ...]:
    """Steps of an operator's script: `[[step]]` tables with the keys of `ScriptStep`.

    Raises:
        ConfigurationError: an unknown key, action or stage, or a step that lacks what it needs.
    """
    steps = validate(Script, content, name).step
    # What is under review is decided at once: nobody could wait for it.
    states = (state.value for state in SessionState if state is not SessionState.REVIEW)
    waited = {_GUIDES, _DARK, _MEASURED, _GATE, *states}
    for number, step in enumerate(steps, start=1):
        if step.do in ("stage", "override"):
            stage_by_name(step.stage)
        needed = _NEEDED.get(step.do, "")
        if needed and not getattr(step, needed):
            raise ConfigurationError(
                f"step {number} of {name} has no '{needed}'",
                subject=name,
                remedy=f"'{step.do}' needs it",
            )
        if step.box is not None and (step.do != "register" or min(step.box[2:]) < 1):
            raise ConfigurationError(
                f"step {number} of {name} has a 'box' that means nothing",
                subject=name,
                remedy="'register' takes one: x, y, width, height in px",
            )
        if step.do == "wait" and step.until not in waited:
            raise ConfigurationError(
                f"step {number} of {name} waits for '{step.until}', which does not exist",
                subject=name,
                remedy=f"use one of {', '.join(sorted(waited))}",
            )
    return steps


# What each action cannot do without.
_NEEDED = {
    "confirm": "name",
    "withdraw": "name",
    "made": "name",
    "unmade": "name",
    "thickness": "thickness_mm",
    "override": "reason",
    "wait": "until",
    "expect": "text",
}
