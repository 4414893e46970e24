"""Operators that are not people: a recording, and the plain one of a replay.

An operator sees snapshots, as a person does, and answers with commands.
"""

import json
from collections import deque
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

from navapp.control.command_files import command_from_json
from navapp.control.commands import (
    Accept,
    Command,
    DistrustRig,
    EnterStage,
    Register,
    Reject,
)
from navapp.control.states import SessionState, Snapshot
from navapp.errors import SequenceError
from navapp.values import Status


class Operator(Protocol):
    """Answers snapshots with commands."""

    def commands(self, snapshot: Snapshot) -> list[Command]:
        """The commands to give now."""
        ...


class ReplayOperator:
    """Registers, accepts what the judge does not call lost, and registers again when asked to.

    What it calls lost is rejected, or with `follows_refused` left under review: followed, and never
    accepted.
    """

    def __init__(self, *, each_frame: bool = False, follows_refused: bool = False) -> None:
        self._each_frame, self._follows_refused = each_frame, follows_refused

    def commands(self, snapshot: Snapshot) -> list[Command]:
        """Register when nothing is known, accept what is under review."""
        if snapshot.state in (SessionState.STARTING, SessionState.READY):
            return [Register()]
        if self._each_frame and snapshot.state is SessionState.REVIEW:
            return [Register()]
        if snapshot.state is SessionState.REVIEW:
            is_lost = snapshot.verdict is None or snapshot.verdict.status is Status.LOST
            if is_lost and self._follows_refused:
                return []
            return [(Reject if is_lost else Accept)(snapshot.candidate_id)]
        return []


class CombinedOperator:
    """Several operators of one session: the commands of each, in their order."""

    def __init__(self, *operators: Operator) -> None:
        self._operators = operators

    def commands(self, snapshot: Snapshot) -> list[Command]:
        """Those of all operators."""
        return [one for operator in self._operators for one in operator.commands(snapshot)]


class RecordedOperator:
    """Gives the commands of a recorded session after the same frames."""

    def __init__(self, commands: list[tuple[int, Command]]) -> None:
        self._commands = deque(commands)

    def commands(self, snapshot: Snapshot) -> list[Command]:
        """Those that were given by now."""
        due: list[Command] = []
        while self._commands and self._commands[0][0] <= snapshot.sequence:
            due.append(self._commands.popleft()[1])
        return due


@dataclass(frozen=True, slots=True)
class RecordedEvents:
    """What `events.jsonl` of a session says."""

    # (after which frame, command), without those that were refused.
    commands: list[tuple[int, Command]]
    take_overs: list[int]  # before which frames a registration's result was used
    is_complete: bool  # the recording ran to its end
    # in which frames what a search for another bone had found was used.
    other_take_overs: list[int] = field(default_factory=list)

    @property
    def rig_moved(self) -> tuple[int, DistrustRig] | None:
        """After which frame the rig was found moved first, and how; None when it was not."""
        found = ((after, one) for after, one in self.commands if isinstance(one, DistrustRig))
        return next(found, None)


def read_events(path: str | Path) -> RecordedEvents:
    """Read a session's events.

    Raises:
        SequenceError: damaged or cut short.
    """
    commands: list[tuple[int, Command]] = []
    take_overs: dict[str, list[int]] = {"take_over": [], "other_take_over": []}
    is_complete = False
    try:
        text = Path(path).read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise SequenceError(
            f"the session's events {path} cannot be read",
            subject=str(path),
            remedy="replay its pictures as a plain folder with --rig and --plan",
        ) from error
    for number, line in enumerate(text.splitlines(), start=1):
        try:
            value: dict[str, Any] = json.loads(line)
            sequence = int(value["sequence"])
        except (ValueError, KeyError, TypeError) as error:
            raise SequenceError(
                f"line {number} of {path} is damaged",
                subject=str(path),
                remedy="the session was not recorded to its end; delete that line to use the rest",
            ) from error
        if value.get("type") == "command":
            commands.append((sequence, command_from_json(value)))
        elif value.get("type") in take_overs:
            take_overs[value["type"]].append(sequence)
        elif value.get("kind") == "refused" and commands and commands[-1][0] == sequence:
            # The refusal follows its command at once. What refused it may be missing in a replay,
            # a lost camera for example, and the command would be carried out. A gate refuses again,
            # and is overridden only then.
            commands[-1:] = [one for one in commands[-1:] if isinstance(one[1], EnterStage)]
        is_complete = value.get("type") == "end"
    return RecordedEvents(
        commands, take_overs["take_over"], is_complete, take_overs["other_take_over"]
    )
