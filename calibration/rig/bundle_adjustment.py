"""Robust least squares for both cameras, their placement and all poses of the board at once.

Gauss-Newton with Levenberg's damping.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from calibration.rig.equilibration import compute_unit_sizes, equilibrate
from calibration.rig.linearisation import Linearisation, NormalEquations, Views
from calibration.rig.parameters import RigModel
from calibration.targets.boards import Board
from calibration.targets.seen_pairs import SeenPair
from navapp.geometry.transform import FloatArray

_MOST_STEPS, _SETTLED = 40, 1e-9
_FIRST_DAMPING, _MOST_DAMPING = 1e-4, 1e8


@dataclass(frozen=True, slots=True, eq=False)
class Bundle:
    """Result of a bundle adjustment: rig, poses of the board, information and residuals."""

    model: RigModel  # which numbers were solved for
    shared: FloatArray  # (n_shared,) `parameters` tells their order
    left_from_board: FloatArray  # (V, 6) rotation vector and translation of each view
    # (n_shared, n_shared) information about the shared numbers, the poses eliminated.
    normal: FloatArray
    # robust standard deviation of what is left, in units of the marks' standard errors.
    scale: float
    # per view (n, 2) and (m, 2): seen less predicted, left and right.
    residuals_px: list[tuple[FloatArray, FloatArray]]
    is_settled: bool  # the steps came to rest

    @property
    def covariance(self) -> FloatArray:
        """(n_shared, n_shared) of the shared numbers."""
        sizes = compute_unit_sizes(self.normal)
        scaled = equilibrate(self.normal, sizes)
        inverse = np.linalg.pinv(scaled, rcond=1e-15, hermitian=True)
        return equilibrate(inverse, sizes) * self.scale**2

    @property
    def rig_covariance(self) -> FloatArray:
        """(n_rig, n_rig) of the rig's numbers, without the board's."""
        return self.covariance[: self.model.n_rig, : self.model.n_rig]

    @property
    def rms_px(self) -> float:
        """Of all distances between marks seen and predicted, both cameras."""
        squared = [np.sum(part**2, axis=1) for pair in self.residuals_px for part in pair]
        return float(np.sqrt(np.concatenate(squared).mean()))


def solve_bundle(
    board: Board,
    pairs: Sequence[SeenPair],
    model: RigModel,
    shared: FloatArray,
    left_from_board: FloatArray,
    *,
    is_fixed: bool = False,
) -> Bundle:
    """Solve from a start nearby.

    Args:
        board: that was seen.
        pairs: V views.
        model: which numbers are solved for.
        shared: (n_shared,) start.
        left_from_board: (V, 6) start.
        is_fixed: leave the shared numbers as they are and solve for the poses alone.
    """
    views = Views.of(board, pairs, model)
    here = Linearisation(views, shared.copy(), left_from_board.copy())
    cost, normal = here.cost(here.scale), NormalEquations(here)
    damping, is_settled = _FIRST_DAMPING, False
    for _ in range(_MOST_STEPS):
        step_shared, step_poses = normal.step(damping, is_fixed)
        there = Linearisation(views, here.shared + step_shared, here.left_from_board + step_poses)
        there_cost = there.cost(here.scale)
        if there_cost <= cost * (1.0 + 1e-12):
            gain = 1.0 - there_cost / max(cost, 1e-300)
            # The next step weighs by what is left now.
            here = there
            cost, normal = here.cost(here.scale), NormalEquations(here)
            damping = max(damping * 0.1, 1e-9)
            if gain < _SETTLED:
                is_settled = True
                break
        elif damping > _MOST_DAMPING:
            is_settled = True
            break
        else:
            damping *= 10.0
    n = 2 * sum(len(pair.left.ids) + len(pair.right.ids) for pair in pairs)
    n_solved = (0 if is_fixed else model.n_shared) + left_from_board.size
    # What was solved for takes its part of the noise with it.
    scale = here.scale * (n / max(n - n_solved, 1)) ** 0.5
    return Bundle(
        model, here.shared, here.left_from_board, normal.compute_reduced_normal(), scale,
        here.residuals_px, is_settled,
    )  # fmt: skip
