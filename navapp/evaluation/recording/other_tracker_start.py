"""Where the solve of another tracker's frames begins: time offsets by the speed of turning.

How fast a bone turns is the same in every frame, so offsets are compared before anything else is
known. For each the frames follow in closed form (M. Shah 2013, J. Mechanisms and Robotics 5,
031007).
"""

from dataclasses import dataclass

import numpy as np

from navapp.evaluation.recording.tracker_motion import TrackerMotion
from navapp.geometry.transform import FloatArray, RigidTransform, nearest_rotation

# Turns are compared over this time, at offsets in such steps.
_BASE_S, _STEP_S = 0.3, 0.02
_MOST_BASE_S = 0.6
# An offset counts when the tracker knows so many of the turns.
_LEAST_SHARE = 0.5
# So many offsets are tried, so far apart.
_N_OFFSETS, _APART_S = 5, 0.2


@dataclass(frozen=True, slots=True, eq=False)
class BonePoses:
    """The bone in the pictures that the frames are solved with."""

    times_s: FloatArray  # (N,) since the recording's first picture
    rotations: FloatArray  # (N, 3, 3) left camera from bone
    places_mm: FloatArray  # (N, 3)
    blocks: np.ndarray  # (N,) which block each picture is in


def find_offsets(poses: BonePoses, motion: TrackerMotion) -> list[float]:
    """The most likely lags in s, the best first: tracker's time since its first sample less ours.

    Empty when the tracker's time is too short, or nothing turns.
    """
    first, second = _pair_up(poses)
    if len(first) == 0:
        return []
    apart_s = poses.times_s[second] - poses.times_s[first]
    base_s = float(np.median(apart_s))
    turned = np.swapaxes(poses.rotations[first], 1, 2) @ poses.rotations[second]
    turned_rad = _angles_rad(turned) * base_s / apart_s
    grid_s = np.arange(0.0, motion.length_s, _STEP_S)
    known = motion.knows(grid_s) & motion.knows(grid_s + base_s)
    turns = np.swapaxes(motion.at(grid_s)[0], 1, 2) @ motion.at(grid_s + base_s)[0]
    told_rad = np.where(known, _angles_rad(turns), np.nan)
    lags_s = np.arange(-poses.times_s[-1], motion.length_s, _STEP_S)
    costs = np.full(len(lags_s), np.inf)
    for n, lag_s in enumerate(lags_s):
        cells = np.rint((poses.times_s[first] + lag_s) / _STEP_S).astype(np.int64)
        inside = (cells >= 0) & (cells < len(grid_s))
        off = told_rad[cells[inside]] - turned_rad[inside]
        off = off[np.isfinite(off)]
        if len(off) >= _LEAST_SHARE * len(first):
            costs[n] = np.mean(np.abs(off))
    return _pick_best(lags_s, costs)


def solve_closed_form(
    poses: BonePoses, motion: TrackerMotion, lag_s: float
) -> tuple[RigidTransform, RigidTransform] | None:
    """`left_from_tracker` and `marker_from_bone` for a lag; None with fewer than three pictures.

    Turns by the largest singular vectors of the sum of Kronecker products, then places by linear
    least squares. OpenCV 5 no longer has its `calibrateRobotWorldHandEye`.
    """
    some = np.flatnonzero(motion.knows(poses.times_s + lag_s))
    if len(some) < 3:
        return None
    seen, seen_mm = poses.rotations[some], poses.places_mm[some]
    told, told_mm = motion.at(poses.times_s[some] + lag_s)
    # seen @ bone_from_marker = left_from_tracker @ told, in every picture.
    products = np.einsum("nij,nkl->ikjl", told, seen).reshape(9, 9)
    left, _, right = np.linalg.svd(products)
    turn, other_turn = (_nearest_turn(vector) for vector in (left[:, 0], right[0]))
    equations = np.concatenate([np.broadcast_to(np.eye(3), seen.shape), -seen], axis=2)
    rest_mm = seen_mm - told_mm @ turn.T
    places_mm = np.linalg.lstsq(equations.reshape(-1, 6), rest_mm.ravel(), rcond=None)[0]
    left_from_tracker = RigidTransform.from_parts("left", "tracker", turn, places_mm[:3])
    bone_from_marker = RigidTransform.from_parts("bone", "marker", other_turn, places_mm[3:])
    return left_from_tracker, bone_from_marker.inverse()


def _nearest_turn(vector: FloatArray) -> FloatArray:
    """The rotation of a (9,) vector of its columns, of any length and either sign."""
    matrix = vector.reshape(3, 3).T
    return nearest_rotation(matrix if np.linalg.det(matrix) > 0.0 else -matrix)


def _pair_up(poses: BonePoses) -> tuple[np.ndarray, np.ndarray]:
    """Pictures of one block, each with the first that is late enough after it."""
    later = np.searchsorted(poses.times_s, poses.times_s + _BASE_S)
    first = np.flatnonzero(later < len(poses.times_s))
    second = later[first]
    fits = (poses.blocks[first] == poses.blocks[second]) & (
        poses.times_s[second] - poses.times_s[first] <= _MOST_BASE_S
    )
    return first[fits], second[fits]


def _angles_rad(rotations: FloatArray) -> FloatArray:
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.from_matrix(rotations).magnitude())


def _pick_best(lags_s: FloatArray, costs: FloatArray) -> list[float]:
    picked: list[float] = []
    for n in np.argsort(costs):
        if not np.isfinite(costs[n]) or len(picked) == _N_OFFSETS:
            break
        if all(abs(lags_s[n] - other) > _APART_S for other in picked):
            picked.append(float(lags_s[n]))
    return picked
