"""What a capture is handed: where pairs go, who solves them, who holds a simulated board."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from numpy.typing import ArrayLike

from calibration.targets.seen_pairs import SeenPair
from drivers.frames import StereoFrame
from navapp.control.capture.states import Outcome
from navapp.geometry.transform import RigidTransform

# Of the pairs; told the share done, and what that raises stops the work.
Solve = Callable[[list[SeenPair], Callable[[float], None]], Outcome]


class BoardHand(Protocol):
    """A simulated hand that holds the board."""

    def move_to(self, left_from_body: RigidTransform) -> None:
        """Go there, nearly."""
        ...

    def nudge(self, shift_mm: ArrayLike, turn_rad: ArrayLike) -> None:
        """A shift in mm and a turn in rad along the left camera's axes."""
        ...


class PairStore(Protocol):
    """Where pairs are kept."""

    def keep(self, index: int, frame: StereoFrame) -> None:
        """Write both pictures."""
        ...

    def drop(self, index: int) -> None:
        """Delete them."""
        ...


@dataclass(frozen=True, slots=True)
class CaptureSettings:
    """What is asked of a capture."""

    depth_mm: tuple[float, float]  # nearest and farthest surface of the working volume
    stop_mm: float  # enough when half of that volume has a predicted 95 % error below
    fewest_pairs: int = 8  # never enough with fewer
    # enough with so many, whatever the error; None: the error alone decides.
    n_pairs: int | None = None
