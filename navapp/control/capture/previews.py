"""Small pictures for the screen, with the marks that were seen and the wanted view's outline."""

import numpy as np
from numpy.typing import NDArray

from calibration.targets.boards import Board
from calibration.targets.detection import SeenBoard
from drivers.frames import Image, StereoFrame
from navapp.control.capture.board_view import BoardView
from navapp.control.capture.next_view import NextView
from navapp.geometry.camera import Camera
from navapp.geometry.transform import FloatArray, RigidTransform

_WIDTH = 192
_MARK_BGR, _OUTLINE_BGR, _FIRST_BGR = (90, 235, 90), (40, 170, 255), (60, 60, 255)
_STEPS = 12


def make_previews(
    board: Board, frame: StereoFrame | None, view: BoardView | None, next_view: NextView | None
) -> tuple[NDArray[np.uint8], NDArray[np.uint8]] | None:
    """(h, 192, 3) BGR, left and right; None before the first frame.

    Args:
        board: that is shown.
        frame: the newest.
        view: the newest; its marks are drawn.
        next_view: its view is outlined; None for none.
    """
    if frame is None:
        return None
    left_px, right_px = _outlines(board, next_view)
    seen = (None, None) if view is None else (view.left, view.right)
    return _draw_preview(frame.left, seen[0], left_px), _draw_preview(
        frame.right, seen[1], right_px
    )


def _draw_preview(
    picture: Image, seen: SeenBoard | None, outline_px: FloatArray | None
) -> NDArray[np.uint8]:
    import cv2

    scale = _WIDTH / picture.shape[1]
    size = (_WIDTH, max(1, round(scale * picture.shape[0])))
    small = np.asarray(cv2.resize(picture, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)
    if small.ndim == 2:
        small = np.asarray(cv2.cvtColor(small, cv2.COLOR_GRAY2BGR), dtype=np.uint8)
    if seen is not None:
        for x, y in _scale(seen.pixels, scale):
            cv2.circle(small, (x, y), 1, _MARK_BGR, -1)
    if outline_px is not None:
        line = np.array(_scale(outline_px, scale), dtype=np.int32)
        cv2.polylines(small, [line.reshape(-1, 1, 2)], True, _OUTLINE_BGR, 2)
        cv2.circle(small, tuple(int(value) for value in line[0]), 3, _FIRST_BGR, -1)
    return small


def _outlines(
    board: Board, next_view: NextView | None
) -> tuple[FloatArray | None, FloatArray | None]:
    """(n, 2) px of the wanted view's edge in the left and right picture, where they are known."""
    if next_view is None or next_view.left_from_board is None:
        return None, None
    left = _outline(board, next_view.left, next_view.left_from_board)
    if next_view.rig is None:
        return left, None
    in_right = next_view.rig.right_from_left @ next_view.left_from_board
    return left, _outline(board, next_view.rig.right, in_right)


def _outline(board: Board, camera: Camera, camera_from_board: RigidTransform) -> FloatArray | None:
    low, high = board.points_mm.min(axis=0), board.points_mm.max(axis=0)
    edge = 0.5 * board.spacing_mm
    x, y = (low - edge)[:2], (high + edge)[:2]
    corners = np.array([[x[0], x[1]], [y[0], x[1]], [y[0], y[1]], [x[0], y[1]]])
    share = np.linspace(0.0, 1.0, _STEPS, endpoint=False)[None, :, None]
    sides = corners[:, None] * (1.0 - share) + np.roll(corners, -1, axis=0)[:, None] * share
    flat = sides.reshape(-1, 2)
    points_mm = np.column_stack([flat, np.zeros(len(flat))])
    pixels = camera.project(camera_from_board.apply(points_mm))
    far = 4.0 * camera.width
    is_near = np.isfinite(pixels).all() and (np.abs(pixels) < far).all()
    return pixels if is_near else None


def _scale(pixels: FloatArray, scale: float) -> list[tuple[int, int]]:
    places = np.rint((pixels + 0.5) * scale - 0.5).astype(int)
    return [(int(x), int(y)) for x, y in places]
