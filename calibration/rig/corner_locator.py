"""Where the marks of a board are, seen in one pair of pictures."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from calibration.targets.boards import Board
from calibration.targets.detection import find_board
from calibration.targets.seen_pairs import SeenPair
from navapp.geometry.rectification import Image, luma
from navapp.geometry.rig import StereoRig
from navapp.geometry.transform import FloatArray
from navapp.geometry.triangulation import triangulate_mm


def find_pair(board: Board, left: Image, right: Image) -> SeenPair | None:
    """The marks in both pictures; None where not both of them show the board."""
    try:
        in_left = find_board(luma(left), board)
        in_right = None if in_left is None else find_board(luma(right), board)
    except (cv2.error, np.linalg.LinAlgError):
        # A detector that stumbles over some picture has not seen the board in it.
        return None
    if in_left is None or in_right is None:
        return None
    return SeenPair(0, in_left, in_right)


@dataclass(frozen=True, slots=True, eq=False)
class CornerLocator:
    """Finds a board in pairs of pictures and tells where its marks are."""

    board: Board
    rig: StereoRig

    def __call__(self, left: Image, right: Image) -> tuple[NDArray[np.intp], FloatArray] | None:
        """Ids (n,) and places (n, 3) mm in the left camera's frame; None without the board."""
        pair = find_pair(self.board, left, right)
        return None if pair is None else locate_marks(self.rig, pair)


def locate_marks(rig: StereoRig, pair: SeenPair) -> tuple[NDArray[np.intp], FloatArray]:
    """Ids (n,) and places (n, 3) mm of the marks that both cameras see, in the left one's frame."""
    ids, left_px, right_px = pair.common()
    points = triangulate_mm(rig, left_px, right_px)
    # Rays that were taken for the same mark wrongly may meet behind the cameras, or nowhere.
    is_ahead = np.isfinite(points).all(axis=1) & (points[:, 2] > 0.0)
    return ids[is_ahead], points[is_ahead]
