"""The alignments that were made."""

from dataclasses import dataclass

import numpy as np

from calibration.mirror.alignment_fit import Alignments
from navapp.geometry.transform import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class KeptCross:
    """A cross that was aligned with a corner."""

    corner: int  # its id on the board
    pixel: tuple[int, int]  # of the cross, in the picture that the display is handed
    point_mm: FloatArray  # (3,) of the corner, in the left camera's frame
    sd_mm: float  # standard error of a coordinate of it
    middle_mm: FloatArray  # (3,) of the board, then


class KeptCrosses:
    """Adds and drops."""

    def __init__(self) -> None:
        self._crosses: list[KeptCross] = []

    def __len__(self) -> int:
        return len(self._crosses)

    def add(self, cross: KeptCross) -> None:
        """Keep one."""
        self._crosses.append(cross)

    def drop_last(self) -> KeptCross | None:
        """Forget the last one; None when there is none."""
        return self._crosses.pop() if self._crosses else None

    @property
    def alignments(self) -> Alignments:
        """All of them, in their order, for a solve."""
        return Alignments(
            np.array([one.pixel for one in self._crosses], dtype=np.float64).reshape(-1, 2),
            np.array([one.point_mm for one in self._crosses]).reshape(-1, 3),
            np.array([one.sd_mm for one in self._crosses], dtype=np.float64),
        )

    @property
    def middles_mm(self) -> FloatArray:
        """(N, 3) of the board's middle at every alignment."""
        return np.array([one.middle_mm for one in self._crosses]).reshape(-1, 3)

    @property
    def corners(self) -> list[int]:
        """Ids of the corners, in their order."""
        return [one.corner for one in self._crosses]
