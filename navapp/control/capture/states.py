"""Commands, phases and snapshots of a guided capture."""

from dataclasses import dataclass
from enum import Enum, auto

import numpy as np
from numpy.typing import NDArray

from navapp.control.states import Progress


class CapturePhase(Enum):
    """What a capture is busy with."""

    CAPTURING = auto()
    SOLVING = auto()
    OVER = auto()


@dataclass(frozen=True, slots=True)
class Take:
    """Keep what is seen now, wherever the board is held."""


@dataclass(frozen=True, slots=True)
class DropLast:
    """Forget the last pair and delete its pictures."""


@dataclass(frozen=True, slots=True)
class Another:
    """The wanted view cannot be had: ask for one that is turned otherwise."""


@dataclass(frozen=True, slots=True)
class Finish:
    """Solve with what is kept."""


@dataclass(frozen=True, slots=True)
class Leave:
    """End."""


@dataclass(frozen=True, slots=True)
class Follow:
    """Let a simulated hand go where the board is wanted, or leave it to the keys again."""

    is_on: bool


@dataclass(frozen=True, slots=True)
class Nudge:
    """Move a simulated hand: a shift in mm and a turn in rad along the left camera's axes."""

    shift_mm: tuple[float, float, float] = (0.0, 0.0, 0.0)
    turn_rad: tuple[float, float, float] = (0.0, 0.0, 0.0)


CaptureCommand = Take | DropLast | Another | Finish | Leave | Follow | Nudge


@dataclass(frozen=True, slots=True)
class Check:
    """One condition of the automatic shutter.

    Attributes:
        name: a word.
        is_met: whether it holds.
        text: the number behind it, or what to do.
    """

    name: str
    is_met: bool
    text: str = ""


@dataclass(frozen=True, slots=True)
class Outcome:
    """What became of a solve.

    Attributes:
        is_accepted: the rig meets its limits.
        sentences: for people.
    """

    is_accepted: bool
    sentences: tuple[str, ...]


@dataclass(frozen=True, slots=True, eq=False)
class CaptureSnapshot:
    """A capture at one moment.

    Attributes:
        time_ns: of the newest frame.
        phase: what it is busy with.
        camera: its name; a simulated one begins with `sim:`.
        trouble: what is wrong with it; empty when nothing is.
        has_hand: the board is held by a simulated hand.
        is_following: that hand goes where the board is wanted.
        pictures: left and right, small, BGR, with marks and the outline of the wanted view.
        n_seen: marks in the left and right picture, of how many.
        checks: conditions of the automatic shutter.
        instruction: where the board is wanted, in words.
        n_kept: pairs.
        bound_mm: predicted 95 % error in half of the working volume; None before there is a rig.
        worst_mm: the same in nearly all of it.
        stop_mm: at which `bound_mm` the capture is enough.
        is_enough: it has been reached.
        covered: (2, 6, 8) bool, cells of the left and right picture in which marks were kept.
        progress: of the solve.
        events: newest last.
        outcome: what became of the last solve; None before.
    """

    time_ns: int
    phase: CapturePhase
    camera: str
    has_hand: bool
    is_following: bool
    pictures: tuple[NDArray[np.uint8], NDArray[np.uint8]] | None
    n_seen: tuple[int, int, int]
    checks: tuple[Check, ...]
    instruction: str
    n_kept: int
    bound_mm: float | None
    worst_mm: float | None
    stop_mm: float
    is_enough: bool
    covered: NDArray[np.bool_]
    progress: Progress | None
    events: tuple[str, ...]
    outcome: Outcome | None = None
    trouble: str = ""
