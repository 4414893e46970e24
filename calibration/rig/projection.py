"""Projects points of the board into a camera of the rig, with derivatives by all parameters."""

from typing import Any

import cv2
import numpy as np

from calibration.rig.parameters import RigModel, unpack_lens, unpack_placement
from navapp.geometry.transform import FloatArray


def project(
    points_mm: FloatArray,
    left_from_board: FloatArray,
    model: RigModel,
    shared: FloatArray,
    number: int,
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Pixels of points in one camera of the rig, and their slopes.

    Args:
        points_mm: (n, 3) in the board's frame.
        left_from_board: (6,) rotation vector and translation.
        model: of the rig.
        shared: its numbers.
        number: 0 left, 1 right camera.

    Returns:
        (n, 2) pixels; (2n, n_rig) slopes by the rig's numbers; (2n, 6) by the pose; (2n, 3) by the
        points' own coordinates, a translation of all along each axis of the board.
    """
    matrix, distortion = unpack_lens(model, shared, number)
    rotation: Any = left_from_board[:3]
    translation: Any = left_from_board[3:]
    by_rig = np.zeros((2 * len(points_mm), model.n_rig))
    chain: Any = None
    if number == 1:
        between = unpack_placement(model, shared)
        chain = cv2.composeRT(rotation, translation, *between)
        rotation, translation = chain[0].ravel(), chain[1].ravel()
    pixels, slopes = cv2.projectPoints(points_mm, rotation, translation, matrix, distortion)
    slopes = np.asarray(slopes, dtype=np.float64)
    by_rotation, by_translation = slopes[:, :3], slopes[:, 3:6]
    first = number * model.n_camera
    by_rig[:, first : first + model.n_camera] = slopes[:, 6 : 6 + model.n_camera]
    by_pose: FloatArray = np.hstack([by_rotation, by_translation])
    if chain is not None:
        chain = [np.asarray(part, dtype=np.float64) for part in chain]
        _, _, rr1, rt1, rr2, rt2, tr1, tt1, tr2, tt2 = chain
        place = 2 * model.n_camera
        by_rig[:, place : place + 3] = by_rotation @ rr2 + by_translation @ tr2
        by_rig[:, place + 3 : place + 6] = by_rotation @ rt2 + by_translation @ tt2
        by_pose[:, :3] = by_rotation @ rr1 + by_translation @ tr1
        by_pose[:, 3:] = by_rotation @ rt1 + by_translation @ tt1
    turn = np.asarray(cv2.Rodrigues(rotation)[0], dtype=np.float64)
    pixels_px = np.asarray(pixels, dtype=np.float64).reshape(-1, 2)
    return pixels_px, by_rig, by_pose, np.asarray(by_translation @ turn, dtype=np.float64)
