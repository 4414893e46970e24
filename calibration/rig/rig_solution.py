"""Solves a rig from pairs of pictures of a target: drops bad pairs, chooses a model, judges it."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from calibration.rig.acceptance import (
    Coverage,
    Limits,
    compute_coverage,
    compute_shown_depth_mm,
    list_refusals,
)
from calibration.rig.bundle_adjustment import Bundle, solve_bundle
from calibration.rig.dropped_pairs import (
    FAULTS_OF_CAPTURE,
    DroppedPair,
    find_blurred_pairs,
    find_misfits,
)
from calibration.rig.held_out_views import N_FOLDS, HeldOut, hold_out, is_better, look_at
from calibration.rig.initial_rig import start_poses, start_rig
from calibration.rig.lengths import compute_epipolar_px, compute_length_ratios
from calibration.rig.parameters import RigModel, pack, unpack
from calibration.rig.uncertainty import (
    compute_bounds_mm,
    compute_triangulation_slopes,
    make_working_points_mm,
)
from calibration.targets.boards import Board
from calibration.targets.seen_pairs import SeenPair
from navapp.errors import ResultError
from navapp.geometry.rig import RigQuality, StereoRig
from navapp.geometry.transform import FloatArray

_FEWEST_TO_SOLVE = 4
_MOST_CLEANINGS = 4
_COEFFICIENTS = (4, 5, 8)
# Groups of a jackknife are few: less than this over the formal covariance may be chance.
_CHANCE = 1.3


@dataclass(frozen=True, slots=True, eq=False)
class Calibration:
    """A solved rig with its residuals, coverage and predicted errors."""

    rig: StereoRig  # with its quality record
    board: Board  # that was seen
    pairs: list[SeenPair]  # that were used
    dropped: list[DroppedPair]  # those that were not, and why
    solved: Bundle  # the bundle
    held_out: HeldOut  # what views say of rigs solved without them
    held_out_rms_px: float  # of views that were set aside, or of `held_out`
    # (n,) predicted 95 % errors of points of the working volume; none when both cameras see nothing
    # of it.
    bounds_mm: FloatArray
    points_mm: FloatArray  # (n, 3) these points, in the left camera's frame
    depth_mm: tuple[float, float]  # nearest and farthest surface of that volume
    covered: Coverage  # where and how the board was shown
    epipolar_rms_px: float  # distance of the right marks from the left marks' lines
    # of triangulated to true distances between marks of a view, all views.
    length_ratios: FloatArray


def solve_rig(
    board: Board,
    pairs: Sequence[SeenPair],
    size: tuple[int, int],
    *,
    limits: Limits | None = None,
    aside: Sequence[SeenPair] = (),
    known_distance_mm: float | None = None,
    on_progress: Callable[[float], None] = lambda share: None,
) -> Calibration:
    """Solve and judge.

    Args:
        board: that was shown.
        pairs: that saw it.
        size: width and height of a picture, px.
        limits: what is asked.
        aside: pairs that judge and are not solved with.
        known_distance_mm: measured by hand: between the cameras' centres, or from the first to the
            last mark of the board's first row; whichever is nearer is compared.
        on_progress: told the share done; what it raises stops the work.

    Raises:
        ResultError: no rig can be solved from these views at all.
    """
    limits = limits or Limits()
    work = _Work(board, size, on_progress)
    dropped = find_blurred_pairs(pairs)
    kept, solved, more = work.drop_misfits(_without(pairs, dropped))
    dropped += more
    solved, held_out = work.choose_model(kept, solved)
    depth_mm = limits.depth_mm or compute_shown_depth_mm(board, kept, solved)
    points_mm = make_working_points_mm(solved.model, solved.shared, depth_mm)
    bounds = _bounds(solved, held_out, points_mm)
    covered = compute_coverage(board, kept, solved, depth_mm)
    judged = look_at(board, aside, solved).rms_px if aside else held_out.rms_px
    worst_mm = float(np.quantile(bounds, 0.95)) if len(bounds) else None
    reasons = [
        f"pair {one.index}: {one.reason}" for one in dropped if one.fault in FAULTS_OF_CAPTURE
    ]
    reasons += list_refusals(
        board, len(kept), solved, covered, judged, worst_mm, limits, known_distance_mm
    )
    rig = unpack(solved.model, solved.shared)
    quality = RigQuality(not reasons, tuple(reasons), worst_mm)
    epipolar, ratios = compute_epipolar_px(rig, kept), compute_length_ratios(board, rig, kept)
    on_progress(1.0)
    return Calibration(
        replace(rig, quality=quality), board, kept, dropped, solved, held_out, judged, bounds,
        points_mm, depth_mm, covered, float(np.sqrt(np.mean(epipolar**2))), ratios,
    )  # fmt: skip


class _Work:
    """The steps of a calibration, with progress."""

    def __init__(
        self, board: Board, size: tuple[int, int], on_progress: Callable[[float], None]
    ) -> None:
        self._board, self._size, self._on_progress = board, size, on_progress
        self._n_done, self._n_all = 0, 1 + 4 * (N_FOLDS + 1)

    def _step(self) -> None:
        self._n_done += 1
        self._on_progress(min(self._n_done / self._n_all, 0.99))

    def drop_misfits(
        self, pairs: list[SeenPair]
    ) -> tuple[list[SeenPair], Bundle, list[DroppedPair]]:
        """The simplest model, without the pairs that do not belong."""
        dropped: list[DroppedPair] = []
        solved = self._first(pairs)
        for _ in range(_MOST_CLEANINGS):
            more = find_misfits(self._board, pairs, solved)
            if not more:
                break
            dropped += more
            pairs = _without(pairs, more)
            solved = self._first(pairs)
        self._step()
        return pairs, solved, dropped

    def _first(self, pairs: list[SeenPair]) -> Bundle:
        if len(pairs) < _FEWEST_TO_SOLVE:
            raise ResultError(
                f"the board is seen in {len(pairs)} usable pairs, "
                f"{_FEWEST_TO_SOLVE} are needed to solve anything",
                remedy="compare it with its file; show it in more places, sharp, to both cameras",
            )
        model = RigModel(_COEFFICIENTS[0], 0, *self._size)
        try:
            shared = pack(model, start_rig(self._board, pairs, self._size))
            poses = start_poses(self._board, pairs, model, shared)
            solved = solve_bundle(self._board, pairs, model, shared, poses)
            unpack(model, solved.shared)
        except (ValueError, np.linalg.LinAlgError) as error:
            raise ResultError(
                f"no rig explains these views ({error})",
                remedy="look at the pictures, and compare the board with its file",
            ) from error
        return solved

    def choose_model(self, pairs: list[SeenPair], solved: Bundle) -> tuple[Bundle, HeldOut]:
        """The richest model that predicts held-out views better than simpler ones."""
        best, best_out = solved, self._hold_out(pairs, solved)
        shaped = self._richer(pairs, best, len(self._board.points_mm), _COEFFICIENTS[0])
        best, best_out = self._better(pairs, best, best_out, shaped)
        for n_coefficients in _COEFFICIENTS[1:]:
            richer = self._richer(pairs, best, best.model.n_marks, n_coefficients)
            best, best_out = self._better(pairs, best, best_out, richer)
        return best, best_out

    def _hold_out(self, pairs: list[SeenPair], solved: Bundle) -> HeldOut:
        return hold_out(self._board, pairs, solved, on_fold=self._step)

    def _richer(
        self, pairs: list[SeenPair], solved: Bundle, n_marks: int, n_coefficients: int
    ) -> Bundle:
        model = RigModel(n_coefficients, n_marks, *self._size)
        shared = np.concatenate(
            [pack(model, unpack(solved.model, solved.shared))[: model.n_rig],
             np.zeros(model.n_shared - model.n_rig)]
        )  # fmt: skip
        richer = solve_bundle(self._board, pairs, model, shared, solved.left_from_board)
        self._step()
        return richer

    def _better(
        self, pairs: list[SeenPair], simple: Bundle, simple_out: HeldOut, richer: Bundle
    ) -> tuple[Bundle, HeldOut]:
        if not richer.is_settled:
            return simple, simple_out
        richer_out = self._hold_out(pairs, richer)
        return (richer, richer_out) if is_better(simple_out, richer_out) else (simple, simple_out)


def _without(pairs: Sequence[SeenPair], dropped: Sequence[DroppedPair]) -> list[SeenPair]:
    out = {one.index for one in dropped}
    return [pair for pair in pairs if pair.index not in out]


def _bounds(solved: Bundle, held_out: HeldOut, points_mm: FloatArray) -> FloatArray:
    """(n,) predicted 95 % errors, no smaller than what rigs solved without a fold differ by.

    The formal covariance believes that marks err independently. Where they do not (a board that
    bends, pictures in motion), rigs of different views differ by more: the jackknife sees it.
    """
    if len(points_mm) == 0:
        return np.empty(0)
    model = solved.model
    covariance = solved.rig_covariance
    formal = compute_bounds_mm(model, solved.shared, covariance, points_mm)
    slopes = compute_triangulation_slopes(model, solved.shared, points_mm)
    off = held_out.rigs[:, : model.n_rig] - held_out.rigs[:, : model.n_rig].mean(axis=0)
    moved = np.einsum("nij,kj->kni", slopes, off)
    n = len(moved)
    seen = np.sqrt((n - 1) / n * (moved**2).sum(axis=(0, 2)))
    told = np.sqrt(np.einsum("nij,jk,nik->n", slopes, covariance, slopes))
    excess = float(np.sqrt(np.mean(seen**2) / np.mean(told**2)))
    return formal * (excess if excess > _CHANCE else 1.0)
