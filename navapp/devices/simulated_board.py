"""A printed board and a hand that holds it, for simulated cameras."""

import numpy as np

from calibration.targets.boards import Board
from calibration.targets.drawing import make_drawing, rasterise
from navapp.geometry import RigidTransform
from sim_devices.hand import Hand
from sim_devices.rigs import WORKING_DISTANCE_MM
from sim_devices.sheet import PrintedSheet

# Finer than any picture shows it.
_SHEET_PX_PER_MM, _MOST_SHEET_PX, _SHEET_MARGIN_MM = 12.0, 6000.0, 8.0


def print_board(board: Board, px_per_mm: float = _SHEET_PX_PER_MM) -> PrintedSheet:
    """The board on a sheet of paper."""
    drawing = make_drawing(board)
    px_per_mm = min(px_per_mm, _MOST_SHEET_PX / max(board.size_mm))
    left_mm, top_mm = drawing.low_mm - _SHEET_MARGIN_MM
    white = rasterise(drawing, px_per_mm, _SHEET_MARGIN_MM)
    return PrintedSheet(white, px_per_mm, float(left_mm), float(top_mm))


def make_hand(board: Board, seed: int) -> Hand:
    """A hand that holds the board's middle in front of the left camera."""
    middle_mm = board.points_mm.mean(axis=0)
    place_mm = np.array([0.0, 0.0, WORKING_DISTANCE_MM]) - middle_mm
    return Hand(RigidTransform.from_parts("left", "board", np.eye(3), place_mm), middle_mm, seed)
