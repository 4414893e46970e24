"""Directions of the pixels of a camera's picture, its distortion removed.

To remove the distortion of a whole picture takes long, and every stage and every sheet asks for the
same ones: they are kept.
"""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.camera import Camera
from navapp.geometry.transform import FloatArray


def centre_rays(camera: Camera) -> NDArray[np.float32]:
    """(H, W, 2) x / z and y / z through every pixel's centre; not to be changed."""
    return _centre_rays(*_key_of(camera))


def corner_rays(camera: Camera) -> FloatArray:
    """(H + 1, W + 1, 2) x / z and y / z through the pixels' corners; not to be changed."""
    return _corner_rays(*_key_of(camera))


def _key_of(camera: Camera) -> tuple[bytes, bytes, int, int]:
    """Equal cameras are made anew for each stage: their numbers tell them apart."""
    return camera.matrix.tobytes(), camera.distortion.tobytes(), camera.width, camera.height


@lru_cache(maxsize=4)
def _centre_rays(matrix: bytes, distortion: bytes, width: int, height: int) -> NDArray[np.float32]:
    u, v = np.meshgrid(np.arange(width, dtype=float), np.arange(height, dtype=float))
    return _rays(matrix, distortion, u, v).astype(np.float32)


@lru_cache(maxsize=4)
def _corner_rays(matrix: bytes, distortion: bytes, width: int, height: int) -> FloatArray:
    u, v = np.meshgrid(np.arange(width + 1) - 0.5, np.arange(height + 1) - 0.5)
    return _rays(matrix, distortion, u, v)


def _rays(matrix: bytes, distortion: bytes, u: FloatArray, v: FloatArray) -> FloatArray:
    """(H, W, 2) through places (H, W) of the picture."""
    # The size does not matter for rays.
    camera = Camera(np.frombuffer(matrix).reshape(3, 3), np.frombuffer(distortion), 1, 1)
    rays = camera.rays(np.column_stack([u.ravel(), v.ravel()]))[:, :2]
    return np.ascontiguousarray(rays.reshape(*u.shape, 2))
