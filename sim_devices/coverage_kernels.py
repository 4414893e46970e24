"""Pixels with an edge in them: which surface each of their nine places shows.

A pixel has an area. One look at its middle would move an edge by up to half a pixel, in each eye
another way. Only pixels with an edge are looked at in nine places, a third of a pixel apart.
"""

import math
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from sim_devices.raster_kernels import BARELY, read_front_face

# A depth step of more pixel widths than this, per pixel between, counts as an edge: 76 degrees.
_STEEPEST = 4.0
_THIRD = 1.0 / 3.0


@njit(cache=True, nogil=True, inline="always")
def find_place(m: int) -> Any:
    """How far place m (0 to 8) lies right of its pixel's middle, and below it, px."""
    return (m % 3 - 1) * _THIRD, (m // 3 - 1) * _THIRD


@njit(cache=True, nogil=True)
def number_edges(
    triangle: NDArray[np.int32],
    inverse_depth: NDArray[np.float32],
    part_of_face: NDArray[np.uint8],
    material_of_face: NDArray[np.uint8],
    box: NDArray[np.int64],
    focal_px: float,
    edge_number: NDArray[np.int32],
) -> int:
    """Number the pixels of a box that one of their eight neighbours differs from; how many.

    It differs in part, material, or by a jump in depth.

    Args:
        triangle: (H, W) int32, -1 for none.
        inverse_depth: (H, W) float32 per mm.
        part_of_face: (F,) uint8.
        material_of_face: (F,) uint8.
        box: (4,) int64 x0, y0, x1, y1; neighbours beside it do not count.
        focal_px: mean focal length.
        edge_number: (H, W) int32 out: 0 .. n - 1 row by row, -1 elsewhere in the box.
    """
    x0, y0, x1, y1 = box[0], box[1], box[2], box[3]
    edge_number[y0:y1, x0:x1] = -1
    for y in range(y0, y1):
        for x in range(x0, x1):
            here = triangle[y, x]
            # The neighbours before it have looked at it.
            for k in range(4):
                u, v = x + (1 if k < 2 else k - 3), y + (0 if k == 0 else 1)
                if u < x0 or u >= x1 or v >= y1 or triangle[v, u] == here:
                    continue
                there = triangle[v, u]
                is_edge = (
                    here < 0
                    or there < 0
                    or part_of_face[here] != part_of_face[there]
                    or material_of_face[here] != material_of_face[there]
                )
                if not is_edge:
                    # (far - near) over the near pixel's width, near / focal_px.
                    w1, w2 = inverse_depth[y, x], inverse_depth[v, u]
                    step = focal_px * (max(w1, w2) / min(w1, w2) - 1.0)
                    is_edge = step > _STEEPEST * (math.sqrt(2.0) if k == 1 or k == 2 else 1.0)
                if is_edge:
                    edge_number[y, x] = edge_number[v, u] = 0
    n = 0
    for y in range(y0, y1):
        for x in range(x0, x1):
            if edge_number[y, x] == 0:
                edge_number[y, x] = n
                n += 1
    return n


@njit(cache=True, nogil=True)
def raster_places(
    screen: NDArray[np.float64],
    faces: NDArray[np.int32],
    first_id: int,
    box: NDArray[np.int64],
    edge_number: NDArray[np.int32],
    inverse_depth: NDArray[np.float32],
    triangle: NDArray[np.int32],
) -> None:
    """As `raster_triangles`, but into the nine places of the numbered pixels.

    Args:
        screen: (V, 3) of `raster_triangles`.
        faces: (F, 3) likewise.
        first_id: likewise.
        box: (4,) likewise.
        edge_number: (H, W) int32 of `number_edges`.
        inverse_depth: (K, 9) float32 in and out, of the places of `find_place`.
        triangle: (K, 9) int32 in and out.
    """
    for f in range(faces.shape[0]):
        (ua, va, wa), (ub, vb, wb), (uc, vc, wc), area = read_front_face(screen, faces, f)
        if area <= BARELY:
            continue
        u_low, u_high = min(ua, ub, uc) - _THIRD, max(ua, ub, uc) + _THIRD
        v_low, v_high = min(va, vb, vc) - _THIRD, max(va, vb, vc) + _THIRD
        if u_high < box[0] or u_low > box[2] - 1 or v_high < box[1] or v_low > box[3] - 1:
            continue
        x0, y0 = max(box[0], int(np.ceil(u_low))), max(box[1], int(np.ceil(v_low)))
        x1, y1 = min(box[2] - 1, int(np.floor(u_high))), min(box[3] - 1, int(np.floor(v_high)))
        scale = 1.0 / area
        for y in range(y0, y1 + 1):
            for x in range(x0, x1 + 1):
                edge = edge_number[y, x]
                if edge < 0:
                    continue
                for m in range(9):
                    du, dv = find_place(m)
                    u, v = x + du, y + dv
                    ba = ((uc - ub) * (v - vb) - (vc - vb) * (u - ub)) * scale
                    bb = ((ua - uc) * (v - vc) - (va - vc) * (u - uc)) * scale
                    if ba < -BARELY or bb < -BARELY or ba + bb > 1.0 + BARELY:
                        continue
                    w = wc + ba * (wa - wc) + bb * (wb - wc)
                    if w > inverse_depth[edge, m]:
                        inverse_depth[edge, m] = w
                        triangle[edge, m] = first_id + f
