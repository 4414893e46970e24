"""Who operates a replay: the recorded operator, or one that only follows."""

import argparse

from navapp.cli.session_folder import RecordedSession
from navapp.control.commands import (
    CheckMirror,
    Command,
    DistrustRig,
    Register,
    StepCommand,
)
from navapp.control.executors import Executor, InlineExecutor, RecordedExecutor
from navapp.control.operators import CombinedOperator, Operator, RecordedOperator, ReplayOperator
from navapp.values import Prior

# After which frame a session found its rig moved, and how.
MovedRig = tuple[int, DistrustRig]


def find_moved_rig(session: RecordedSession | None, options: argparse.Namespace) -> MovedRig | None:
    """What a replay has to know of its rig; None when nothing was found, or another one is used.

    What was said of the recorded rig says nothing of another one.
    """
    return None if session is None or options.rig else session.events.rig_moved


def choose_operator(
    session: RecordedSession | None, options: argparse.Namespace, follows_refused: bool
) -> tuple[Operator, Executor]:
    """The recorded operator, so that the same poses come out, or one that only follows.

    Whatever is changed, the recorded rig is believed no longer than it was, and what was cut is
    cut.
    """
    is_changed = bool(
        options.prior or options.bone or options.also or options.method or options.start
        or options.follow_refused or options.cut
    )  # fmt: skip
    if session is None or is_changed or options.order != "forward":
        plain = ReplayOperator(each_frame=options.order == "each", follows_refused=follows_refused)
        recorded = RecordedOperator(_find_facts(session, options))
        return CombinedOperator(recorded, plain), InlineExecutor()
    events = session.events
    commands = [
        (after, command)
        for after, command in events.commands
        if not (options.rig and isinstance(command, DistrustRig))
    ]
    return RecordedOperator(commands), RecordedExecutor(events.take_overs)


def _find_facts(
    session: RecordedSession | None, options: argparse.Namespace
) -> list[tuple[int, Command]]:
    """What has happened to rig and bones, whoever operates: after which frame, and what.

    To and fro a rig that has moved is warned of instead. A replay that starts later has not a
    single frame before.
    """
    if session is None:
        return []
    moved = None if options.order == "pingpong" else find_moved_rig(session, options)
    facts: list[tuple[int, Command]] = [] if moved is None else [moved]
    facts += [one for one in session.events.commands if isinstance(one[1], StepCommand)]
    return sorted(
        ((-1 if options.start > after else after, command) for after, command in facts),
        key=lambda fact: fact[0],
    )


def find_drawn_start(session: RecordedSession, prior: Prior, bone: str) -> Prior:
    """Where the recorded operator has said last that a bone is; the prior when that was never."""
    starts = [
        command.start
        for _, command in session.events.commands
        if isinstance(command, Register) and command.start and command.bone in ("", bone)
    ]
    return prior if not starts or starts[-1].is_empty else prior.replaced_by(starts[-1])


def list_warnings(session: RecordedSession | None, options: argparse.Namespace) -> tuple[str, ...]:
    """What a person has to know before the replay begins."""
    told = []
    if session is not None and not session.events.is_complete:
        told.append("the session was not recorded to its end; what there is will be replayed")
    if session is not None and any(
        isinstance(command, CheckMirror) for _, command in session.events.commands
    ):
        told.append(
            "the session was seen in the mirror; its guides are replayed over the video, also "
            "where the mirror was dark"
        )
    moved = find_moved_rig(session, options)
    if moved is not None and options.order == "pingpong":
        told.append(
            f"the session found its rig moved after frame {moved[0]} ({moved[1].why}); --order "
            "pingpong does not stop there: no pose in a later picture is to be believed"
        )
    return tuple(told)
