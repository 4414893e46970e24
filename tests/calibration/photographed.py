"""Folders of picture files: a board as the simulated rig photographs it, at half its size."""

from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np

from calibration.targets.boards import Board, parse_board
from calibration.targets.drawing import make_drawing, rasterise
from navapp.geometry.transform import RigidTransform, rotation_from_vector
from sim_devices.rigs import make_default_rig
from sim_devices.sensor import Eye, SensorModel
from sim_devices.sheet import PrintedSheet, SheetScene

KEYS = {
    "type": "charuco", "squares_x": 8, "squares_y": 6, "square_mm": 21.0,
    "marker_mm": 15.0, "dictionary": "DICT_4X4_50",
}  # fmt: skip
BOARD = parse_board(KEYS)
RIG = make_default_rig(640, 360)
_SCALE, _MARGIN_MM, _PX_PER_MM = 0.5, 8.0, 8.0
# Where the board's middle is held, mm in the left camera's frame, and how it is turned, deg.
GOOD_VIEWS = (
    ((-45.0, -45.0, 440.0), (35.0, 0.0, 0.0)),
    ((40.0, -45.0, 380.0), (-35.0, 0.0, 10.0)),
    ((125.0, -45.0, 460.0), (0.0, 35.0, -10.0)),
    ((-45.0, 0.0, 480.0), (0.0, -35.0, 0.0)),
    ((40.0, 0.0, 360.0), (25.0, 25.0, 90.0)),
    ((125.0, 0.0, 430.0), (-25.0, 25.0, 20.0)),
    ((-45.0, 45.0, 450.0), (25.0, -25.0, 0.0)),
    ((40.0, 45.0, 520.0), (-25.0, -25.0, -20.0)),
    ((125.0, 45.0, 400.0), (0.0, 30.0, 60.0)),
    ((40.0, 0.0, 540.0), (30.0, 0.0, 100.0)),
)


def held(
    place_mm: Sequence[float], turn_deg: Sequence[float], board: Board = BOARD
) -> RigidTransform:
    """The board's middle at a place in the left camera's frame."""
    rotation = rotation_from_vector(np.radians(turn_deg))
    place = np.array(place_mm) - rotation @ board.points_mm.mean(axis=0)
    return RigidTransform.from_parts("left", "sheet", rotation, place)


def good_poses(board: Board = BOARD) -> list[RigidTransform]:
    """All over the picture, near and far, tilted all ways."""
    return [held(place_mm, turn_deg, board) for place_mm, turn_deg in GOOD_VIEWS]


def photograph(folder: Path, poses: Sequence[RigidTransform], board: Board = BOARD) -> Path:
    """Write left_0000.png, right_0000.png, ... of the board in these poses."""
    folder.mkdir(exist_ok=True)
    scene, sensor = _scene(board, poses), SensorModel(is_grey=True)
    eyes: tuple[Eye, Eye] = ("left", "right")
    for number in range(len(poses)):
        for eye in eyes:
            picture = sensor.picture(scene.render(eye, number, _SCALE), eye, number)
            cv2.imwrite(str(folder / f"{eye}_{number:04d}.png"), picture)
    return folder


def _scene(board: Board, poses: Sequence[RigidTransform]) -> SheetScene:
    """The n-th pose at the n-th ns."""
    drawing = make_drawing(board)
    white = rasterise(drawing, _PX_PER_MM, _MARGIN_MM)
    left_mm, top_mm = drawing.low_mm - _MARGIN_MM
    sheet = PrintedSheet(white, _PX_PER_MM, float(left_mm), float(top_mm))
    return SheetScene(sheet, lambda number: poses[number])
