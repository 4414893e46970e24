"""The table of a capture's keys, for key handling and footer."""

import math
from dataclasses import dataclass

from navapp.control.capture.states import (
    Another,
    CaptureCommand,
    CapturePhase,
    CaptureSnapshot,
    DropLast,
    Finish,
    Follow,
    Leave,
    Nudge,
    Take,
)

_STEP_MM, _TURN_RAD = 20.0, math.radians(6.0)


@dataclass(frozen=True, slots=True)
class Key:
    """One key of the capture and its command."""

    key: str  # as Textual names it
    command: CaptureCommand  # what it submits
    label: str = ""  # for the footer; empty: not there by itself
    shown: str = ""  # the key for people
    is_for_hand: bool = False  # for a simulated board only


def _shift(key: str, *shift_mm: float) -> Key:
    x, y, z = shift_mm
    return Key(key, Nudge(shift_mm=(x, y, z)), is_for_hand=True)


def _turn(key: str, *turn_rad: float) -> Key:
    x, y, z = turn_rad
    return Key(key, Nudge(turn_rad=(x, y, z)), is_for_hand=True)


KEYS = (
    Key("space", Take(), "take", "SPACE"),
    Key("d", DropLast(), "drop", "d"),
    Key("n", Another(), "other", "n"),
    Key("f", Finish(), "finish", "f"),
    Key("q", Leave(), "leave", "q"),
    Key("m", Follow(is_on=True), "follow", "m", is_for_hand=True),
    _shift("left", -_STEP_MM, 0.0, 0.0),
    _shift("right", _STEP_MM, 0.0, 0.0),
    _shift("up", 0.0, -_STEP_MM, 0.0),
    _shift("down", 0.0, _STEP_MM, 0.0),
    _shift("plus", 0.0, 0.0, -_STEP_MM),
    _shift("minus", 0.0, 0.0, _STEP_MM),
    _turn("i", -_TURN_RAD, 0.0, 0.0),
    _turn("k", _TURN_RAD, 0.0, 0.0),
    _turn("j", 0.0, _TURN_RAD, 0.0),
    _turn("l", 0.0, -_TURN_RAD, 0.0),
    _turn("u", 0.0, 0.0, -_TURN_RAD),
    _turn("o", 0.0, 0.0, _TURN_RAD),
)
HAND_HINT = ("arrows+-ikjluo", "move")


def is_possible(key: Key, snapshot: CaptureSnapshot) -> bool:
    """Whether it makes sense now."""
    if key.is_for_hand:
        return snapshot.has_hand
    if isinstance(key.command, Leave):
        return True
    if isinstance(key.command, DropLast) and snapshot.n_kept == 0:
        return False
    return snapshot.phase is CapturePhase.CAPTURING


def command_of(key: Key, snapshot: CaptureSnapshot) -> CaptureCommand:
    """What it submits now: `m` lets the hand go again."""
    if isinstance(key.command, Follow):
        return Follow(is_on=not snapshot.is_following)
    return key.command
