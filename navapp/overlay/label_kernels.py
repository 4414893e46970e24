"""Compiled placing and blending of words."""

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit(cache=True, nogil=True)
def find_free_place(
    places: NDArray[np.int64],
    size_px: tuple[int, int],
    picture_px: tuple[int, int],
    others: NDArray[np.int64],
) -> int:
    """Number of the first box that lies in the picture and over no other one; -1 without any.

    Args:
        places: (N, 2) column and row of the boxes' first pixels.
        size_px: width and height of each.
        picture_px: width and height.
        others: (M, 4) column, row, width and height.
    """
    w, h = size_px
    for number in range(len(places)):
        x, y = places[number, 0], places[number, 1]
        if x < 0 or y < 0 or x + w > picture_px[0] or y + h > picture_px[1]:
            continue
        is_free = True
        for k in range(len(others)):
            ox, oy, ow, oh = others[k, 0], others[k, 1], others[k, 2], others[k, 3]
            if x < ox + ow and ox < x + w and y < oy + oh and oy < y + h:
                is_free = False
                break
        if is_free:
            return number
    return -1


@njit(cache=True, nogil=True)
def blend_text(
    image: NDArray[np.uint8],
    letters: NDArray[np.float32],
    rim: NDArray[np.float32],
    corner: tuple[int, int],
    colour: tuple[int, int, int],
) -> None:
    """Blend letters over their dark rim.

    Args:
        image: (H, W, 3) in place.
        letters: (h, w) share of the colour, 0 to 1.
        rim: (h, w) share of black below the letters.
        corner: column and row of the first pixel; what lies beside the picture is left out.
        colour: of the image's channels.
    """
    height, width = letters.shape
    for y in range(max(0, -corner[1]), min(height, image.shape[0] - corner[1])):
        for x in range(max(0, -corner[0]), min(width, image.shape[1] - corner[0])):
            dark, lit = rim[y, x], letters[y, x]
            if dark <= 0.0:
                continue
            row, column = y + corner[1], x + corner[0]
            for k in range(3):
                below = np.float32(image[row, column, k]) * (np.float32(1.0) - dark)
                after = below + lit * (np.float32(colour[k]) - below)
                image[row, column, k] = np.uint8(after + np.float32(0.5))
