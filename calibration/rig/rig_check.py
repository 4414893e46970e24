"""Checks an existing rig on new views of the board."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from calibration.rig.held_out_views import look_at_rig
from calibration.rig.lengths import compute_epipolar_px, compute_length_ratios
from calibration.targets.boards import Board
from calibration.targets.seen_pairs import SeenPair
from navapp.errors import ResultError
from navapp.geometry.rig import StereoRig

# A rig that has not moved leaves no more than this beyond what it left when it was made.
_WORST_OFFSET_PX, _WORST_RMS = 0.15, 2.0
_ROUGH_RMS_PX = 0.6
_FEWEST_PAIRS, _N_SIGMAS = 3, 2.0


@dataclass(frozen=True, slots=True)
class RigCheck:
    """Result of checking a rig on new views."""

    n_pairs: int  # that saw the board
    rms_px: float  # of marks seen less predicted, only the board's poses solved for
    epipolar_rms_px: float  # of right marks from the left ones' lines
    epipolar_offset_px: float  # their median: cameras that turned against each other
    length_mean: float  # triangulated over true length on the board
    length_error: float  # its standard error
    reasons: tuple[str, ...]  # why the rig should not be used; empty when it may


def check_rig(
    board: Board, rig: StereoRig, pairs: Sequence[SeenPair], worst_length: float
) -> RigCheck:
    """Judge a rig by views that it was not solved with.

    Args:
        board: that was shown.
        rig: as its file has it.
        pairs: that saw the board.
        worst_length: share of a length, and so of a depth, that may be wrong.

    Raises:
        ResultError: no view shows the board to both cameras.
    """
    if not pairs:
        raise ResultError(
            "the board is not seen by both cameras in any pair",
            remedy="compare the board with its file, and show it whole and sharp",
        )
    rms_px = look_at_rig(board, pairs, rig)
    across = compute_epipolar_px(rig, pairs)
    ratios = compute_length_ratios(board, rig, pairs)
    mean = float(np.mean(ratios)) if len(ratios) else float("nan")
    # Lengths of one view share its errors: as many are independent as there are views.
    error = float(np.std(ratios)) / len(pairs) ** 0.5 if len(ratios) else float("nan")
    offset = float(np.median(across)) if len(across) else float("nan")
    epipolar = float(np.sqrt(np.mean(across**2))) if len(across) else float("nan")
    reasons = [
        *_of_pairs(len(pairs)),
        *_of_marks(rig, rms_px),
        *_of_rows(offset),
        *_of_lengths(mean, error, worst_length),
    ]
    return RigCheck(len(pairs), rms_px, epipolar, offset, mean, error, tuple(reasons))


def _of_pairs(n_pairs: int) -> list[str]:
    if n_pairs >= _FEWEST_PAIRS:
        return []
    return [f"only {n_pairs} pairs show the board, {_FEWEST_PAIRS} are needed"]


def _of_marks(rig: StereoRig, rms_px: float) -> list[str]:
    known = None if rig.quality is None else rig.quality.figures.get("holdout_rms_px")
    worst_px = _ROUGH_RMS_PX if known is None else max(_WORST_RMS * known, known + _WORST_OFFSET_PX)
    if rms_px <= worst_px:
        return []
    usual = "" if known is None else f", it left {known:.3f} px when it was made"
    return [f"the marks fit badly ({rms_px:.3f} px{usual})"]


def _of_rows(offset_px: float) -> list[str]:
    if abs(offset_px) <= _WORST_OFFSET_PX:
        return []
    if np.isnan(offset_px):
        return ["no mark is seen in both pictures of a pair"]
    where = "low" if offset_px > 0 else "high"
    return [
        f"the right picture shows everything {abs(offset_px):.2f} px too {where}: the cameras have "
        "turned"
    ]


def _of_lengths(mean: float, error: float, worst: float) -> list[str]:
    """A rig that cannot be told from one that is wrong is not taken for right."""
    if abs(mean - 1.0) + _N_SIGMAS * error <= worst:
        return []
    if np.isnan(mean):
        return ["no length on the board is seen in both pictures of a pair"]
    told = (
        f"a length of 100 mm on the board is measured as {100.0 * mean:.2f} +- "
        f"{100.0 * error:.2f} mm"
    )
    if abs(mean - 1.0) <= worst:
        return [f"{told}: too uncertain, more pairs are needed"]
    return [f"{told}: the cameras have turned, or the board is not as large as its file says"]
