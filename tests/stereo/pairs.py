"""Rectified pairs whose disparity is known."""

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.box import Box
from navapp.geometry.rectification import RectifiedGeometry, RectifiedPair
from navapp.geometry.transform import RigidTransform

WIDTH, HEIGHT = 320, 120


def geometry(width: int = WIDTH, height: int = HEIGHT) -> RectifiedGeometry:
    return RectifiedGeometry(
        focal_px=400.0,
        centre_x_px=150.5,
        centre_y_px=61.0,
        baseline_mm=50.0,
        width=width,
        height=height,
        rectified_from_left=RigidTransform.identity("left_rect", "left"),
    )


def texture(width: int, height: int, seed: int = 0) -> NDArray[np.float64]:
    """Band-limited noise: sub-pixel shifts of it are well defined."""
    import cv2

    rng = np.random.default_rng(seed)
    noise = cv2.GaussianBlur(rng.standard_normal((height, width)), (0, 0), 1.5)
    return 128.0 + 45.0 * noise / noise.std()


def shifted_pair(
    disparity_of_left: NDArray[np.float64], box: Box, seed: int = 0, is_colour: bool = False
) -> RectifiedPair:
    """The left picture is sampled from the right one: left(x) = right(x - d(x))."""
    import cv2

    height, width = disparity_of_left.shape
    right = texture(width, height, seed)
    columns = np.arange(width)[None, :] - disparity_of_left
    rows = np.repeat(np.arange(height)[:, None], width, axis=1)
    left = cv2.remap(
        right, columns.astype(np.float32), rows.astype(np.float32), cv2.INTER_CUBIC,
        borderMode=cv2.BORDER_REFLECT,
    )  # fmt: skip
    views = [np.clip(view, 0, 255).astype(np.uint8) for view in (left, right)]
    if is_colour:
        views = [np.stack([view, 255 - view, view // 2], axis=2) for view in views]
    return RectifiedPair(views[0], views[1], geometry(width, height), box)
