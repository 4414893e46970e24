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
def meet(
    start: NDArray[np.float64], direction: NDArray[np.float64], plane: NDArray[np.float64]
) -> tuple[float, float]:
    """Where a ray meets a plane, px; NaN when it does not.

    Args:
        start: (3,) of the ray.
        direction: (3,) of it, of any length.
        plane: (4, 3) the centre of its first pixel; directions in which columns and rows rise, over
            their distance; normal.
    """
    x, y, height, speed = 0.0, 0.0, 0.0, 0.0
    for k in range(3):
        height += (start[k] - plane[0, k]) * plane[3, k]
        speed += direction[k] * plane[3, k]
    far = -height / speed if speed != 0.0 else -1.0
    if far <= 0.0:
        return math.nan, math.nan
    for k in range(3):
        offset = start[k] - plane[0, k] + far * direction[k]
        x += offset * plane[1, k]
        y += offset * plane[2, k]
    return x, y


@njit(cache=True, nogil=True)
def reflect(
    eye: NDArray[np.float64],
    direction: NDArray[np.float64],
    plate: NDArray[np.float64],
    starts: NDArray[np.float64],
    back: NDArray[np.float64],
) -> bool:
    """Write where a ray of an eye leaves the plate again, and its direction (3,); False: never.

    Two places, (2, 3): from the front face and from the back face.
    """
    along, before_glass, in_glass = tangents(direction, plate[1], plate[2, 1])
    if along <= 0.0:
        return False
    height = 0.0
    for k in range(3):
        height += (plate[0, k] - eye[k]) * plate[1, k]
    # In the glass it goes there and back, and comes out so much further on.
    further = 2.0 * plate[2, 0] * in_glass / (along * before_glass) if before_glass > 0.0 else 0.0
    for k in range(3):
        back[k] = direction[k] - 2.0 * along * plate[1, k]
        starts[0, k] = eye[k] + height / along * direction[k]
        starts[1, k] = starts[0, k] + further * (direction[k] - along * plate[1, k])
    return True


@njit(cache=True, nogil=True)
def pass_through(
    eye: NDArray[np.float64],
    direction: NDArray[np.float64],
    plate: NDArray[np.float64],
    start: NDArray[np.float64],
) -> None:
    """Write (3,) where a ray of an eye seems to come from, behind the plate."""
    along, before_glass, in_glass = tangents(direction, plate[1], plate[2, 1])
    for k in range(3):
        start[k] = eye[k]
        if before_glass > 0.0:
            # The glass takes so much from the way aside that the ray would have gone.
            tangential = (direction[k] - along * plate[1, k]) / (along * before_glass)
            start[k] -= plate[2, 0] * (before_glass - in_glass) * tangential


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
        panel: (4, 3) its plane, as `meet` takes it.
        luminance: (h, w, C) of its pixels; each is a square that is lit evenly.
        n_samples: places along each side of a pixel of the picture.
        picture: (H, W, C) is added to.
    """
    direction, starts, back = np.empty(3), np.empty((2, 3)), np.empty(3)
    shares = plate[3] / (n_samples * n_samples)
    for row in range(picture.shape[0]):
        for column in range(picture.shape[1]):
            for sample in range(n_samples * n_samples):
                v = (sample // n_samples + 0.5) / n_samples
                u = (sample % n_samples + 0.5) / n_samples
                aim(rays, left_from_eye, row, column, v, u, direction)
                if not reflect(eye, direction, plate, starts, back):
                    continue
                for face in range(2):
                    x, y = meet(starts[face], back, panel)
                    if (
                        -0.5 <= x < luminance.shape[1] - 0.5
                        and -0.5 <= y < luminance.shape[0] - 0.5
                    ):
                        i, j = math.floor(x + 0.5), math.floor(y + 0.5)
                        for c in range(luminance.shape[2]):
                            picture[row, column, c] += shares[face] * luminance[j, i, c]


@njit(cache=True, nogil=True)
def look_up(texture: NDArray[np.float32], x: float, y: float, ground: float) -> float:
    """A texture between its pixels' centres; the ground beside it."""
    height, width = texture.shape
    if not (-0.5 < x < width - 0.5 and -0.5 < y < height - 0.5):
        return ground
    x, y = min(max(x, 0.0), width - 1.0), min(max(y, 0.0), height - 1.0)
    i, j = min(int(x), width - 2), min(int(y), height - 2)
    x, y = x - i, y - j
    upper = (1.0 - x) * texture[j, i] + x * texture[j, i + 1]
    lower = (1.0 - x) * texture[j + 1, i] + x * texture[j + 1, i + 1]
    return float((1.0 - y) * upper + y * lower)


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
        sheet: (4, 3) its plane, as `meet` takes it, by the texture's pixels.
        texture: (h, w) reflectance.
        n_samples: places along each side of a pixel of the picture.
        ground: reflectance of what is not the sheet.
        picture: (H, W), written.
    """
    direction, start = np.empty(3), np.empty(3)
    for row in range(picture.shape[0]):
        for column in range(picture.shape[1]):
            total = 0.0
            for sample in range(n_samples * n_samples):
                v = (sample // n_samples + 0.5) / n_samples
                u = (sample % n_samples + 0.5) / n_samples
                aim(rays, left_from_eye, row, column, v, u, direction)
                pass_through(eye, direction, plate, start)
                x, y = meet(start, direction, sheet)
                total += look_up(texture, x, y, ground)
            picture[row, column] = total / (n_samples * n_samples)
