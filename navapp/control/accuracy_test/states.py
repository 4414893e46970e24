"""Commands and snapshots of an accuracy test."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.transform import FloatArray
from navapp.tools.accuracy_tasks import Task


@dataclass(frozen=True, slots=True, eq=False)
class TakenTip:
    """Where the tip was in one pair of pictures, for a task."""

    task: Task
    tip_mm: FloatArray  # (3,) left camera
    bound_mm: float  # 95 %, as the tool says
    captured_ns: int


@dataclass(frozen=True, slots=True)
class Take:
    """The tip stands as it is asked for: take it from the next pictures."""


@dataclass(frozen=True, slots=True)
class Back:
    """Forget the last task, and do it again."""


@dataclass(frozen=True, slots=True)
class Leave:
    """End; what was taken is kept."""


AccuracyCommand = Take | Back | Leave


@dataclass(frozen=True, slots=True, eq=False)
class AccuracySnapshot:
    """An accuracy test at one moment."""

    time_ns: int
    camera: str  # its name; a simulated one begins with `sim:`
    pictures: tuple[NDArray[np.uint8], NDArray[np.uint8]] | None
    task: Task | None  # None: all are done
    n_kept: int  # tasks done
    n_tasks: int
    share: float  # of the task that is being taken; 0: it is not
    is_taking: bool
    missing: str  # why the tool is not seen; empty while it is
    bound_mm: float | None  # of the tip in the newest pair
    events: tuple[str, ...]
    n_events: int
    was_left: bool = False

    @property
    def is_over(self) -> bool:
        """Done or left."""
        return self.task is None or self.was_left
