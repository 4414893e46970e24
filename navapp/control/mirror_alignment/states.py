"""Commands, phases and snapshots of the alignment of crosses."""

from dataclasses import dataclass
from enum import Enum, auto

import numpy as np
from numpy.typing import NDArray

from calibration.mirror.alignments import (
    ACCEPT_MM,
    FEWEST_ALIGNMENTS,
    FEWEST_DEPTHS,
    LEAST_RANGE_MM,
    has_depth,
)
from navapp.control.commands import NudgeCross


class AlignmentPhase(Enum):
    """What the alignment is busy with."""

    SEEKING = auto()  # the board is not seen, or not at rest
    MOVING = auto()  # the board is wanted elsewhere
    ALIGNING = auto()  # a cross is lit for a corner
    SOLVING = auto()
    OVER = auto()


@dataclass(frozen=True, slots=True)
class Confirm:
    """The cross lies on the corner."""


@dataclass(frozen=True, slots=True)
class Undo:
    """Forget the last alignment."""


@dataclass(frozen=True, slots=True)
class Another:
    """What is wanted cannot be had: another corner, or another place of the board."""


@dataclass(frozen=True, slots=True)
class TurnArrows:
    """The cross goes the other way than the arrows say."""

    columns: bool = False  # left for right
    rows: bool = False  # up for down


@dataclass(frozen=True, slots=True)
class Save:
    """End with what was accepted."""


@dataclass(frozen=True, slots=True)
class Leave:
    """End; asks once more while alignments would be lost."""


@dataclass(frozen=True, slots=True)
class Follow:
    """Let a simulated hand go where the board is wanted, or leave it to the keys again."""

    is_on: bool


@dataclass(frozen=True, slots=True)
class MoveHand:
    """Move a simulated hand: a shift in mm along the left camera's axes."""

    shift_mm: tuple[float, float, float]


AlignmentCommand = (
    NudgeCross | Confirm | Undo | Another | TurnArrows | Save | Leave | Follow | MoveHand
)


@dataclass(frozen=True, slots=True)
class DisplayVerdict:
    """What the newest solve says."""

    error_mm: float  # predicted 95 % error at the anatomy
    is_accepted: bool
    reasons: tuple[str, ...]  # why not
    n_used: int  # alignments that agree
    strays: tuple[int, ...]  # numbers of those that do not
    sd_px: float  # of an alignment, estimated


@dataclass(frozen=True, slots=True, eq=False)
class AlignmentSnapshot:
    """The alignment at one moment."""

    time_ns: int  # on the session's clock, when it was made
    phase: AlignmentPhase
    camera: str  # its name; a simulated one begins with `sim:`
    display: str  # its name
    eye: str  # that looks: left or right
    has_hand: bool  # the board is held by a simulated hand
    is_following: bool  # that hand goes where the board is wanted
    # (h, w, 3) BGR, small: the left camera's with the corner marked; beside it the right
    # camera's, or what a simulated eye sees. None before the first frame.
    pictures: tuple[NDArray[np.uint8], NDArray[np.uint8]] | None
    has_eye: bool  # the second picture is what a simulated eye sees
    n_seen: tuple[int, int, int]  # marks in the left and right picture, of how many
    corner: int | None  # id of the one to be aligned; None while there is none
    row_column: tuple[int, int]  # of it, from 1; 0 and 0 for none
    cross_px: tuple[int, int] | None  # in the picture that the display is handed
    # flips_columns, flips_rows: the display shows what the eye reads so.
    flips: tuple[bool, bool]
    is_upside_down: bool  # the eye is told to read the display on its head
    moved_mm: float | None  # of the corner, since the cross was moved last
    is_still: bool  # the board is at rest
    instruction: str  # what to do next
    n_kept: int  # alignments
    n_depths: int  # that they lie at
    range_mm: float  # from the nearest to the farthest
    used: NDArray[np.int64]  # (3, 3) alignments in each ninth of the display, as the eye reads it
    verdict: DisplayVerdict | None  # None before there are enough
    events: tuple[str, ...]  # the last ones, newest last
    # fewest, fewest_depths, least_range_mm, limit_mm: what is asked of them.
    fewest: int = FEWEST_ALIGNMENTS
    fewest_depths: int = FEWEST_DEPTHS
    least_range_mm: float = LEAST_RANGE_MM
    limit_mm: float = ACCEPT_MM
    n_events: int = 0  # ever
    trouble: str = ""  # of a device; empty when there is none

    @property
    def is_over(self) -> bool:
        """It was left, or saved."""
        return self.phase is AlignmentPhase.OVER

    @property
    def has_depth(self) -> bool:
        """The alignments lie at enough depths."""
        return has_depth(self.n_depths, self.range_mm)

    @property
    def is_accepted(self) -> bool:
        """The newest solve meets its limits."""
        return self.verdict is not None and self.verdict.is_accepted
