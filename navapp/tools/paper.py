"""How the printed and folded paper of a plate differs from its design.

Parameters, in this order: stretch along x, stretch along y, shear of the paper; of every marker its
shift along x and y (mm); of every face but the first its turn and shift against the design
(translation mm first, rotation rad second, in the plate's axes, about the face's middle).
"""

from dataclasses import dataclass

import numpy as np

from navapp.geometry.transform import FloatArray
from navapp.tools.plate import Plate

# Standard deviations of what is not measured: a laser printer, and paper folded by hand.
STRETCH, MARKER_MM, FOLD_MM, FOLD_RAD = 0.002, 0.04, 0.3, 0.01


@dataclass(frozen=True, slots=True, eq=False)
class Paper:
    """What is known of the paper."""

    mean: FloatArray  # (P,)
    covariance: FloatArray  # (P, P)


def count_parameters(plate: Plate) -> int:
    """P: how many numbers describe a plate's paper."""
    return 3 + 2 * len(plate.ids) + 6 * (plate.faces - 1)


def as_designed(plate: Plate) -> Paper:
    """Paper that nobody has measured."""
    sigmas = [STRETCH] * 3 + [MARKER_MM] * (2 * len(plate.ids))
    sigmas += ([FOLD_MM] * 3 + [FOLD_RAD] * 3) * (plate.faces - 1)
    return Paper(np.zeros(len(sigmas)), np.diag(np.square(sigmas)))
