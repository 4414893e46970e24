"""Compiled placing and blending of words."""

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit(cache=True, nogil=True)
def find_free_place(
    at: tuple[float, float],
    offsets_px: NDArray[np.float64],
    shares: NDArray[np.float64],
    size_px: tuple[int, int],
    picture_px: tuple[int, int],
    others: NDArray[np.int64],
) -> tuple[int, int, bool]:
    """Column and row of the first box that lies in the picture and over no other; if there is one.

    Args:
        at: column and row that the boxes lie around.
        offsets_px: (N, 2) of each box from there.
        shares: (N, 2) of its own size that it is moved by besides.
        size_px: width and height of the boxes.
        picture_px: width and height.
        others: (M, 4) column, row, width and height.
    """
    w, h = size_px
    for k in range(len(offsets_px)):
        x = int(np.floor(at[0] + offsets_px[k, 0] + shares[k, 0] * w + 0.5))
        y = int(np.floor(at[1] + offsets_px[k, 1] + shares[k, 1] * h + 0.5))
        if x < 0 or y < 0 or x + w > picture_px[0] or y + h > picture_px[1]:
            continue
        is_free = True
        for m in range(len(others)):
            ox, oy, ow, oh = others[m, 0], others[m, 1], others[m, 2], others[m, 3]
            if x < ox + ow and ox < x + w and y < oy + oh and oy < y + h:
                is_free = False
                break
        if is_free:
            return x, y, True
    return 0, 0, False


@njit(cache=True, nogil=True)
def blend_text(
    image: NDArray[np.uint8],
    letters: NDArray[np.uint8],
    rim: NDArray[np.uint8],
    corner: tuple[int, int],
    colour: tuple[int, int, int],
) -> None:
    """Blend letters over their dark rim.

    Args:
        image: (H, W, 3) in place.
        letters: (h, w) share of the colour, 0 to 255.
        rim: (h, w) share of black below the letters.
        corner: column and row of the first pixel; what lies beside the picture is left out.
        colour: of the image's channels.
    """
    height, width = letters.shape
    for y in range(max(0, -corner[1]), min(height, image.shape[0] - corner[1])):
        for x in range(max(0, -corner[0]), min(width, image.shape[1] - corner[0])):
            if rim[y, x] == 0:
                continue
            dark = np.float32(rim[y, x]) / np.float32(255.0)
            lit = np.float32(letters[y, x]) / np.float32(255.0)
            row, column = y + corner[1], x + corner[0]
            for k in range(3):
                below = np.float32(image[row, column, k]) * (np.float32(1.0) - dark)
                after = below + lit * (np.float32(colour[k]) - below)
                image[row, column, k] = np.uint8(after + np.float32(0.5))
