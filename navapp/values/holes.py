"""Drilled holes, as measured against their plan."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from navapp.geometry.transform import FloatArray, read_only
from navapp.values.contents import DrillAxis
from navapp.values.faces import LENGTH_95, SIZE_95, MeasuredFace, join_faces

# A mouth of which less is seen, or whose middle is known less well, is not told; chosen.
LEAST_SHARE, MOST_MM = 0.5, 0.5


@dataclass(frozen=True, slots=True, eq=False)
class MeasuredHole:
    """The mouth of a hole on the bone's surface, in the bone's coordinates, beside its plan.

    Its axis is not measured: what is seen of a hole says little of it.
    """

    drill: DrillAxis  # planned
    entry_mm: FloatArray  # (3,) the middle of the mouth, on the surface
    # (2,) of it from the planned entry, across the planned direction, along `drill.axes`.
    offset_mm: FloatArray
    diameter_mm: float
    # (3, 3) of offset and diameter, mm: by this pair of pictures alone, and by what others share
    # with it: the pose's error, the plan's, shading.
    matching_covariance: FloatArray
    common_covariance: FloatArray
    seen_share: float  # of the mouth's rim, 0 to 1

    def __post_init__(self) -> None:
        for name in ("entry_mm", "offset_mm", "matching_covariance", "common_covariance"):
            object.__setattr__(self, name, read_only(getattr(self, name)))

    @property
    def off_mm(self) -> float:
        """Of the mouth from the planned entry, across the planned direction."""
        return float(np.hypot(*self.offset_mm))

    @property
    def bound_mm(self) -> float:
        """95 % bound between measured and true mouth, across the planned direction."""
        both = self.matching_covariance + self.common_covariance
        largest = float(np.linalg.eigvalsh(both[:2, :2])[-1])
        return LENGTH_95 * math.sqrt(max(largest, 0.0))

    @property
    def diameter_bound_mm(self) -> float:
        """95 % bound of the error of the diameter."""
        both = self.matching_covariance + self.common_covariance
        return SIZE_95 * math.sqrt(max(float(both[2, 2]), 0.0))

    @property
    def is_told(self) -> bool:
        """Known well enough to be told."""
        return self.seen_share >= LEAST_SHARE and self.bound_mm <= MOST_MM


Measured = MeasuredFace | MeasuredHole


def join_measured(found: Sequence[Measured]) -> Measured:
    """What several measurements of one step say together.

    Raises:
        ValueError: no measurement, or of both kinds.
    """
    faces = [one for one in found if isinstance(one, MeasuredFace)]
    holes = [one for one in found if isinstance(one, MeasuredHole)]
    if faces and holes:
        raise ValueError("a step is a cut or a hole")
    return _join_holes(holes) if holes else join_faces(faces)


def _join_holes(holes: Sequence[MeasuredHole]) -> MeasuredHole:
    """Their mean: errors of single pairs average out, common ones may all go the same way."""
    return MeasuredHole(
        holes[0].drill,
        np.mean([hole.entry_mm for hole in holes], axis=0),
        np.mean([hole.offset_mm for hole in holes], axis=0),
        float(np.mean([hole.diameter_mm for hole in holes])),
        np.mean([hole.matching_covariance for hole in holes], axis=0) / len(holes),
        np.mean([hole.common_covariance for hole in holes], axis=0),
        max(hole.seen_share for hole in holes),
    )
