"""The table of the alignment's keys, for key handling and footer."""

from dataclasses import dataclass

from navapp.control.commands import NudgeCross
from navapp.control.mirror_alignment.states import (
    AlignmentCommand,
    AlignmentPhase,
    AlignmentSnapshot,
    Another,
    Confirm,
    Follow,
    Leave,
    MoveHand,
    Save,
    TurnArrows,
    Undo,
)

_FINE_PX, _COARSE_PX, _HAND_MM = 1, 10, 20.0


@dataclass(frozen=True, slots=True)
class Key:
    """One key of the alignment and its command."""

    key: str  # as Textual names it
    command: AlignmentCommand  # what it submits
    label: str = ""  # for the footer; empty: not there by itself
    shown: str = ""  # the key for people
    is_for_hand: bool = False  # for a simulated board only


def _nudges(keys: tuple[str, str, str, str], px: int) -> tuple[Key, ...]:
    """Keys for left, right, up and down."""
    ways = ((-px, 0), (px, 0), (0, -px), (0, px))
    return tuple(Key(key, NudgeCross(*way)) for key, way in zip(keys, ways, strict=True))


KEYS = (
    *_nudges(("left", "right", "up", "down"), _FINE_PX),
    *_nudges(("shift+left", "shift+right", "shift+up", "shift+down"), _COARSE_PX),
    # For terminals that keep SHIFT and an arrow to themselves.
    *_nudges(("j", "l", "i", "k"), _COARSE_PX),
    Key("enter", Confirm(), "confirm", "ENTER"),
    Key("backspace", Undo()),
    Key("u", Undo(), "undo", "u"),
    Key("n", Another(), "other", "n"),
    Key("x", TurnArrows(columns=True), "swap left-right", "x"),
    Key("y", TurnArrows(rows=True), "swap up-down", "y"),
    Key("s", Save(), "save", "s"),
    Key("q", Leave(), "leave", "q"),
    Key("m", Follow(is_on=True), "follow", "m", is_for_hand=True),
    Key("pageup", MoveHand((0.0, 0.0, -_HAND_MM)), is_for_hand=True),
    Key("pagedown", MoveHand((0.0, 0.0, _HAND_MM)), is_for_hand=True),
)
CROSS_HINTS = (("arrows", "1 px"), ("SHIFT or ijkl", "10 px"))
HAND_HINT = ("PgUp PgDn", "board")


def is_possible(key: Key, snapshot: AlignmentSnapshot) -> bool:
    """Whether it makes sense now."""
    if key.is_for_hand:
        return snapshot.has_hand
    match key.command:
        case Leave() | TurnArrows():
            return True
        case NudgeCross() | Confirm():
            return snapshot.phase is AlignmentPhase.ALIGNING
        case Undo():
            return snapshot.n_kept > 0
        case Another():
            return snapshot.phase in (AlignmentPhase.ALIGNING, AlignmentPhase.MOVING)
        case Save():
            return snapshot.is_accepted
    return True


def command_of(key: Key, snapshot: AlignmentSnapshot) -> AlignmentCommand:
    """What it submits now: `m` lets the hand go again."""
    if isinstance(key.command, Follow):
        return Follow(is_on=not snapshot.is_following)
    return key.command
