"""Solid noise on a surface: the value at a point, and the mean over what a pixel sees.

A pixel has an area: on a flank it sees a strip of the surface several times longer than wide. A
look-up at its middle alone would show a pattern that is not there (aliasing).
"""

import math
from typing import Any

import numpy as np
from numba import float32, int32, njit, uint32
from numpy.typing import NDArray

Floats = NDArray[np.float32]

# The swizzle and shift of the second lookup keep it unrelated to the first.
_SHIFT_X, _SHIFT_Y, _SHIFT_Z = 41.3, 17.9, 73.1
_INV_SIGMA = 1.0 / 40.0
# Look-ups of a pixel at most: of a surface that falls away by 16 mm per mm across, 86 degrees.
_MOST_LOOKUPS = 16


@njit(cache=True, nogil=True, inline="always")
def _floor(value: float) -> int:
    whole = int(value)
    return whole - 1 if value < whole else whole


@njit(cache=True, nogil=True, inline="always")
def _low(cell: int) -> Any:
    return float32(int32(cell) & 255)


@njit(cache=True, nogil=True, inline="always")
def _high(cell: int) -> Any:
    return float32(int32(cell) >> 8)


@njit(cache=True, nogil=True)
def sample_tile(tile: NDArray[np.uint16], x: float, y: float, z: float, out: Floats) -> None:
    """Trilinear value of both channels and the gradient of the first, at a point in voxels.

    Args:
        tile: (n, n, n) uint16, periodic, n a power of two; first channel in the low byte.
        x: position in voxels.
        y: likewise.
        z: likewise.
        out: (5,) float32 out: both values in deviations, then the gradient per voxel.
    """
    mask = tile.shape[0] - 1
    ix, iy, iz = _floor(x), _floor(y), _floor(z)
    fx, fy, fz = float32(x - ix), float32(y - iy), float32(z - iz)
    # Unsigned indices spare the test for negative ones.
    x0, x1 = uint32(ix & mask), uint32((ix + 1) & mask)
    y0, y1 = uint32(iy & mask), uint32((iy + 1) & mask)
    z0, z1 = uint32(iz & mask), uint32((iz + 1) & mask)
    t000, t001 = tile[x0, y0, z0], tile[x0, y0, z1]
    t010, t011 = tile[x0, y1, z0], tile[x0, y1, z1]
    t100, t101 = tile[x1, y0, z0], tile[x1, y0, z1]
    t110, t111 = tile[x1, y1, z0], tile[x1, y1, z1]
    one = float32(1.0)
    sigma = float32(_INV_SIGMA)
    v000, v001, v010, v011 = _low(t000), _low(t001), _low(t010), _low(t011)
    v100, v101, v110, v111 = _low(t100), _low(t101), _low(t110), _low(t111)
    a00, a01 = v000 + fz * (v001 - v000), v010 + fz * (v011 - v010)
    a10, a11 = v100 + fz * (v101 - v100), v110 + fz * (v111 - v110)
    b0, b1 = a00 + fy * (a01 - a00), a10 + fy * (a11 - a10)
    out[0] = (b0 + fx * (b1 - b0) - float32(128.0)) * sigma
    out[2] = (b1 - b0) * sigma
    out[3] = ((one - fx) * (a01 - a00) + fx * (a11 - a10)) * sigma
    out[4] = (
        (one - fx) * ((one - fy) * (v001 - v000) + fy * (v011 - v010))
        + fx * ((one - fy) * (v101 - v100) + fy * (v111 - v110))
    ) * sigma
    c00 = _high(t000) + fz * (_high(t001) - _high(t000))
    c01 = _high(t010) + fz * (_high(t011) - _high(t010))
    c10 = _high(t100) + fz * (_high(t101) - _high(t100))
    c11 = _high(t110) + fz * (_high(t111) - _high(t110))
    d0, d1 = c00 + fy * (c01 - c00), c10 + fy * (c11 - c10)
    out[1] = (d0 + fx * (d1 - d0) - float32(128.0)) * sigma


@njit(cache=True, nogil=True, inline="always")
def cross_pixel(
    screen: NDArray[np.float64],
    corners: tuple[int, int, int],
    view: tuple[float, float, float, float],
    body_from_camera: Floats,
    across: Floats,
) -> int:
    """The way across a pixel's surface where it is steepest, and how many look-ups it needs.

    Args:
        screen: (V, 3) of `shade`.
        corners: of the pixel's triangle.
        view: x / z, y / z and z (mm) of the pixel's middle, focal length (px).
        body_from_camera: (3, 4) float32.
        across: (3,) float32 out: from edge to edge of the pixel, mm, in the body's frame.
    """
    a, b, c = corners
    ray_x, ray_y, z, focal_px = view
    ub, vb = screen[b, 0] - screen[a, 0], screen[b, 1] - screen[a, 1]
    uc, vc = screen[c, 0] - screen[a, 0], screen[c, 1] - screen[a, 1]
    wb, wc = screen[b, 2] - screen[a, 2], screen[c, 2] - screen[a, 2]
    # 1 / z is linear in the picture. The gradient of z over z / f is the depth per way across.
    scale = -z * focal_px / (ub * vc - uc * vb)
    fall_u, fall_v = (wb * vc - wc * vb) * scale, (ub * wc - uc * wb) * scale
    steepness = math.sqrt(fall_u * fall_u + fall_v * fall_v)
    if steepness <= 1.0:
        return 1
    kept = min(steepness, float(_MOST_LOOKUPS))
    width_mm = z / focal_px
    x, y = fall_u / steepness * width_mm, fall_v / steepness * width_mm
    depth = kept * width_mm
    x, y = x + ray_x * depth, y + ray_y * depth
    for k in range(3):
        across[k] = (
            body_from_camera[k, 0] * x + body_from_camera[k, 1] * y + body_from_camera[k, 2] * depth
        )
    return math.ceil(kept)


@njit(cache=True, nogil=True)
def sample_surface(
    tile: NDArray[np.uint16],
    voxels_per_mm: tuple[float, float],
    texture: Floats,
    point: Floats,
    across: Floats,
    lookups: int,
    out: Floats,
) -> None:
    """Mean of the fine and of the coarse noise on a way across a pixel.

    Args:
        tile: of `sample_tile`.
        voxels_per_mm: of the fine and of the coarse look-up.
        texture: (4,) float32 sign of x and shift, mm.
        point: (3,) float32 the way's middle, mm, in the body's frame.
        across: (3,) float32 from its beginning to its end, likewise.
        lookups: evenly spaced on it.
        out: (3, 5) float32 out: fine and coarse as of `sample_tile`; the last row is overwritten.
    """
    fine_scale, coarse_scale = voxels_per_mm
    out[:2] = float32(0.0)
    share = float32(1.0) / float32(lookups)
    for k in range(lookups):
        t = (float32(k) + float32(0.5)) * share - float32(0.5)
        x = (point[0] + t * across[0]) * texture[0] + texture[1]
        y = point[1] + t * across[1] + texture[2]
        z = point[2] + t * across[2] + texture[3]
        # The block is contiguous along the picture's rows, for the cache.
        sample_tile(tile, z * fine_scale, y * fine_scale, x * fine_scale, out[2])
        for m in range(5):
            out[0, m] += share * out[2, m]
        sample_tile(
            tile,
            y * coarse_scale + float32(_SHIFT_X),
            z * coarse_scale + float32(_SHIFT_Y),
            x * coarse_scale + float32(_SHIFT_Z),
            out[2],
        )
        for m in range(5):
            out[1, m] += share * out[2, m]
