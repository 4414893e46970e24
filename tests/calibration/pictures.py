"""Pictures of a printed target: rays through a camera with distortion, blurred and noisy."""

import itertools
from functools import cache

import cv2
import numpy as np

from calibration.targets.boards import Board
from calibration.targets.drawing import make_drawing, rasterise
from navapp.geometry.camera import Camera
from navapp.geometry.transform import FloatArray, RigidTransform, rotation_from_vector

_PX_PER_MM, _MARGIN_MM, _SAMPLES = 16.0, 8.0, 5


def picture_of(
    board: Board,
    camera: Camera,
    camera_from_board: RigidTransform,
    *,
    blur_px: float = 0.6,
    noise: float = 1.0,
    seed: int = 0,
) -> np.ndarray:
    """(H, W) grey picture: every pixel the mean of 5 x 5 rays, then blur, then noise."""
    low_mm, paper = _paper(board)
    board_from_camera = camera_from_board.inverse()
    centre, turn = board_from_camera.translation_mm, board_from_camera.rotation
    first_px = np.float32((centre[:2] - low_mm) * _PX_PER_MM - 0.5)
    height_px = np.float32(centre[2] * _PX_PER_MM)
    u, v = np.meshgrid(np.arange(camera.width), np.arange(camera.height))
    rays = camera.rays(np.column_stack([u.ravel(), v.ravel()])) @ turn.T
    rays = np.float32(rays.T).reshape(3, camera.height, camera.width)
    down, across = np.gradient(rays, axis=(1, 2))
    # Rays of small pixels against many pixels of paper would alias: the mean over a fine grid.
    offsets = np.float32((np.arange(_SAMPLES) + 0.5) / _SAMPLES - 0.5)
    total = np.zeros((camera.height, camera.width))
    for dy, dx in itertools.product(offsets, offsets):
        x, y, z = rays + dx * across + dy * down
        far_px = height_px / z
        total += cv2.remap(
            paper, first_px[0] - far_px * x, first_px[1] - far_px * y, cv2.INTER_LINEAR,
            borderMode=cv2.BORDER_CONSTANT, borderValue=(90,),
        )  # fmt: skip
    grey = 25.0 + 0.75 * total / _SAMPLES**2
    grey = cv2.GaussianBlur(grey, (0, 0), blur_px)
    grey += np.random.default_rng(seed).normal(0.0, noise, grey.shape)
    return np.clip(np.rint(grey), 0, 255).astype(np.uint8)


@cache
def _paper(board: Board) -> tuple[np.ndarray, np.ndarray]:
    """(2,) where its picture begins on the board, mm, and the (H, W) picture."""
    drawing = make_drawing(board)
    return drawing.low_mm - _MARGIN_MM, rasterise(drawing, _PX_PER_MM, _MARGIN_MM)


def facing(board: Board, distance_mm: float, turn_rad: FloatArray) -> RigidTransform:
    """The board's middle on the camera's axis, turned about it."""
    middle = board.points_mm.mean(axis=0)
    rotation = rotation_from_vector(turn_rad)
    place = np.array([0.0, 0.0, distance_mm]) - rotation @ middle
    return RigidTransform.from_parts("camera", "board", rotation, place)
