"""Rays from an eye by a half-silvered plate to a monitor, and through the plate to a sheet."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit(cache=True, nogil=True)
def aim(
    rays: NDArray[np.float64],
    left_from_eye: NDArray[np.float64],
    row: int,
    column: int,
    v: float,
    u: float,
    direction: NDArray[np.float64],
) -> None:
    """Write the direction (3,) through a place of a pixel, u and v from 0 to 1, left frame."""
    x = (1.0 - v) * ((1.0 - u) * rays[row, column, 0] + u * rays[row, column + 1, 0]) + v * (
        (1.0 - u) * rays[row + 1, column, 0] + u * rays[row + 1, column + 1, 0]
    )
    y = (1.0 - v) * ((1.0 - u) * rays[row, column, 1] + u * rays[row, column + 1, 1]) + v * (
        (1.0 - u) * rays[row + 1, column, 1] + u * rays[row + 1, column + 1, 1]
    )
    for k in range(3):
        direction[k] = (
            left_from_eye[k, 0] * x + left_from_eye[k, 1] * y + left_from_eye[k, 2]
        )  # fmt: skip


@njit(cache=True, nogil=True)
def tangents(
    direction: NDArray[np.float64], normal: NDArray[np.float64], index: float
) -> tuple[float, float, float]:
    """Component along the normal, and tangents of the angles before and in the glass (Snell)."""
    along = 0.0
    square = 0.0
    for k in range(3):
        along += direction[k] * normal[k]
        square += direction[k] * direction[k]
    sine2 = max(1.0 - along * along / square, 0.0)
    sine = math.sqrt(sine2)
    return along, sine / math.sqrt(1.0 - sine2), sine / math.sqrt(index * index - sine2)


@njit(cache=True, nogil=True)
def reflect_screen(
    rays: NDArray[np.float64],
    left_from_eye: NDArray[np.float64],
    eye: NDArray[np.float64],
    plate: NDArray[np.float64],
    panel: NDArray[np.float64],
    luminance: NDArray[np.float32],
    n_samples: int,
    picture: NDArray[np.float32],
) -> None:
    """Add the monitor's light, by the front face and by the back face, to every pixel.

    Args:
        rays: (H + 1, W + 1, 2) x and y of the directions (z = 1) through the pixels' corners.
        left_from_eye: (3, 3) rotation.
        eye: (3,) its place.
        plate: (4, 3) point of the front face; normal; thickness, index, 0; shares of light that
            the front face, and the back face, send to the eye, 0.
        panel: (4, 3) centre of its first pixel; directions in which columns and rows rise, over
            the pitch; its normal.
        luminance: (h, w, C) of its pixels; each is a square that is lit evenly.
        n_samples: places along each side of a pixel of the picture.
        picture: (H, W, C) is added to.
    """
    normal = plate[1]
    thickness, index = plate[2, 0], plate[2, 1]
    height, width, channels = luminance.shape
    direction = np.empty(3)
    before = 0.0
    for k in range(3):
        before += (plate[0, k] - eye[k]) * normal[k]
    shares = plate[3] / (n_samples * n_samples)
    for row in range(picture.shape[0]):
        for column in range(picture.shape[1]):
            for sample in range(n_samples * n_samples):
                v = (sample // n_samples + 0.5) / n_samples
                u = (sample % n_samples + 0.5) / n_samples
                aim(rays, left_from_eye, row, column, v, u, direction)
                along, before_glass, in_glass = tangents(direction, normal, index)
                if along <= 0.0:
                    continue
                reach = before / along
                # In the glass the ray goes there and back, and comes out so much further on.
                further = 2.0 * thickness * in_glass
                for face in range(2):
                    x, y, z, speed = 0.0, 0.0, 0.0, 0.0
                    for k in range(3):
                        tangential = direction[k] - along * normal[k]
                        start = eye[k] + reach * direction[k]
                        if face == 1 and before_glass > 0.0:
                            start += further * tangential / (along * before_glass)
                        back = tangential - along * normal[k]
                        offset = start - panel[0, k]
                        x += offset * panel[1, k]
                        y += offset * panel[2, k]
                        z += offset * panel[3, k]
                        speed += back * panel[3, k]
                    far = -z / speed if speed != 0.0 else -1.0
                    if far <= 0.0:
                        continue
                    for k in range(3):
                        back = direction[k] - 2.0 * along * normal[k]
                        x += far * back * panel[1, k]
                        y += far * back * panel[2, k]
                    i, j = math.floor(x + 0.5), math.floor(y + 0.5)
                    if 0 <= i < width and 0 <= j < height:
                        for c in range(channels):
                            picture[row, column, c] += shares[face] * luminance[j, i, c]


@njit(cache=True, nogil=True)
def see_sheet(
    rays: NDArray[np.float64],
    left_from_eye: NDArray[np.float64],
    eye: NDArray[np.float64],
    plate: NDArray[np.float64],
    sheet: NDArray[np.float64],
    texture: NDArray[np.float32],
    n_samples: int,
    ground: float,
    picture: NDArray[np.float32],
) -> None:
    """Every pixel the mean of n x n places of a flat sheet behind the plate.

    Args:
        rays: (H + 1, W + 1, 2) x and y of the directions (z = 1) through the pixels' corners.
        left_from_eye: (3, 3) rotation.
        eye: (3,) its place.
        plate: as `reflect_screen` takes it.
        sheet: (4, 3) centre of the texture's first pixel; directions in which its columns and rows
            rise, over their distance; its normal.
        texture: (h, w) reflectance.
        n_samples: places along each side of a pixel of the picture.
        ground: reflectance of what is not the sheet.
        picture: (H, W), written.
    """
    normal = plate[1]
    thickness, index = plate[2, 0], plate[2, 1]
    height, width = texture.shape
    direction = np.empty(3)
    for row in range(picture.shape[0]):
        for column in range(picture.shape[1]):
            total = 0.0
            for sample in range(n_samples * n_samples):
                v = (sample // n_samples + 0.5) / n_samples
                u = (sample % n_samples + 0.5) / n_samples
                aim(rays, left_from_eye, row, column, v, u, direction)
                along, before_glass, in_glass = tangents(direction, normal, index)
                x, y, z, speed = 0.0, 0.0, 0.0, 0.0
                for k in range(3):
                    start = eye[k]
                    if before_glass > 0.0:
                        # The glass takes so much from the way aside that the ray would have gone.
                        tangential = (direction[k] - along * normal[k]) / (along * before_glass)
                        start -= thickness * (before_glass - in_glass) * tangential
                    offset = start - sheet[0, k]
                    x += offset * sheet[1, k]
                    y += offset * sheet[2, k]
                    z += offset * sheet[3, k]
                    speed += direction[k] * sheet[3, k]
                far = -z / speed if speed != 0.0 else -1.0
                for k in range(3):
                    x += far * direction[k] * sheet[1, k]
                    y += far * direction[k] * sheet[2, k]
                if not (far > 0.0 and -0.5 < x < width - 0.5 and -0.5 < y < height - 0.5):
                    total += ground
                    continue
                x, y = min(max(x, 0.0), width - 1.0), min(max(y, 0.0), height - 1.0)
                i, j = min(int(x), width - 2), min(int(y), height - 2)
                x, y = x - i, y - j
                upper = (1.0 - x) * texture[j, i] + x * texture[j, i + 1]
                lower = (1.0 - x) * texture[j + 1, i] + x * texture[j + 1, i + 1]
                total += (1.0 - y) * upper + y * lower
            picture[row, column] = total / (n_samples * n_samples)
