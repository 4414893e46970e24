"""Compiled rasteriser: nearest surface per pixel."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from navapp.geometry.lane_kernels import (
    FLOAT_LANES,
    lane_numbers,
    load,
    smaller,
    spread,
    store,
    where_positive,
)
from navapp.geometry.motion_kernels import move_point


@njit(cache=True, nogil=True)
def project_points(
    points: NDArray[np.float64],
    rotation: NDArray[np.float64],
    translation: NDArray[np.float64],
    focal_px: float,
    centre: tuple[float, float],
    pixels: NDArray[np.float64],
    depths: NDArray[np.float64],
) -> None:
    """Pixels and depths of points that a pinhole camera sees.

    Args:
        points: (V, 3) mm.
        rotation: (3, 3) of the camera from the points.
        translation: (3,) of it, mm.
        focal_px: of the camera.
        centre: column and row of its axis, px.
        pixels: (V, 2) in place; NaN at or behind the camera.
        depths: (V,) in place, mm.
    """
    for i in range(points.shape[0]):
        across, down, depth = move_point(rotation, translation, points, i)
        scale = focal_px / depth if depth > 1e-6 else np.nan
        pixels[i, 0], pixels[i, 1] = scale * across + centre[0], scale * down + centre[1]
        depths[i] = depth


@njit(cache=True, nogil=True)
def bounds_of_points(
    points: NDArray[np.float64],
    rotation: NDArray[np.float64],
    translation: NDArray[np.float64],
    focal_px: float,
    centre: tuple[float, float],
) -> tuple[float, float, float, float, float, float]:
    """Least and largest column, row (of points before the camera) and depth; see `project_points`.

    No point before the camera: the least column is infinite.
    """
    u0, v0, u1, v1 = np.inf, np.inf, -np.inf, -np.inf
    near, far = np.inf, -np.inf
    for i in range(points.shape[0]):
        across, down, depth = move_point(rotation, translation, points, i)
        near, far = min(near, depth), max(far, depth)
        if not depth > 1e-6:
            continue
        u, v = focal_px * across / depth + centre[0], focal_px * down / depth + centre[1]
        u0, v0, u1, v1 = min(u0, u), min(v0, v), max(u1, u), max(v1, v)
    return u0, v0, u1, v1, near, far


@njit(cache=True, nogil=True)
def raster_nearest(
    pixels: NDArray[np.float64],
    depths: NDArray[np.float64],
    faces: NDArray[np.int32],
    inverse_depth: NDArray[np.float32],
    face_code: NDArray[np.float32],
    band: tuple[int, int],
    n_outward: int,
) -> None:
    """Draw triangles into an inverse-depth buffer; the larger value (nearer surface) stays.

    Args:
        pixels: (V, 2) px of the vertices, the buffer's pixel (0, 0) at its centre; NaN hides them.
        depths: (V,) depth along the optical axis, mm, positive in front.
        faces: (F, 3).
        inverse_depth: (h, pitch) in place, 1/mm, 0 where nothing is seen; it has `FLOAT_LANES`
            columns more than count.
        face_code: (h, pitch) in place: the bits of the triangle's number, an int32.
        band: first row to draw, and after the last.
        n_outward: so many triangles, the first, show no inner side: from behind they are left out.

    1/z is linear in the picture, so it is what is interpolated. Each weight is taken from the two
    ends of its edge: a neighbour computes the same number with the other sign, so that no pixel on
    a shared edge is lost to both.
    """
    pitch = inverse_depth.shape[1]
    width = pitch - FLOAT_LANES
    near, seen = inverse_depth.ravel(), face_code.ravel()
    codes = np.arange(faces.shape[0]).astype(np.int32).view(np.float32)
    first_row, last_row = band[0], band[1] - 1
    for f in range(faces.shape[0]):
        a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
        ax, ay = pixels[a, 0], pixels[a, 1]
        bx, by = pixels[b, 0], pixels[b, 1]
        cx, cy = pixels[c, 0], pixels[c, 1]
        area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        # Rows count downwards: counter-clockwise from outside is a negative area. False of NaN.
        if not (area < -1e-12 or (area > 1e-12 and f >= n_outward)):
            continue
        za, zb, zc = depths[a], depths[b], depths[c]
        if not (za > 1e-6 and zb > 1e-6 and zc > 1e-6):
            continue
        low_x, high_x = min(ax, bx, cx), max(ax, bx, cx)
        low_y, high_y = min(ay, by, cy), max(ay, by, cy)
        if high_x < 0.0 or high_y < first_row or low_x > width - 1 or low_y > last_row:
            continue
        x0, x1 = max(0, int(np.ceil(low_x))), min(width - 1, int(np.floor(high_x)))
        y0, y1 = max(first_row, int(np.ceil(low_y))), min(last_row, int(np.floor(high_y)))
        if x0 > x1 or y0 > y1:
            continue
        _draw(
            (ax, ay, bx, by, cx, cy), (1.0 / za, 1.0 / zb, 1.0 / zc), 1.0 / area,
            (x0, x1, y0, y1), pitch, codes[f], near, seen,
        )  # fmt: skip


@njit(cache=True, nogil=True)
def _draw(
    corners: tuple[float, float, float, float, float, float],
    inverse: tuple[float, float, float],
    scale: float,
    extent: tuple[int, int, int, int],
    pitch: int,
    code: np.float32,
    near: NDArray[np.float32],
    seen: NDArray[np.float32],
) -> None:
    """One triangle into flat buffers, eight pixels at once."""
    x0, x1, y0, y1 = extent
    ax, ay, bx, by, cx, cy = (
        np.float32(corners[0]), np.float32(corners[1]), np.float32(corners[2]),
        np.float32(corners[3]), np.float32(corners[4]), np.float32(corners[5]),
    )  # fmt: skip
    zero, face, per_area = spread(np.float32(0.0)), spread(code), spread(np.float32(scale))
    at_a = spread(np.float32(inverse[0]))
    to_b = spread(np.float32(inverse[1] - inverse[0]))
    to_c = spread(np.float32(inverse[2] - inverse[0]))
    for x in range(x0, x1 + 1, FLOAT_LANES):
        column = spread(np.float32(x)) + lane_numbers()
        a, b, c = spread(ax) - column, spread(bx) - column, spread(cx) - column
        for y in range(y0, y1 + 1):
            row = np.float32(y)
            da, db, dc = spread(ay - row), spread(by - row), spread(cy - row)
            wa = (b * dc - db * c) * per_area
            wb = (c * da - dc * a) * per_area
            wc = (a * db - da * b) * per_area
            value = at_a + wb * to_b + wc * to_c
            outside = zero - smaller(smaller(wa, wb), wc)
            at = y * pitch + x
            before = load(near, at)
            nearer = where_positive(outside, zero, value) - before
            store(near, at, where_positive(nearer, value, before))
            store(seen, at, where_positive(nearer, face, load(seen, at)))


@njit(cache=True, nogil=True)
def tell_depth(
    inverse_depth: NDArray[np.float32],
    face_code: NDArray[np.int32],
    band: tuple[int, int],
    depth: NDArray[np.float32],
    face_index: NDArray[np.int32],
) -> None:
    """Depth and triangle of some rows, from what `raster_nearest` has drawn.

    Args:
        inverse_depth: (h, pitch) 1/mm.
        face_code: (h, pitch).
        band: first row, and after the last.
        depth: (h, w) in place, mm; NaN where nothing is seen.
        face_index: (h, w) in place, -1 where nothing is seen.
    """
    unknown, one = np.float32(np.nan), np.float32(1.0)
    for y in range(band[0], band[1]):
        drawn, out = inverse_depth[y], depth[y]
        for x in range(out.shape[0]):
            out[x] = one / drawn[x] if drawn[x] > np.float32(0.0) else unknown
        face_index[y] = face_code[y, : face_index.shape[1]]


@njit(cache=True, nogil=True)
def render_rows(
    pixels: NDArray[np.float64],
    depths: NDArray[np.float64],
    faces: NDArray[np.int32],
    n_outward: int,
    band: tuple[int, int],
    inverse_depth: NDArray[np.float32],
    face_code: NDArray[np.float32],
    coded: NDArray[np.int32],
    depth: NDArray[np.float32],
    face_index: NDArray[np.int32],
) -> None:
    """`raster_nearest`, then `tell_depth`; `coded` is `face_code` read as whole numbers."""
    raster_nearest(pixels, depths, faces, inverse_depth, face_code, band, n_outward)
    tell_depth(inverse_depth, coded, band, depth, face_index)
