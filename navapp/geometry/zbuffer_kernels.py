"""Compiled rasteriser: nearest surface per pixel."""

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit(cache=True, nogil=True)
def raster_nearest(
    pixels: NDArray[np.float64],
    depths: NDArray[np.float64],
    faces: NDArray[np.int32],
    inverse_depth: NDArray[np.float32],
    face_index: NDArray[np.int32],
) -> None:
    """Draw triangles into an inverse-depth buffer; the larger value (nearer surface) stays.

    Args:
        pixels: (V, 2) px of the vertices, the buffer's pixel (0, 0) at its centre; NaN hides them.
        depths: (V,) depth along the optical axis, mm, positive in front.
        faces: (F, 3).
        inverse_depth: (h, w) in place, 1/mm, 0 where nothing is seen.
        face_index: (h, w) in place, -1 where nothing is seen.

    1/z is linear in the picture, so it is what is interpolated. Each weight is taken from the two
    ends of its edge: a neighbour computes the same number with the other sign, so that no pixel on
    a shared edge is lost to both.
    """
    height, width = inverse_depth.shape
    for f in range(faces.shape[0]):
        a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
        za, zb, zc = depths[a], depths[b], depths[c]
        if not (za > 1e-6 and zb > 1e-6 and zc > 1e-6):
            continue
        ax, ay = pixels[a, 0], pixels[a, 1]
        bx, by = pixels[b, 0], pixels[b, 1]
        cx, cy = pixels[c, 0], pixels[c, 1]
        area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        if not (area > 1e-12 or area < -1e-12):
            continue
        low_x, high_x = min(ax, bx, cx), max(ax, bx, cx)
        low_y, high_y = min(ay, by, cy), max(ay, by, cy)
        if high_x < 0.0 or high_y < 0.0 or low_x > width - 1 or low_y > height - 1:
            continue
        x0, x1 = max(0, int(np.ceil(low_x))), min(width - 1, int(np.floor(high_x)))
        y0, y1 = max(0, int(np.ceil(low_y))), min(height - 1, int(np.floor(high_y)))
        ia, ib, ic = 1.0 / za, 1.0 / zb, 1.0 / zc
        scale = 1.0 / area
        for y in range(y0, y1 + 1):
            for x in range(x0, x1 + 1):
                wa = ((bx - x) * (cy - y) - (by - y) * (cx - x)) * scale
                wb = ((cx - x) * (ay - y) - (cy - y) * (ax - x)) * scale
                wc = ((ax - x) * (by - y) - (ay - y) * (bx - x)) * scale
                if wa < 0.0 or wb < 0.0 or wc < 0.0:
                    continue
                value = wa * ia + wb * ib + wc * ic
                if value > inverse_depth[y, x]:
                    inverse_depth[y, x] = value
                    face_index[y, x] = f
