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
    """One condition of the automatic shutter."""

    name: str  # a word
    is_met: bool  # whether it holds
    text: str = ""  # the number behind it, or what to do


@dataclass(frozen=True, slots=True)
class Outcome:
    """What became of a solve."""

    is_accepted: bool  # the rig meets its limits
    sentences: tuple[str, ...]  # for people


@dataclass(frozen=True, slots=True, eq=False)
class CaptureSnapshot:
    """A capture at one moment."""

    time_ns: int  # of the newest frame
    phase: CapturePhase  # what it is busy with
    camera: str  # its name; a simulated one begins with `sim:`
    has_hand: bool  # the board is held by a simulated hand
    is_following: bool  # that hand goes where the board is wanted
    # left and right, small, BGR, with marks and the outline of the wanted view.
    pictures: tuple[NDArray[np.uint8], NDArray[np.uint8]] | None
    n_seen: tuple[int, int, int]  # marks in the left and right picture, of how many
    checks: tuple[Check, ...]  # conditions of the automatic shutter
    instruction: str  # where the board is wanted, in words
    n_kept: int  # pairs
    # predicted 95 % error in half of the working volume; None before there is a rig.
    bound_mm: float | None
    worst_mm: float | None  # the same in nearly all of it
    stop_mm: float  # at which `bound_mm` the capture is enough
    is_enough: bool  # it has been reached
    # (2, 6, 8) bool, cells of the left and right picture in which marks were kept.
    covered: NDArray[np.bool_]
    progress: Progress | None  # of the solve
    events: tuple[str, ...]  # the last ones, newest last
    n_events: int = 0  # ever
    outcome: Outcome | None = None  # what became of the last solve; None before
    trouble: str = ""  # what is wrong with it; empty when nothing is

    @property
    def is_over(self) -> bool:
        """It was left."""
        return self.phase is CapturePhase.OVER
