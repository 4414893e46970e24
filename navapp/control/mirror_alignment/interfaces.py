"""What the alignment of crosses is handed."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from numpy.typing import ArrayLike

from calibration.mirror.alignment_fit import Alignments
from calibration.mirror.alignment_start import AlignedDisplay
from calibration.mirror.alignments import AlignedCalibration

Solve = Callable[[AlignedDisplay, Alignments], AlignedCalibration]
# Takes the alignments that were made so far; raises `InputError` when they cannot be kept.
Store = Callable[[AlignedDisplay, Alignments], None]


class MovingHand(Protocol):
    """A simulated hand that holds the board."""

    def nudge(self, shift_mm: ArrayLike, turn_rad: ArrayLike) -> None:
        """A shift in mm and a turn in rad along the left camera's axes."""
        ...


@dataclass(frozen=True, slots=True)
class AlignmentSettings:
    """What is asked of the alignment."""

    display: AlignedDisplay  # that shows the crosses
    valid_ms: float = 500.0  # a cross without a newer picture turns black after this
    keeps_few: bool = False  # fewer alignments than a solve needs are kept when it ends
    replaces: str = ""  # name of the display's file that is there already
    seed: int = 0  # of where a cross is lit beside its corner
