"""A target as seen by both cameras at one instant."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibration.targets.detection import SeenBoard
from navapp.geometry.transform import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class SeenPair:
    """Marks of a target found in both pictures of one instant."""

    index: int  # number of the pair, as its files are called
    left: SeenBoard  # seen by the left camera
    right: SeenBoard  # by the right one

    def common(self) -> tuple[NDArray[np.intp], FloatArray, FloatArray]:
        """Ids (n,) of the marks that both see, and their pixels, (n, 2) left and right."""
        ids, in_left, in_right = np.intersect1d(self.left.ids, self.right.ids, return_indices=True)
        return ids, self.left.pixels[in_left], self.right.pixels[in_right]
