"""Limits that a calibration has to meet, and the sentences that say which it does not."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibration.rig.bundle_adjustment import Bundle
from calibration.rig.initial_rig import matrix_of
from calibration.rig.parameters import unpack, unpack_placement, unpack_shape_mm
from calibration.rig.uncertainty import make_working_points_mm
from calibration.targets.boards import Board
from calibration.targets.seen_pairs import SeenPair
from navapp.geometry.transform import FloatArray

_CELLS_X, _CELLS_Y = 8, 6
# Points of the working volume enough that no cell lies between them.
_FINENESS = 3


@dataclass(frozen=True, slots=True)
class Limits:
    """Limits that a calibration has to meet."""

    fewest_pairs: int = 8  # that must be used
    # share of the cells of a picture, of those where the working volume is seen, that must hold
    # marks.
    least_coverage: float = 0.5
    # a third of the views must show the board turned out of the picture's plane by as much.
    least_tilt_deg: float = 12.0
    worst_rms_px: float = 0.6  # of what is left
    worst_held_out: float = 1.5  # held-out over solved residuals
    accept_mm: float = 0.40  # largest predicted 95 % error in the working volume
    known_fraction: float = 0.005  # largest difference from a length that is known
    # nearest and farthest surface of the working volume; None: where the board was.
    depth_mm: tuple[float, float] | None = (350.0, 550.0)


@dataclass(frozen=True, slots=True)
class Coverage:
    """How well the views cover the pictures, depths and tilts."""

    # left, right: shares of the cells that the working volume needs, with marks in them.
    left: float
    right: float
    bare: NDArray[np.bool_]  # (2, 6, 8) bool, left and right: cells that it needs, without any
    depth_mm: tuple[float, float]  # nearest and farthest mark
    # (V,) of the board's normal against the optical axis, per view; of both cameras the smaller. A
    # board parallel to the picture tells no focal length, wherever it is.
    tilts_deg: FloatArray


def compute_shown_depth_mm(
    board: Board, pairs: Sequence[SeenPair], solved: Bundle
) -> tuple[float, float]:
    """Nearest and farthest mark that the left camera saw."""
    depths = [
        (board.points_mm[pair.left.ids] @ pose[:3, :3].T + pose[:3, 3])[:, 2]
        for pair, pose in zip(pairs, map(matrix_of, solved.left_from_board), strict=True)
    ]
    return float(min(one.min() for one in depths)), float(max(one.max() for one in depths))


def compute_coverage(
    board: Board, pairs: Sequence[SeenPair], solved: Bundle, working_depth_mm: tuple[float, float]
) -> Coverage:
    """How well the views cover what the rig will be used for."""
    size = (solved.model.width, solved.model.height)
    rig = unpack(solved.model, solved.shared)
    points_mm = make_working_points_mm(solved.model, solved.shared, working_depth_mm, _FINENESS)
    needed = (rig.left.project(points_mm), rig.right.project(rig.right_from_left.apply(points_mm)))
    shares, bare = [], []
    for side, wanted in zip(("left", "right"), needed, strict=True):
        asked = find_occupied_cells(wanted, size)
        marked = find_occupied_cells(
            np.vstack([getattr(pair, side).pixels for pair in pairs]), size
        )
        shares.append(float((marked & asked).sum() / max(asked.sum(), 1)))
        bare.append(asked & ~marked)
    # The board's normal in the left camera; both axes are the last rows of their rotations.
    normals = np.array([matrix_of(vector)[:3, 2] for vector in solved.left_from_board])
    axes = np.array([[0.0, 0.0, 1.0], rig.right_from_left.rotation[2]])
    tilts = np.degrees(np.arccos(np.minimum(np.abs(normals @ axes.T).max(axis=1), 1.0)))
    shown_mm = compute_shown_depth_mm(board, pairs, solved)
    return Coverage(shares[0], shares[1], np.array(bare), shown_mm, tilts)


def find_occupied_cells(pixels: FloatArray, size: tuple[int, int]) -> NDArray[np.bool_]:
    """(6, 8) bool: cells of a picture with at least one of the pixels (n, 2) in them."""
    cells = np.zeros((_CELLS_Y, _CELLS_X), dtype=bool)
    pixels = pixels[np.isfinite(pixels).all(axis=1)]
    x = np.floor(pixels[:, 0] / size[0] * _CELLS_X).astype(int)
    y = np.floor(pixels[:, 1] / size[1] * _CELLS_Y).astype(int)
    is_inside = (x >= 0) & (x < _CELLS_X) & (y >= 0) & (y < _CELLS_Y)
    cells[y[is_inside], x[is_inside]] = True
    return cells


def list_refusals(
    board: Board,
    n_pairs: int,
    solved: Bundle,
    covered: Coverage,
    held_out_rms_px: float,
    bound_mm: float | None,
    limits: Limits,
    known_distance_mm: float | None,
) -> list[str]:
    """Why a calibration is not accepted; empty when it is. One sentence each.

    Args:
        board: that was shown.
        n_pairs: that were used.
        solved: with them.
        covered: where and how they show the board.
        held_out_rms_px: of views that the rig was not solved with.
        bound_mm: predicted 95 % error in nearly all of the working volume; None: neither camera
            sees a part of it that the other one sees.
        limits: what is asked.
        known_distance_mm: a length that was measured by hand.
    """
    few = []
    if n_pairs < limits.fewest_pairs:
        few = [f"only {n_pairs} pairs can be used, {limits.fewest_pairs} are needed"]
    if not solved.rms_px <= limits.worst_rms_px:
        # All else would be told of a rig that is none.
        return [
            *few,
            f"the marks fit badly ({solved.rms_px:.2f} px rms, {limits.worst_rms_px:.2f} px are "
            "allowed): pictures of different instants, or not the board of its file",
        ]
    return [
        *few,
        *_of_sides(solved),
        *_of_views(covered, limits),
        *_of_prediction(solved, held_out_rms_px, bound_mm, limits),
        *_of_known_distance(board, solved, known_distance_mm, limits.known_fraction),
    ]


def _of_sides(solved: Bundle) -> list[str]:
    _, translation_mm = unpack_placement(solved.model, solved.shared)
    if translation_mm[0] <= 0.0:
        return []
    return ["the right camera stands left of the left one: left and right pictures are swapped"]


def _of_views(covered: Coverage, limits: Limits) -> list[str]:
    """Where and how the board was shown."""
    reasons = []
    turned = float(np.quantile(covered.tilts_deg, 2.0 / 3.0))
    if turned < limits.least_tilt_deg:
        reasons.append(
            f"the board was shown frontally: two thirds of the views are tilted by less than "
            f"{turned:.0f} deg, a third should be by more than {limits.least_tilt_deg:.0f} deg"
        )
    for side in ("left", "right"):
        share = getattr(covered, side)
        if share < limits.least_coverage:
            reasons.append(
                f"the board was shown in one part of the {side} picture only: its marks cover "
                f"{100 * share:.0f} % of where the working volume is seen, "
                f"{100 * limits.least_coverage:.0f} % are needed"
            )
    return reasons


def _of_prediction(
    solved: Bundle, held_out_rms_px: float, bound_mm: float | None, limits: Limits
) -> list[str]:
    """What the rig is worth on other views, and in the working volume."""
    reasons = []
    if not solved.is_settled:
        reasons.append("the solve did not come to rest: the views do not fix the rig")
    if not held_out_rms_px <= limits.worst_held_out * solved.rms_px:
        reasons.append(
            f"held-out views fit worse ({held_out_rms_px:.3f} px) than those solved with "
            f"({solved.rms_px:.3f} px)"
        )
    if bound_mm is None:
        reasons.append("no part of the working volume is seen by both cameras")
    elif not bound_mm <= limits.accept_mm:
        reasons.append(
            f"the predicted 95 % error in the working volume is {bound_mm:.2f} mm, "
            f"{limits.accept_mm:.2f} mm are allowed"
        )
    return reasons


def _of_known_distance(
    board: Board, solved: Bundle, known_mm: float | None, allowed: float
) -> list[str]:
    """A length that was measured by hand: between the cameras, or along the board."""
    if known_mm is None:
        return []
    model = solved.model
    baseline_mm = float(np.linalg.norm(unpack_placement(model, solved.shared)[1]))
    row = board.points_mm[: board.columns - int(board.has_squares)]
    off = (
        unpack_shape_mm(model, solved.shared)[: len(row)]
        if model.n_marks
        else np.zeros((len(row), 3))
    )
    row_mm = float(np.linalg.norm((row + off)[-1] - (row + off)[0]))
    found = {"the cameras' centres are": baseline_mm, "the board's first row is": row_mm}
    name = min(found, key=lambda key: abs(np.log(found[key] / known_mm)))
    if abs(found[name] / known_mm - 1.0) <= allowed:
        return []
    apart = "apart" if "cameras" in name else "long"
    return [
        f"by this calibration {name} {found[name]:.2f} mm {apart}, but {known_mm:g} mm are known: "
        "the board is not as large as its file says"
    ]
