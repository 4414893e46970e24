"""Pictures of a printed target: rays through a camera with distortion, blurred and noisy."""

import cv2
import numpy as np

from calibration.targets.boards import Board
from calibration.targets.drawing import drawn, rastered
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
    drawing = drawn(board)
    paper = rastered(drawing, _PX_PER_MM, _MARGIN_MM)
    # Rays of small pixels against many pixels of paper would alias: the mean over a fine grid.
    offsets = (np.arange(_SAMPLES) + 0.5) / _SAMPLES - 0.5
    total = np.zeros((camera.height, camera.width))
    board_from_camera = camera_from_board.inverse()
    centre, turn = board_from_camera.translation_mm, board_from_camera.rotation
    u, v = np.meshgrid(np.arange(camera.width), np.arange(camera.height))
    rays = camera.rays(np.column_stack([u.ravel(), v.ravel()])) @ turn.T
    rays = rays.reshape(camera.height, camera.width, 3)
    down, across = np.gradient(rays, axis=(0, 1))
    for dy in offsets:
        for dx in offsets:
            ray = rays + dx * across + dy * down
            hit = centre[:2] - centre[2] / ray[..., 2:] * ray[..., :2]
            place = ((hit - drawing.low_mm + _MARGIN_MM) * _PX_PER_MM - 0.5).astype(np.float32)
            total += cv2.remap(
                paper, place[..., 0], place[..., 1], cv2.INTER_LINEAR,
                borderMode=cv2.BORDER_CONSTANT, borderValue=(90,),
            )  # fmt: skip
    grey = 25.0 + 0.75 * total / _SAMPLES**2
    grey = cv2.GaussianBlur(grey, (0, 0), blur_px)
    grey += np.random.default_rng(seed).normal(0.0, noise, grey.shape)
    return np.clip(np.rint(grey), 0, 255).astype(np.uint8)


def facing(board: Board, distance_mm: float, turn_rad: FloatArray) -> RigidTransform:
    """The board's middle on the camera's axis, turned about it."""
    middle = board.points_mm.mean(axis=0)
    rotation = rotation_from_vector(turn_rad)
    place = np.array([0.0, 0.0, distance_mm]) - rotation @ middle
    return RigidTransform.from_parts("camera", "board", rotation, place)
