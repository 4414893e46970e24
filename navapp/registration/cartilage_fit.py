"""A cartilage that is thicker or thinner than planned, fitted together with the pose.

Source: least squares with correlated errors of the model (generalised least squares), by unknowns
of a normal prior (docs/how/registration.md).
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.distance import cdist

from navapp.geometry.transform import FloatArray
from navapp.registration.pairing_kernels import Pairs, Pose
from navapp.registration.step_kernels import (
    FREE_FRACTION,
    apply_twist,
    find_motion_rows,
    find_weighted_centre,
    weigh,
)

# All chosen. Errors of a segmentation go together over so many mm; this share of their variance is
# common to all of a surface.
_CORRELATION_MM, _COMMON_SHARE = 15.0, 0.3
# Distance of the anchors in correlation lengths.
_ANCHOR_SPACING = 1.0
# An anchor counts where it adds so much of the deviation somewhere.
_LEAST_SHARE = 0.02
# Keeps a ratio finite where no pair has a weight.
_LEAST_MM2 = 1e-12


class KernelWidth(NamedTuple):
    """How wide the kernel of a step is."""

    narrowest_mm: float
    n_sigmas: float  # of a pair's own noise
    counts_thickness: bool  # as noise, to reach what the thickness explains


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
        seen_mm = math.sqrt(self.variance_mm2[vertices].max(initial=0.0))
        return np.flatnonzero(largest_mm > _LEAST_SHARE * seen_mm)


class ThicknessFit:
    """The thickness that a scene's pairs show, step by step with the pose.

    Attributes:
        rows_mm: (n, k) by how much the residuals of the last pairs fall with the unknowns.
        unknowns: (k,) standard normal before anything is seen; none where no cartilage is seen.
    """

    def __init__(self, field: ThicknessField, pairs: Pairs, n: int) -> None:
        self._field, self._columns = field, field.find_seen(pairs.vertex[:n])
        self.unknowns: FloatArray = np.zeros(len(self._columns))
        self.rows_mm: FloatArray = np.zeros((0, len(self._columns)))
        self._claimed_mm2: FloatArray = np.zeros(0)  # (n,) variance of the thickness

    def step(
        self, pairs: Pairs, n: int, kernel: KernelWidth, n_sharing_errors: float, pose: Pose
    ) -> tuple[float, float]:
        """Move pose and thickness by one step; the pose in place.

        The thickness so far is taken out of residuals and variances of the pairs, and they are
        weighted; in place.

        Args:
            pairs: measured at the pose.
            n: so many.
            kernel: of the weights.
            n_sharing_errors: so many neighbouring pairs have their errors in common.
            pose: that moves.

        Returns:
            Angle (rad) and length (mm) of the step.
        """
        residual_mm = pairs.residual[:n].copy()
        self._take_out(pairs, n)
        self._weigh(pairs, n, kernel)
        centre, lever_mm = find_weighted_centre(pairs, n)
        rows = np.column_stack([find_motion_rows(pairs, n, centre, lever_mm), residual_mm])
        weight = pairs.weight[:n]
        reduced, by_thickness = solve_out_thickness(rows, weight, self.rows_mm, n_sharing_errors)
        fixed = _find_fixed(rows[:, :6], weight)
        motion = -fixed @ np.linalg.solve(
            fixed.T @ reduced[:6, :6] @ fixed, fixed.T @ reduced[:6, 6]
        )
        self.unknowns = by_thickness @ np.append(motion, 1.0)
        twist = np.concatenate([motion[:3] / lever_mm, motion[3:]])
        apply_twist(twist, centre, pose)
        return float(np.linalg.norm(twist[:3])), float(np.linalg.norm(twist[3:]))

    def _take_out(self, pairs: Pairs, n: int) -> None:
        """Residuals without what the thickness explains, variances without the plan's; in place."""
        vertices = pairs.vertex[:n]
        self.rows_mm = self._field.basis_mm[np.ix_(vertices, self._columns)]
        self._claimed_mm2 = self._field.variance_mm2[vertices]
        pairs.residual[:n] -= self.rows_mm @ self.unknowns
        pairs.variance[:n] -= self._claimed_mm2

    def _weigh(self, pairs: Pairs, n: int, kernel: KernelWidth) -> None:
        """As `step_kernels.weigh`; a wide kernel counts the deviation of the thickness as noise."""
        narrow_mm2 = pairs.variance[:n].copy()
        if kernel.counts_thickness:
            pairs.variance[:n] += self._claimed_mm2
        weigh(pairs, n, kernel.narrowest_mm, kernel.n_sigmas, 0.0)
        pairs.weight[:n] *= pairs.variance[:n] / narrow_mm2
        pairs.variance[:n] = narrow_mm2

    def find_ratio(self, weight: FloatArray) -> float:
        """Rms over weighted pairs (n,) of what was fitted, over the deviation that is claimed."""
        fitted_mm2 = float(weight @ (self.rows_mm @ self.unknowns) ** 2)
        return math.sqrt(fitted_mm2 / max(float(weight @ self._claimed_mm2), _LEAST_MM2))


def _find_fixed(rows: FloatArray, weight: FloatArray) -> FloatArray:
    """(6, j) directions of a motion that the shape fixes, as `solve_step` judges them."""
    values, vectors = np.linalg.eigh(rows.T @ (weight[:, None] * rows))
    return np.asarray(vectors[:, values > FREE_FRACTION * values[-1]])


def solve_out_thickness(
    rows: FloatArray, weight: FloatArray, thickness_rows_mm: FloatArray, n_sharing_errors: float
) -> tuple[FloatArray, FloatArray]:
    """Normal equations of other unknowns, with the thickness that is best for each of them.

    Args:
        rows: (n, j) how residuals grow with the other unknowns; the residuals may be a column.
        weight: (n,) of the residuals.
        thickness_rows_mm: (n, k) how they fall with the unknowns of the thickness.
        n_sharing_errors: so many neighbouring residuals have their errors in common.

    Returns:
        (j, j) of the rows, and (k, j) the best thickness by the other unknowns.
    """
    weighted = weight[:, None] * rows
    mixed = thickness_rows_mm.T @ weighted
    # Before anything is seen each is known to be N(0, 1).
    own = thickness_rows_mm.T @ (weight[:, None] * thickness_rows_mm)
    own[np.diag_indices_from(own)] += n_sharing_errors
    by_thickness = np.asarray(np.linalg.solve(own, mixed), dtype=np.float64)
    return weighted.T @ rows - mixed.T @ by_thickness, by_thickness


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
