"""How a knee bends: where its tibia may lie beside its femur.

The tibia of the plan, turned about the axis of the femur's posterior condyles, and some play of
rotation and shift. It says where to look for the tibia, never where it is.
"""

from dataclasses import dataclass
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.transform import FloatArray

# Range of flexion of a knee on the table.
FLEXION_DEG = (-5.0, 130.0)
# All chosen. A tibia differs from the bent one of the plan by no more than this: it turns about its
# own axis, rolls back, and the axis found on a femur is a few millimetres off.
_MOST_PLAY_MM, _MOST_PLAY_DEG = 10.0, 10.0
# Standard deviation of the play that is drawn, along and about each axis.
_PLAY_MM, _PLAY_DEG = 4.0, 4.0
# Vertices of the posterior condyles: above the lowest one by at most so much, and looking backwards
# and not up (LPS: y to the back, z to the head).
_CONDYLES_MM, _LEAST_BACK, _MOST_UP = 45.0, 0.15, 0.3
# The sphere is fitted so often; a vertex this far off counts half.
_N_FITS, _OFF_MM = 15, 3.0
_LEAST_VERTICES = 20  # of a condyle


class Poses(NamedTuple):
    """Poses of a tibia in femur coordinates."""

    rotations: FloatArray  # (N, 3, 3)
    shifts_mm: FloatArray  # (N, 3)

    def select(self, which: NDArray[np.generic]) -> "Poses":
        """Those of a mask (N,), or of indices."""
        return Poses(self.rotations[which], self.shifts_mm[which])


@dataclass(frozen=True, slots=True, eq=False)
class Hinge:
    """The axis about which a tibia bends, in plan coordinates."""

    centre_mm: FloatArray  # (3,) between the condyles
    axis: FloatArray  # (3,) unit, towards the patient's left: positive turns bend the knee

    @classmethod
    def of(cls, femur: TriangleMesh) -> Self | None:
        """Through the centres of the spheres that fit the two posterior condyles.

        Source: Iwaki et al. 2000 (flexion facet centres). None when the mesh has no condyles.
        """
        points_mm, normals = femur.vertices_mm, femur.normals
        is_low = points_mm[:, 2] < points_mm[:, 2].min() + _CONDYLES_MM
        middle_mm = 0.5 * (points_mm[is_low, 0].min() + points_mm[is_low, 0].max())
        is_behind = is_low & (normals[:, 1] > _LEAST_BACK) & (normals[:, 2] < _MOST_UP)
        sides = [is_behind & (sign * (points_mm[:, 0] - middle_mm) > 0.0) for sign in (-1.0, 1.0)]
        if min(np.count_nonzero(side) for side in sides) < _LEAST_VERTICES:
            return None
        right_mm, left_mm = (_fit_sphere(points_mm[side], normals[side]) for side in sides)
        across = left_mm - right_mm
        return cls(0.5 * (left_mm + right_mm), across / np.linalg.norm(across))

    def draw(self, n: int, random: np.random.Generator) -> Poses:
        """About n poses of the tibia: any flexion, and some play."""
        flexion_rad = np.radians(random.uniform(*FLEXION_DEG, n))
        play = np.radians(_PLAY_DEG) * random.standard_normal((n, 3))
        rotations = _rotate(flexion_rad[:, None] * self.axis) @ _rotate(play)
        shifts_mm = _PLAY_MM * random.standard_normal((n, 3))
        shifts_mm += self.centre_mm - rotations @ self.centre_mm
        drawn = Poses(rotations, shifts_mm)
        return drawn.select(self.allows(drawn))

    def allows(self, poses: Poses) -> NDArray[np.bool_]:
        """(N,) poses within the range of flexion and the play."""
        rotations, shifts_mm = poses
        # The turn about the axis that leaves the smallest rest.
        skewed = rotations - np.swapaxes(rotations, 1, 2)
        sines = np.stack([skewed[:, 2, 1], skewed[:, 0, 2], skewed[:, 1, 0]], axis=1) @ self.axis
        along = np.einsum("i,nij,j->n", self.axis, rotations, self.axis)
        flexion_rad = np.arctan2(sines, np.trace(rotations, axis1=1, axis2=2) - along)
        rest = np.swapaxes(_rotate(flexion_rad[:, None] * self.axis), 1, 2) @ rotations
        cosines = 0.5 * (np.trace(rest, axis1=1, axis2=2) - 1.0)
        moved_mm = np.linalg.norm(rotations @ self.centre_mm + shifts_mm - self.centre_mm, axis=1)
        low, high = np.radians(FLEXION_DEG)
        is_possible: NDArray[np.bool_] = (
            (cosines > np.cos(np.radians(_MOST_PLAY_DEG)))
            & (moved_mm < _MOST_PLAY_MM)
            & (flexion_rad > low)
            & (flexion_rad < high)
        )
        return is_possible


def _rotate(vectors: FloatArray) -> FloatArray:
    """(N, 3, 3) of rotation vectors (N, 3)."""
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.from_rotvec(vectors).as_matrix())


def _fit_sphere(points_mm: FloatArray, normals: FloatArray) -> FloatArray:
    """(3,) centre c of a sphere of radius r with p = c + r n, in reweighted least squares."""
    weights = np.ones(len(points_mm))
    centre_mm = points_mm.mean(axis=0)
    for _ in range(_N_FITS):
        share = weights / weights.sum()
        mean_mm, mean_normal = share @ points_mm, share @ normals
        off_mm, off_normal = points_mm - mean_mm, normals - mean_normal
        radius_mm = (share @ (off_mm * off_normal).sum(axis=1)) / (
            share @ (off_normal * off_normal).sum(axis=1)
        )
        centre_mm = mean_mm - radius_mm * mean_normal
        misfit_mm = np.linalg.norm(points_mm - radius_mm * normals - centre_mm, axis=1)
        weights = 1.0 / (1.0 + (misfit_mm / _OFF_MM) ** 2)
    return np.asarray(centre_mm)
