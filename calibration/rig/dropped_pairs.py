"""Finds pairs of pictures that do not fit the rig, and says why."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from calibration.rig.bundle_adjustment import Bundle
from calibration.rig.initial_rig import matrix_of, pose_of
from calibration.rig.parameters import unpack
from calibration.targets.boards import Board
from calibration.targets.detection import SeenBoard
from calibration.targets.seen_pairs import SeenPair
from navapp.geometry.camera import Camera
from navapp.geometry.transform import FloatArray, angle_between_rad

# Blur against the usual of the same camera; residuals against the usual of all views.
_TOO_BLURRED, _TOO_FAR = 1.8, 3.0
# What a hand that is not quite still costs, and what pictures of two instants leave.
_LEAST_MISFIT_PX, _OTHER_INSTANT_PX = 0.05, 1.0
# Poses this near are the same, in parts of the board's distance and in rad.
_SAME_FRACTION, _SAME_RAD = 0.01, 0.02


class Fault(StrEnum):
    """Why a pair is not used."""

    NOT_SEEN = "the board is not seen"
    BLURRED = "blurred"
    BAD_MARKS = "the marks do not fit a flat board"
    UNSTEADY = "the board was not held still"
    OUT_OF_ORDER = "out of order"
    MOVED = "the board moved between the two pictures"


# Pairs of such faults say that the capture as a whole went wrong.
FAULTS_OF_CAPTURE = (Fault.OUT_OF_ORDER, Fault.MOVED)


@dataclass(frozen=True, slots=True)
class DroppedPair:
    """A pair that is not used."""

    index: int  # of the pair
    fault: Fault  # its kind
    reason: str  # for people


def find_blurred_pairs(pairs: Sequence[SeenPair]) -> list[DroppedPair]:
    """Pairs of which a picture is far less sharp than is usual for its camera."""
    dropped: dict[int, DroppedPair] = {}
    if not pairs:
        return []
    for side in ("left", "right"):
        blurs = np.array([getattr(pair, side).blur_px for pair in pairs])
        usual = float(np.median(blurs))
        for pair, blur in zip(pairs, blurs, strict=True):
            if blur > _TOO_BLURRED * usual:
                reason = f"the {side} picture is blurred ({blur:.1f} px, usual are {usual:.1f})"
                dropped.setdefault(pair.index, DroppedPair(pair.index, Fault.BLURRED, reason))
    return list(dropped.values())


def find_misfits(board: Board, pairs: Sequence[SeenPair], solved: Bundle) -> list[DroppedPair]:
    """Pairs that leave far more than is usual in a solved rig, and why."""
    rms = np.array([_rms(np.vstack(left)) for left in solved.residuals_px])
    usual = float(np.median(rms))
    suspects = np.flatnonzero(rms > max(_TOO_FAR * usual, _LEAST_MISFIT_PX))
    if len(suspects) == 0:
        return []
    rig = unpack(solved.model, solved.shared)
    poses = [(_alone(board, p.left, rig.left), _alone(board, p.right, rig.right)) for p in pairs]
    return [
        _find_reason(pairs, poses, int(view), float(rms[view]), usual, rig.right_from_left.matrix)
        for view in suspects
    ]


def _find_reason(
    pairs: Sequence[SeenPair],
    poses: Sequence[tuple["_Alone", "_Alone"]],
    view: int,
    rms_px: float,
    usual_px: float,
    right_from_left: FloatArray,
) -> DroppedPair:
    index = pairs[view].index
    for side, alone in zip(("left", "right"), poses[view], strict=True):
        if alone.pose is None or alone.rms_px > _TOO_FAR * usual_px:
            return DroppedPair(
                index, Fault.BAD_MARKS,
                f"the marks in the {side} picture do not fit the board "
                f"({alone.rms_px:.2f} px, usual are {usual_px:.2f})",
            )  # fmt: skip
    if rms_px < _OTHER_INSTANT_PX:
        return DroppedPair(
            index, Fault.UNSTEADY,
            f"the board was not held still ({rms_px:.2f} px, usual are {usual_px:.2f})",
        )  # fmt: skip
    right = poses[view][1].pose
    for other, (left, _) in enumerate(poses):
        if other == view or left.pose is None or right is None:
            continue
        if _is_same(right_from_left @ left.pose, right):
            return DroppedPair(
                index, Fault.OUT_OF_ORDER,
                f"its right picture shows the board of pair {pairs[other].index}: "
                "the pictures are out of order",
            )  # fmt: skip
    return DroppedPair(
        index, Fault.MOVED,
        "the board moved between the left and the right picture "
        f"(together they leave {rms_px:.2f} px, usual are {usual_px:.2f})",
    )  # fmt: skip


@dataclass(frozen=True, slots=True, eq=False)
class _Alone:
    """A board as one picture alone tells it."""

    pose: FloatArray | None
    rms_px: float


def _alone(board: Board, seen: SeenBoard, camera: Camera) -> _Alone:
    vector = pose_of(board, seen, camera)
    if vector is None:
        return _Alone(None, np.inf)
    pose = matrix_of(vector)
    points_mm = board.points_mm[seen.ids] @ pose[:3, :3].T + pose[:3, 3]
    return _Alone(pose, _rms(camera.project(points_mm) - seen.pixels))


def _rms(residual_px: FloatArray) -> float:
    return float(np.sqrt((residual_px**2).sum(axis=1).mean()))


def _is_same(a: FloatArray, b: FloatArray) -> bool:
    turn_rad = angle_between_rad(a[:3, :3], b[:3, :3])
    apart_mm = np.linalg.norm(a[:3, 3] - b[:3, 3])
    return bool(turn_rad < _SAME_RAD and apart_mm < _SAME_FRACTION * np.linalg.norm(a[:3, 3]))
