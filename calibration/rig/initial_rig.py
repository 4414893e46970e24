"""First estimate of a rig by OpenCV's functions: each camera alone, then their placement."""

from collections.abc import Sequence

import cv2
import numpy as np

from calibration.rig.parameters import RigModel, unpack
from calibration.targets.boards import Board
from calibration.targets.detection import SeenBoard
from calibration.targets.seen_pairs import SeenPair
from navapp.geometry.camera import Camera
from navapp.geometry.rig import StereoRig
from navapp.geometry.transform import FloatArray, RigidTransform, nearest_rotation

# In front of the camera, for a view that tells no pose.
_FACING = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 400.0])
_FLAGS = cv2.CALIB_USE_INTRINSIC_GUESS | cv2.CALIB_FIX_K3
_CRITERIA = (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 100, 1e-9)


def start_rig(board: Board, pairs: Sequence[SeenPair], size: tuple[int, int]) -> StereoRig:
    """Each camera on its own, then the median of what the views say of their places.

    Args:
        board: that was seen.
        pairs: at least three.
        size: width and height of a picture, px.

    Raises:
        ValueError: no camera explains the views.
    """
    left = _camera(board, [pair.left for pair in pairs], size)
    right = _camera(board, [pair.right for pair in pairs], size)
    relative = []
    for pair in pairs:
        a, b = pose_of(board, pair.left, left), pose_of(board, pair.right, right)
        if a is not None and b is not None:
            relative.append(matrix_of(b) @ np.linalg.inv(matrix_of(a)))
    if not relative:
        raise ValueError("the board's pose cannot be told in any pair")
    middle = np.median(relative, axis=0)
    # Of all views the one nearest to the middle: a mean would mix what is wrong into it.
    nearest = min(relative, key=lambda one: float(np.abs(one - middle)[:3, 3].sum()))
    rotation = nearest_rotation(nearest[:3, :3])
    pose = RigidTransform.from_parts("right", "left", rotation, nearest[:3, 3])
    return StereoRig(left, right, pose)


def start_poses(
    board: Board, pairs: Sequence[SeenPair], model: RigModel, shared: FloatArray
) -> FloatArray:
    """(V, 6) left_from_board of each view under a rig, as one picture tells it."""
    rig = unpack(model, shared)
    left_from_right = np.linalg.inv(rig.right_from_left.matrix)
    poses = []
    for pair in pairs:
        pose = pose_of(board, pair.left, rig.left)
        if pose is None and (other := pose_of(board, pair.right, rig.right)) is not None:
            pose = vector_of(left_from_right @ matrix_of(other))
        poses.append(_FACING if pose is None else pose)
    return np.array(poses)


def _camera(board: Board, views: Sequence[SeenBoard], size: tuple[int, int]) -> Camera:
    objects = [board.points_mm[view.ids].astype(np.float32) for view in views]
    pixels = [view.pixels.astype(np.float32) for view in views]
    try:
        first = cv2.initCameraMatrix2D(objects, pixels, size)
        _, matrix, distortion, _, _ = cv2.calibrateCamera(
            objects, pixels, size, first, None, flags=_FLAGS, criteria=_CRITERIA
        )
    except cv2.error as error:
        raise ValueError("no camera explains these views of the board") from error
    coefficients = np.asarray(distortion, dtype=np.float64).reshape(-1)[:4]
    return Camera(np.asarray(matrix, dtype=np.float64), coefficients, *size)


def pose_of(board: Board, seen: SeenBoard, camera: Camera) -> FloatArray | None:
    """(6,) rotation vector and translation of camera from board; None when it cannot be told."""
    try:
        is_found, rotation, translation = cv2.solvePnP(
            board.points_mm[seen.ids],
            seen.pixels,
            np.array(camera.matrix),
            np.array(camera.distortion),
            flags=cv2.SOLVEPNP_IPPE,
        )
        if is_found:
            rotation, translation = cv2.solvePnPRefineLM(
                board.points_mm[seen.ids], seen.pixels, np.array(camera.matrix),
                np.array(camera.distortion), rotation, translation,
            )  # fmt: skip
    except cv2.error:
        return None
    pose = np.concatenate([np.ravel(rotation), np.ravel(translation)])
    return pose if is_found and np.isfinite(pose).all() else None


def matrix_of(pose: FloatArray) -> FloatArray:
    """(4, 4) of a rotation vector and a translation."""
    matrix = np.eye(4)
    matrix[:3, :3] = cv2.Rodrigues(pose[:3])[0]
    matrix[:3, 3] = pose[3:]
    return matrix


def vector_of(matrix: FloatArray) -> FloatArray:
    """(6,) rotation vector and translation of a (4, 4) pose."""
    return np.concatenate([cv2.Rodrigues(matrix[:3, :3])[0].ravel(), matrix[:3, 3]])
