"""A flat printed sheet in a picture, ray by ray."""

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit(cache=True, nogil=True)
def draw_sheet(
    rays: NDArray[np.float64],
    texture_from_ray: NDArray[np.float64],
    texture: NDArray[np.float32],
    n_samples: int,
    ground: float,
    shade: float,
    box: NDArray[np.int64],
    picture: NDArray[np.float32],
) -> None:
    """Every pixel the mean of n x n places of the sheet, each between the texture's pixels.

    Args:
        rays: (H + 1, W + 1, 2) x and y of the directions (z = 1) through the pixels' corners.
        texture_from_ray: (3, 3) homography from a direction to texture pixels, whose integer
            places are centres; its third row is positive for all directions towards the sheet.
        texture: (h, w) float32 radiance of the sheet, fully lit.
        n_samples: places along each side of a pixel.
        ground: radiance of what is not the sheet.
        shade: share of the light that the sheet gets.
        box: (4,) first row, last row + 1, first column, last column + 1 that the sheet may touch.
        picture: (H, W) float32, written inside the box.
    """
    height, width = texture.shape
    m = texture_from_ray
    n = box[3] - box[2] + 1
    places = np.empty((2, n, 2))
    for row in range(box[0] - 1, box[1]):
        places[0] = places[1]
        for k in range(n):
            x, y = rays[row + 1, box[2] + k, 0], rays[row + 1, box[2] + k, 1]
            depth = max(m[2, 0] * x + m[2, 1] * y + m[2, 2], 1e-9)
            places[1, k, 0] = (m[0, 0] * x + m[0, 1] * y + m[0, 2]) / depth
            places[1, k, 1] = (m[1, 0] * x + m[1, 1] * y + m[1, 2]) / depth
        if row < box[0]:
            continue
        for k in range(n - 1):
            total = 0.0
            for i in range(n_samples):
                v = (i + 0.5) / n_samples
                s0 = (1.0 - v) * places[0, k, 0] + v * places[1, k, 0]
                t0 = (1.0 - v) * places[0, k, 1] + v * places[1, k, 1]
                s1 = (1.0 - v) * places[0, k + 1, 0] + v * places[1, k + 1, 0]
                t1 = (1.0 - v) * places[0, k + 1, 1] + v * places[1, k + 1, 1]
                for j in range(n_samples):
                    u = (j + 0.5) / n_samples
                    s, t = s0 + u * (s1 - s0), t0 + u * (t1 - t0)
                    if not (s > -0.5 and t > -0.5 and s < width - 0.5 and t < height - 0.5):
                        total += ground
                        continue
                    s, t = min(max(s, 0.0), width - 1.0), min(max(t, 0.0), height - 1.0)
                    left, top = min(int(s), width - 2), min(int(t), height - 2)
                    s, t = s - left, t - top
                    upper = (1.0 - s) * texture[top, left] + s * texture[top, left + 1]
                    lower = (1.0 - s) * texture[top + 1, left] + s * texture[top + 1, left + 1]
                    total += shade * ((1.0 - t) * upper + t * lower)
            picture[row, box[2] + k] = total / (n_samples * n_samples)
