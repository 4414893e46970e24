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
    band: tuple[int, int],
    is_closed: bool,
) -> None:
    """Draw triangles into an inverse-depth buffer; the larger value (nearer surface) stays.

    Args:
        pixels: (V, 2) px of the vertices, the buffer's pixel (0, 0) at its centre; NaN hides them.
        depths: (V,) depth along the optical axis, mm, positive in front.
        faces: (F, 3).
        inverse_depth: (h, w) in place, 1/mm, 0 where nothing is seen.
        face_index: (h, w) in place, -1 where nothing is seen.
        band: first row to draw, and after the last.
        is_closed: the mesh shows no inner side: triangles seen from behind are left out.

    1/z is linear in the picture, so it is what is interpolated. Each weight is taken from the two
    ends of its edge: a neighbour computes the same number with the other sign, so that no pixel on
    a shared edge is lost to both.
    """
    width = inverse_depth.shape[1]
    first_row, last_row = band[0], band[1] - 1
    for f in range(faces.shape[0]):
        a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
        za, zb, zc = depths[a], depths[b], depths[c]
        if not (za > 1e-6 and zb > 1e-6 and zc > 1e-6):
            continue
        ax, ay = pixels[a, 0], pixels[a, 1]
        bx, by = pixels[b, 0], pixels[b, 1]
        cx, cy = pixels[c, 0], pixels[c, 1]
        area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        # Rows count downwards: counter-clockwise from outside is a negative area.
        if not (area < -1e-12 or (area > 1e-12 and not is_closed)):
            continue
        low_x, high_x = min(ax, bx, cx), max(ax, bx, cx)
        low_y, high_y = min(ay, by, cy), max(ay, by, cy)
        if high_x < 0.0 or high_y < first_row or low_x > width - 1 or low_y > last_row:
            continue
        x0, x1 = max(0, int(np.ceil(low_x))), min(width - 1, int(np.floor(high_x)))
        y0, y1 = max(first_row, int(np.ceil(low_y))), min(last_row, int(np.floor(high_y)))
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
