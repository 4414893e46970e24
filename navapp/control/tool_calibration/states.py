"""Commands, phases and snapshots of a tool's calibration."""

from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray


class ToolPhase(Enum):
    """What the operator is asked for."""

    PIVOT = "pivot"
    FIRST_TURN = "first turn"
    SECOND_TURN = "second turn"
    DONE = "done"
    OVER = "over"


@dataclass(frozen=True, slots=True)
class Finish:
    """Take what there is, if it is enough to solve."""


@dataclass(frozen=True, slots=True)
class Again:
    """Forget the poses and begin anew."""


@dataclass(frozen=True, slots=True)
class Leave:
    """End without a tool."""


ToolCommand = Finish | Again | Leave


@dataclass(frozen=True, slots=True, eq=False)
class ToolSnapshot:
    """A tool's calibration at one moment."""

    time_ns: int  # of the newest frame
    phase: ToolPhase
    camera: str  # its name; a simulated one begins with `sim:`
    pictures: tuple[NDArray[np.uint8], NDArray[np.uint8]] | None  # left and right, BGR
    instruction: str  # what to do now, in words
    missing: str  # why the plate is not seen in the newest pair; empty while it is
    seen_share: float  # of the plate's edges, 0 while it is not seen
    n_poses: int  # kept so far
    n_kept: int  # parts that are done: tip, turns
    half_angle_deg: float | None  # by which the tool was leaned; None before there is a tip
    tip_mm: tuple[float, float, float] | None  # in the plate's frame
    bound_mm: float | None  # 95 % bound of the tip
    stop_mm: float  # at which bound the tip is good enough
    swept_deg: float  # of the turn that is under way
    turn_deg: float  # that is asked for
    events: tuple[str, ...]
    n_events: int
    trouble: str = ""  # of the camera

    @property
    def is_over(self) -> bool:
        """It was finished or left."""
        return self.phase in (ToolPhase.DONE, ToolPhase.OVER)
