"""A cartilage that is thicker or thinner than planned, fitted together with the pose.

Source: least squares with correlated errors of the model (generalised least squares), by unknowns
of a normal prior (docs/how/registration.md).
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.distance import cdist

from navapp.geometry.transform import FloatArray
from navapp.registration.pairing_kernels import Pairs, Pose
from navapp.registration.step_kernels import (
    apply_twist,
    find_motion_rows,
    find_weighted_centre,
    solve_step,
    weigh,
)

# All chosen. Errors of a segmentation go together over so many mm; this share of their variance is
# common to all of a surface.
_CORRELATION_MM, _COMMON_SHARE = 15.0, 0.3
# Distance of the anchors in correlation lengths.
_ANCHOR_SPACING = 1.0
# An anchor counts where it adds so much of the deviation somewhere.
_LEAST_SHARE = 0.02


@dataclass(frozen=True, slots=True, eq=False)
class ThicknessField:
    """Errors of the planned thickness over a bone's vertices, as a smooth field.

    A plan tells one standard deviation at each vertex, and errors of neighbours go together:

        e(v) = sd(v) (sqrt(c) t_0 + sqrt(1 - c) sum_k b_k(v) t_k),   t ~ N(0, 1)

    with b_k(v) ~ exp(-|v - a_k|^2 / l^2) around anchors a_k on the surface, whose squares have the
    sum 1. Errors at a distance d are then correlated by about c + (1 - c) exp(-d^2 / (2 l^2)).
    """

    basis_mm: FloatArray  # (V, K) of each unknown
    variance_mm2: FloatArray  # (V,) of the thickness

    @classmethod
    def over(cls, points_mm: FloatArray, sd_mm: FloatArray) -> "ThicknessField | None":
        """The field over vertices (V, 3) whose thickness has deviations (V,); None without any."""
        covered = np.flatnonzero(sd_mm > 0.0)
        if len(covered) == 0:
            return None
        places_mm = points_mm[covered]
        apart_mm = cdist(places_mm, _spread_anchors(places_mm))
        bumps = np.exp(-((apart_mm / _CORRELATION_MM) ** 2))
        bumps /= np.linalg.norm(bumps, axis=1, keepdims=True)
        shares = np.column_stack(
            [np.full(len(covered), _COMMON_SHARE**0.5), (1.0 - _COMMON_SHARE) ** 0.5 * bumps]
        )
        basis_mm = np.zeros((len(points_mm), shares.shape[1]))
        basis_mm[covered] = sd_mm[covered, None] * shares
        return cls(basis_mm, sd_mm**2)

    def find_seen(self, vertices: NDArray[np.int32]) -> NDArray[np.intp]:
        """(k,) those unknowns that the thickness at vertices (n,) depends on."""
        largest_mm = np.abs(self.basis_mm[vertices]).max(axis=0, initial=0.0)
        return np.flatnonzero(largest_mm > _LEAST_SHARE * np.sqrt(self.variance_mm2.max()))


class ThicknessFit:
    """The thickness that a scene's pairs show, step by step with the pose.

    Attributes:
        rows_mm: (n, k) by how much the residuals of the last pairs fall with the unknowns.
        unknowns: (k,) standard normal before anything is seen.
    """

    def __init__(self, field: ThicknessField, pairs: Pairs, n: int) -> None:
        self._field = field
        self._basis_mm = field.basis_mm[:, field.find_seen(pairs.vertex[:n])]
        n_unknowns = self._basis_mm.shape[1]
        self.unknowns: FloatArray = np.zeros(n_unknowns)
        self.rows_mm: FloatArray = np.zeros((0, n_unknowns))
        self._claimed_mm2: FloatArray = np.zeros(0)  # (n,) variance of the thickness

    def take_out(self, pairs: Pairs, n: int) -> FloatArray:
        """Take what the thickness explains out of measured pairs; in place.

        Returns:
            (n,) the residuals as they were.
        """
        vertices = pairs.vertex[:n]
        self.rows_mm = self._basis_mm[vertices]
        self._claimed_mm2 = self._field.variance_mm2[vertices]
        residual_mm = pairs.residual[:n].copy()
        pairs.residual[:n] -= self.rows_mm @ self.unknowns
        pairs.variance[:n] -= self._claimed_mm2
        return residual_mm

    def weigh(
        self, pairs: Pairs, n: int, sigma_mm: float, n_sigmas: float, *, is_wide: bool
    ) -> None:
        """As `step_kernels.weigh`; a wide kernel counts the deviation of the thickness as noise."""
        narrow_mm2 = pairs.variance[:n].copy()
        if is_wide:
            pairs.variance[:n] += self._claimed_mm2
        weigh(pairs, n, sigma_mm, n_sigmas, 0.0)
        pairs.weight[:n] *= pairs.variance[:n] / narrow_mm2
        pairs.variance[:n] = narrow_mm2

    def step(
        self, pairs: Pairs, n: int, residual_mm: FloatArray, n_sharing_errors: float, pose: Pose
    ) -> tuple[float, float]:
        """Move pose and thickness by one step of the weighted pairs; the pose in place.

        Args:
            pairs: weighted.
            n: so many.
            residual_mm: (n,) with what the thickness explains.
            n_sharing_errors: so many neighbouring pairs have their errors in common.
            pose: that they were measured at.

        Returns:
            Angle (rad) and length (mm) of the step.
        """
        centre, lever_mm = find_weighted_centre(pairs, n)
        rows, weight = find_motion_rows(pairs, n, centre, lever_mm), pairs.weight[:n]
        weighted = weight[:, None] * rows
        by_both = -weighted.T @ self.rows_mm
        by_thickness = sum_thickness(self.rows_mm, weight, n_sharing_errors)
        pull, thickness_pull = weighted.T @ residual_mm, -self.rows_mm.T @ (weight * residual_mm)
        # The thickness that is best for each pose is put into the pose's equations.
        solved = np.linalg.solve(by_thickness, np.column_stack([by_both.T, thickness_pull]))
        information = weighted.T @ rows - by_both @ solved[:, :6]
        twist = solve_step(information, pull - by_both @ solved[:, 6], lever_mm)
        motion = np.concatenate([twist[:3] * lever_mm, twist[3:]])
        self.unknowns = -solved[:, 6] - solved[:, :6] @ motion
        apply_twist(twist, centre, pose)
        return float(np.linalg.norm(twist[:3])), float(np.linalg.norm(twist[3:]))

    def find_ratio(self, weight: FloatArray) -> float:
        """Rms over weighted pairs (n,) of what was fitted, over the deviation that is claimed."""
        fitted_mm2 = float(weight @ (self.rows_mm @ self.unknowns) ** 2)
        claimed_mm2 = float(weight @ self._claimed_mm2)
        return math.sqrt(fitted_mm2 / claimed_mm2) if claimed_mm2 > 0.0 else 0.0


def sum_thickness(rows_mm: FloatArray, weight: FloatArray, n_sharing_errors: float) -> FloatArray:
    """(k, k) information of the thickness: of weighted pairs (n, k), and what is known before."""
    information: FloatArray = rows_mm.T @ (weight[:, None] * rows_mm)
    information[np.diag_indices_from(information)] += n_sharing_errors
    return information


def _spread_anchors(places_mm: FloatArray) -> FloatArray:
    """(K, 3) of the places (V, 3): each as far as can be from those before, until all are near."""
    chosen = [0]
    nearest_mm = np.full(len(places_mm), np.inf)
    while True:
        last_mm = np.linalg.norm(places_mm - places_mm[chosen[-1]], axis=1)
        nearest_mm = np.minimum(nearest_mm, last_mm)
        farthest = int(nearest_mm.argmax())
        if nearest_mm[farthest] <= _ANCHOR_SPACING * _CORRELATION_MM:
            return places_mm[chosen]
        chosen.append(farthest)
