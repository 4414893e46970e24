"""Cross-validation: solves without some of the views and measures the residuals of those."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from calibration.rig.bundle_adjustment import Bundle, solve_bundle
from calibration.rig.initial_rig import start_poses
from calibration.rig.parameters import N_COEFFICIENTS, RigModel, pack
from calibration.targets.boards import Board
from calibration.targets.seen_pairs import SeenPair
from navapp.geometry.rig import StereoRig
from navapp.geometry.transform import FloatArray

N_FOLDS = 5


@dataclass(frozen=True, slots=True, eq=False)
class HeldOut:
    """Residuals of views under rigs that were solved without them."""

    # (V,) mean squared distance between marks seen and predicted, per view.
    squares_px2: FloatArray
    # (V,) the same in units of the marks' standard errors, large ones counted linearly.
    costs: FloatArray
    rigs: FloatArray  # (K, n_shared) numbers of the rigs that were solved without one fold each

    @property
    def rms_px(self) -> float:
        """Over all views."""
        return float(np.sqrt(self.squares_px2.mean()))


def hold_out(
    board: Board,
    pairs: Sequence[SeenPair],
    whole: Bundle,
    on_fold: Callable[[], None] = lambda: None,
) -> HeldOut:
    """Solve without each fold of the views in turn, and look at that fold.

    Args:
        board: that was seen.
        pairs: V views.
        whole: solved with all of them; where each solve begins.
        on_fold: told when one is done.
    """
    n_views = len(pairs)
    squares, costs, rigs = np.full(n_views, np.nan), np.full(n_views, np.nan), []
    for fold in range(min(N_FOLDS, n_views)):
        is_out = np.arange(n_views) % N_FOLDS == fold
        kept = [pair for pair, out in zip(pairs, is_out, strict=True) if not out]
        solved = solve_bundle(
            board, kept, whole.model, whole.shared, whole.left_from_board[~is_out]
        )
        rigs.append(solved.shared)
        for view in np.flatnonzero(is_out):
            judged = look_at(board, [pairs[int(view)]], solved)
            residual_px = np.vstack(judged.residuals_px[0])
            squares[view] = (residual_px**2).sum(axis=1).mean()
            costs[view] = _cost(pairs[int(view)], judged)
        on_fold()
    return HeldOut(squares, costs, np.array(rigs))


def look_at(board: Board, pairs: Sequence[SeenPair], solved: Bundle) -> Bundle:
    """Views under a rig that stays as it is: their poses, and what is left."""
    poses = start_poses(board, pairs, solved.model, solved.shared)
    return solve_bundle(board, pairs, solved.model, solved.shared, poses, is_fixed=True)


def _cost(pair: SeenPair, judged: Bundle) -> float:
    lengths = np.concatenate(
        [
            np.linalg.norm(residual_px, axis=1) / seen.sigma_px
            for residual_px, seen in zip(
                judged.residuals_px[0], (pair.left, pair.right), strict=True
            )
        ]
    )
    return float(np.minimum(lengths**2, 9.0 * np.maximum(lengths, 1.0)).mean())


def is_better(simple: HeldOut, richer: HeldOut) -> bool:
    """Whether the richer of two models predicts held-out views better, and not by chance.

    The same views judge both: the mean of their differences must exceed two standard errors, and
    a hundredth of what the simple one leaves.
    """
    gain = simple.costs - richer.costs
    error = gain.std(ddof=1) / np.sqrt(len(gain))
    return bool(gain.mean() > max(2.0 * error, 0.01 * simple.costs.mean()))


def look_at_rig(board: Board, pairs: Sequence[SeenPair], rig: StereoRig) -> float:
    """Root mean square distance px between marks seen and predicted, for a rig of a file."""
    n_used = max(rig.left.distortion.size, rig.right.distortion.size)
    n = next(one for one in N_COEFFICIENTS if one >= n_used)
    model = RigModel(n, 0, rig.width, rig.height)
    shared = pack(model, rig)
    poses = start_poses(board, pairs, model, shared)
    return solve_bundle(board, pairs, model, shared, poses, is_fixed=True).rms_px
