"""Chooses the view of the board that lowers a rig's predicted error most."""

from collections.abc import Sequence
from functools import cache

import numpy as np

from calibration.rig.bundle_adjustment import Bundle
from calibration.rig.equilibration import compute_unit_sizes, equilibrate
from calibration.rig.initial_rig import matrix_of, vector_of
from calibration.rig.parameters import RigModel
from calibration.rig.projection import project
from calibration.rig.uncertainty import compute_triangulation_slopes, make_working_points_mm
from calibration.targets.boards import Board
from navapp.geometry.transform import (
    FloatArray,
    RigidTransform,
    angle_between_rad,
    rotation_from_vector,
)

# Where, how far and how turned a view may be asked for.
_PLACES = (-0.55, 0.0, 0.55)
_DEPTH_FRACTIONS = (0.0, 1.0)
_TILTS_DEG = (45.0,)
_N_DIRECTIONS = 8
_ROLL_DEG = (0.0, 90.0)
# So much of the board must be seen by both cameras, and this far from the pictures' edges.
_LEAST_SEEN, _EDGE_PX = 0.6, 12.0
# Turns this near are the same.
_SAME_RAD = 0.2


def find_next_view(
    board: Board,
    solved: Bundle,
    sigma_px: float,
    depth_mm: tuple[float, float],
    avoid: Sequence[FloatArray] = (),
) -> RigidTransform | None:
    """The view that lowers the predicted error in the working volume most.

    Args:
        board: in the operator's hands.
        solved: a flat board's rig, from what was taken so far.
        sigma_px: standard error of a mark's coordinate, as seen so far.
        depth_mm: nearest and farthest surface of the working volume.
        avoid: (3, 3) turns of the board that cannot be had, left camera from board.

    Returns:
        Where the board should be held, left camera from board; None when no view can be seen by
        both cameras.
    """
    model, shared = solved.model, solved.shared
    points_mm = make_working_points_mm(model, shared, depth_mm)
    if len(points_mm) == 0:
        return None
    slopes = compute_triangulation_slopes(model, shared, points_mm).reshape(-1, model.n_rig)
    sizes = compute_unit_sizes(solved.normal)
    normal = solved.normal / max(solved.scale, 1e-6) ** 2
    best: tuple[float, FloatArray] | None = None
    for pose in list_candidates(board, model, shared, depth_mm):
        rotation = matrix_of(pose)[:3, :3]
        if any(angle_between_rad(rotation, turn) < _SAME_RAD for turn in avoid):
            continue
        told = compute_information(board, pose, model, shared, sigma_px)
        if told is None:
            continue
        scaled = equilibrate(normal + told, sizes)
        scaled[np.diag_indices_from(scaled)] += 1e-14 * np.trace(scaled)
        covariance = equilibrate(np.linalg.inv(scaled), sizes)
        cost = float(np.einsum("ij,jk,ik->", slopes, covariance, slopes))
        if best is None or cost < best[0]:
            best = (cost, pose)
    if best is None:
        return None
    return RigidTransform("left", "board", matrix_of(best[1]))


def compute_information(
    board: Board, left_from_board: FloatArray, model: RigModel, shared: FloatArray, sigma_px: float
) -> FloatArray | None:
    """(n_rig, n_rig) what one view would tell of the rig, its own pose eliminated.

    None when one of the cameras sees too little of it.
    """
    n = model.n_rig
    normal, mixed, own = np.zeros((n, n)), np.zeros((n, 6)), np.zeros((6, 6))
    for number in range(2):
        pixels, by_rig, by_pose, _ = project(
            board.points_mm, left_from_board, model, shared, number
        )
        limit = (model.width - _EDGE_PX, model.height - _EDGE_PX)
        is_seen = (pixels > _EDGE_PX).all(axis=1) & (pixels < limit).all(axis=1)
        if is_seen.mean() < (_LEAST_SEEN if board.kind == "charuco" else 1.0):
            return None
        rows = np.repeat(is_seen, 2)
        a, b = by_rig[rows] / sigma_px, by_pose[rows] / sigma_px
        normal += a.T @ a
        mixed += a.T @ b
        own += b.T @ b
    reduced: FloatArray = normal - mixed @ np.linalg.solve(own, mixed.T)
    return reduced


def list_candidates(
    board: Board, model: RigModel, shared: FloatArray, depth_mm: tuple[float, float]
) -> list[FloatArray]:
    """(6,) left_from_board all over the working volume, tilted to all sides."""
    middle = board.points_mm.mean(axis=0)
    poses = []
    for share in _DEPTH_FRACTIONS:
        depth = depth_mm[0] + share * (depth_mm[1] - depth_mm[0])
        seen = make_working_points_mm(model, shared, (depth, depth))
        if len(seen) == 0:
            continue
        low, high = seen.min(axis=0), seen.max(axis=0)
        centre, half = 0.5 * (low + high), 0.5 * (high - low)
        for x in _PLACES:
            for y in _PLACES:
                place = centre + half * (x, y, 0.0)
                for rotation in _turns():
                    pose = np.eye(4)
                    pose[:3, :3] = rotation
                    pose[:3, 3] = place - rotation @ middle
                    poses.append(vector_of(pose))
    return poses


@cache
def _turns() -> tuple[FloatArray, ...]:
    """Rotations of a board that faces the camera."""
    turns = []
    for roll in _ROLL_DEG:
        flat = rotation_from_vector((0.0, 0.0, np.radians(roll)))
        turns.append(flat)
        for tilt in _TILTS_DEG:
            for direction in np.arange(_N_DIRECTIONS) * 2.0 * np.pi / _N_DIRECTIONS:
                axis = (np.cos(direction), np.sin(direction), 0.0)
                turns.append(rotation_from_vector(np.radians(tilt) * np.array(axis)) @ flat)
    return tuple(turns)
