"""Projection and z-buffer of the simulator's optics.

Written apart from the pipeline's own z-buffer, so that an error in one does not hide in the other.
"""

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

# Areas (px^2) and weights of corners this near to 0 count as 0.
BARELY = 1e-12


@njit(cache=True, nogil=True)
def project_vertices(
    points: NDArray[np.float64],
    pose: NDArray[np.float64],
    camera: NDArray[np.float64],
    screen: NDArray[np.float64],
    bounds: NDArray[np.float64],
) -> None:
    """Exact projection of every vertex, distortion included (OpenCV's model, first 12 terms).

    Args:
        points: (V, 3) float64 mm in the body's frame.
        pose: (3, 4) float64 camera_from_body.
        camera: (16,) float64: fx, fy, cx, cy, then k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4.
        screen: (V, 3) float64 out: u px, v px, 1 / z per mm; 1 / z is 0 at or behind the camera.
        bounds: (4,) float64 out: smallest u and v, largest u and v of the vertices in front.
    """
    bounds[0], bounds[1], bounds[2], bounds[3] = 1e300, 1e300, -1e300, -1e300
    for i in range(points.shape[0]):
        px, py, pz = points[i, 0], points[i, 1], points[i, 2]
        z = pose[2, 0] * px + pose[2, 1] * py + pose[2, 2] * pz + pose[2, 3]
        if z < 1.0:
            screen[i, 0] = 0.0
            screen[i, 1] = 0.0
            screen[i, 2] = 0.0
            continue
        w = 1.0 / z
        x = (pose[0, 0] * px + pose[0, 1] * py + pose[0, 2] * pz + pose[0, 3]) * w
        y = (pose[1, 0] * px + pose[1, 1] * py + pose[1, 2] * pz + pose[1, 3]) * w
        r2 = x * x + y * y
        radial = (1.0 + r2 * (camera[4] + r2 * (camera[5] + r2 * camera[8]))) / (
            1.0 + r2 * (camera[9] + r2 * (camera[10] + r2 * camera[11]))
        )
        xy2 = 2.0 * x * y
        xd = x * radial + camera[6] * xy2 + camera[7] * (r2 + 2.0 * x * x)
        yd = y * radial + camera[6] * (r2 + 2.0 * y * y) + camera[7] * xy2
        xd += r2 * (camera[12] + r2 * camera[13])
        yd += r2 * (camera[14] + r2 * camera[15])
        u = camera[0] * xd + camera[2]
        v = camera[1] * yd + camera[3]
        screen[i, 0] = u
        screen[i, 1] = v
        screen[i, 2] = w
        bounds[0], bounds[1] = min(bounds[0], u), min(bounds[1], v)
        bounds[2], bounds[3] = max(bounds[2], u), max(bounds[3], v)


@njit(cache=True, nogil=True, inline="always")
def read_front_face(screen: NDArray[np.float64], faces: NDArray[np.int32], f: int) -> Any:
    """Corners (u, v, 1 / z) of a face clockwise in the picture, and twice its area there, px^2.

    The area is at most 0 of a face that is seen from behind, and of one that cannot be drawn.

    Args:
        screen: (V, 3) of `raster_triangles`.
        faces: (F, 3) likewise.
        f: index of the face.
    """
    a, b, c = faces[f, 0], faces[f, 2], faces[f, 1]
    ua, va, wa = screen[a, 0], screen[a, 1], screen[a, 2]
    ub, vb, wb = screen[b, 0], screen[b, 1], screen[b, 2]
    uc, vc, wc = screen[c, 0], screen[c, 1], screen[c, 2]
    area = 0.0
    if wa > 0.0 and wb > 0.0 and wc > 0.0:
        area = (ub - ua) * (vc - va) - (vb - va) * (uc - ua)
    return (ua, va, wa), (ub, vb, wb), (uc, vc, wc), area


@njit(cache=True, nogil=True)
def raster_triangles(
    screen: NDArray[np.float64],
    faces: NDArray[np.int32],
    first_id: int,
    box: NDArray[np.int64],
    inverse_depth: NDArray[np.float32],
    triangle: NDArray[np.int32],
) -> None:
    """Draw front faces into a z-buffer; the larger inverse depth wins.

    1 / z is linear in the picture, so its interpolation is perspective-correct. A pixel belongs to
    a triangle when its centre lies in it or on its border.

    Args:
        screen: (V, 3) float64 u px, v px, 1 / z; 0 marks a vertex that cannot be drawn.
        faces: (F, 3) int32, counter-clockwise from outside (hence clockwise with v downwards).
        first_id: what face 0 is called in `triangle`.
        box: (4,) int64 x0, y0, x1, y1; columns x0 .. x1 - 1 and rows y0 .. y1 - 1 are drawn.
        inverse_depth: (H, W) float32 in and out.
        triangle: (H, W) int32 in and out: the face seen by each pixel.
    """
    for f in range(faces.shape[0]):
        (ua, va, wa), (ub, vb, wb), (uc, vc, wc), area = read_front_face(screen, faces, f)
        if area <= BARELY:
            continue
        # Compared as floats first: a triangle far outside must not overflow an integer.
        u_low, u_high = min(ua, ub, uc), max(ua, ub, uc)
        v_low, v_high = min(va, vb, vc), max(va, vb, vc)
        if u_high < box[0] or u_low > box[2] - 1 or v_high < box[1] or v_low > box[3] - 1:
            continue
        x0 = max(box[0], int(u_low) + (1 if u_low > int(u_low) else 0))
        y0 = max(box[1], int(v_low) + (1 if v_low > int(v_low) else 0))
        x1 = min(box[2] - 1, int(u_high))
        y1 = min(box[3] - 1, int(v_high))
        if x0 > x1 or y0 > y1:
            continue
        scale = 1.0 / area
        step_a, step_b = (vb - vc) * scale, (vc - va) * scale
        step_w = step_a * (wa - wc) + step_b * (wb - wc)
        for y in range(y0, y1 + 1):
            ba = ((uc - ub) * (y - vb) - (vc - vb) * (x0 - ub)) * scale
            bb = ((ua - uc) * (y - vc) - (va - vc) * (x0 - uc)) * scale
            w = wc + ba * (wa - wc) + bb * (wb - wc)
            for x in range(x0, x1 + 1):
                if (
                    ba >= -BARELY
                    and bb >= -BARELY
                    and ba + bb <= 1.0 + BARELY
                    and w > inverse_depth[y, x]
                ):
                    inverse_depth[y, x] = w
                    triangle[y, x] = first_id + f
                ba += step_a
                bb += step_b
                w += step_w
