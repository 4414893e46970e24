"""Cut faces, as measured against their plan."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from navapp.geometry.transform import FloatArray, read_only
from navapp.values.contents import ResectionPlane

# Of the length of two normal errors, and of the size of one: 95 % lie below so many deviations.
LENGTH_95, SIZE_95 = 2.45, 1.96
# A saw misses its plan by no more: what is flat, but lies further off, is something else; chosen.
MOST_OFF_PLAN_MM, MOST_OFF_PLAN_DEG = 4.0, 6.0
# A face of which less is seen, or that is known less well, is not told; chosen.
LEAST_SHARE, MOST_DEG, MOST_MM = 0.25, 1.0, 0.4


@dataclass(frozen=True, slots=True, eq=False)
class MeasuredFace:
    """A face that a saw left, in the bone's coordinates, beside the plane that was planned.

    It is described by three numbers: the tangents of its normal's tilts from the planned normal
    towards the two axes of the planned plane, and its distance in mm from the planned point along
    its own normal; positive: less bone is gone.
    """

    plane: ResectionPlane  # planned
    tilts_offset: FloatArray  # (3,) rad, rad, mm
    covariance: FloatArray  # (3, 3) of those numbers: the pose's errors and those of the matching
    seen_share: float  # of the whole face, 0 to 1

    def __post_init__(self) -> None:
        for name in ("tilts_offset", "covariance"):
            object.__setattr__(self, name, read_only(getattr(self, name)))

    @property
    def normal(self) -> FloatArray:
        """(3,) unit, out of the bone that stays."""
        tilted = self.plane.normal + self.tilts_offset[:2] @ self.plane.axes
        unit: FloatArray = tilted / np.linalg.norm(tilted)
        return unit

    @property
    def offset_mm(self) -> float:
        """Of the face from the planned point along its normal; positive: less bone is gone."""
        return float(self.tilts_offset[2])

    @property
    def point_mm(self) -> FloatArray:
        """(3,) of the face, beside the planned point."""
        point: FloatArray = self.plane.point_mm + self.offset_mm * self.normal
        return point

    @property
    def angle_deg(self) -> float:
        """Between the face and its plan."""
        return math.degrees(math.atan(float(np.hypot(*self.tilts_offset[:2]))))

    @property
    def bound_deg(self) -> float:
        """95 % bound of the angle between the measured and the true face."""
        largest = float(np.linalg.eigvalsh(self.covariance[:2, :2])[-1])
        return math.degrees(LENGTH_95 * math.sqrt(max(largest, 0.0)))

    @property
    def bound_mm(self) -> float:
        """95 % bound of the error of the offset."""
        return SIZE_95 * math.sqrt(max(float(self.covariance[2, 2]), 0.0))

    @property
    def is_near_plan(self) -> bool:
        """So near to its plan that a saw may have left it."""
        return abs(self.offset_mm) <= MOST_OFF_PLAN_MM and self.angle_deg <= MOST_OFF_PLAN_DEG

    @property
    def is_told(self) -> bool:
        """Known well enough to be told, and to cut the model by."""
        is_seen = self.seen_share >= LEAST_SHARE
        return is_seen and self.bound_deg <= MOST_DEG and self.bound_mm <= MOST_MM

    @property
    def as_plane(self) -> ResectionPlane:
        """The face as a plane of the planned extent."""
        return replace(self.plane, point_mm=self.point_mm, normal=self.normal)


def join_faces(faces: Sequence[MeasuredFace]) -> MeasuredFace:
    """What several measurements of one face say together.

    Each counts by the inverse of its covariance. Their errors may all go the same way, because they
    share model, rig, view and texture: what they say together is known no better than one of them.

    Raises:
        ValueError: no measurement.
    """
    if not faces:
        raise ValueError("no measurement of a face to join")
    weights = [np.linalg.inv(face.covariance) for face in faces]
    inverse = np.linalg.inv(np.sum(weights, axis=0))
    shares = [inverse @ weight for weight in weights]
    tilts_offset = np.sum(
        [share @ face.tilts_offset for share, face in zip(shares, faces, strict=True)], axis=0
    )
    covariance = _add_all_one_way(
        [share @ face.covariance @ share.T for share, face in zip(shares, faces, strict=True)]
    )
    seen_share = max(face.seen_share for face in faces)
    return MeasuredFace(faces[0].plane, tilts_offset, covariance, seen_share)


def _add_all_one_way(covariances: Sequence[FloatArray]) -> FloatArray:
    """(3, 3) of a sum of errors (3,) that may all go the same way: their deviations add up."""
    root = np.zeros((3, 3))
    for covariance in covariances:
        values, axes = np.linalg.eigh(covariance)
        root += (axes * np.sqrt(np.maximum(values, 0.0))) @ axes.T
    return root @ root
