"""Shading of the rastered picture: colour, lamps, wet highlights, crevices."""

import math
from typing import Any

import numpy as np
from numba import float32, njit, uint32
from numpy.typing import NDArray

from sim_devices.coverage_kernels import find_place
from sim_devices.texture_kernels import cross_pixel, sample_surface

Floats = NDArray[np.float32]

# Columns of the material table (materials.Material.row).
_COLOUR, _SECOND, _MARKED = 0, 3, 6
_MIX_AT, _MIX_SLOPE, _FINE, _COARSE, _PORES, _BUMP = 9, 10, 11, 12, 13, 14
_MARK_NOISE, _SPECULAR, _SHININESS, _MARKED_SPECULAR, _BLOOD_AT, _WRAP = 15, 16, 17, 18, 19, 20
_MIRROR, _ROUGHNESS = 21, 22

# Of a lamp as a mirror shows it: its radius (rad), and its light over that of the lit site.
_LAMP_RADIUS, _LAMP_LIGHT = 0.13, 1.0 / 0.13**2

# A point so much deeper (mm) than its surroundings gets no light but what is left in any crevice.
_DARK_BEHIND_MM, _LEAST_LIGHT = 22.0, 0.25


@njit(cache=True, nogil=True, inline="always")
def _step(value: float) -> Any:
    """Smooth step of a value clamped to 0 .. 1."""
    t = min(float32(1.0), max(float32(0.0), value))
    return t * t * (float32(3.0) - float32(2.0) * t)


@njit(cache=True, nogil=True)
def compute_albedo(
    materials: Floats, row: int, fine: Floats, coarse: Floats, mark: float, out: Floats
) -> None:
    """Reflectance of a point from its noise, and how wet it is.

    Args:
        materials: (M, 23) float32 table.
        row: of the table.
        fine: (5,) float32 of `sample_tile`.
        coarse: likewise, of the coarse lookup.
        mark: 0 to 1.
        out: (5,) float32 out: B, G, R, factor of the highlight, share of blood.
    """
    one = float32(1.0)
    mixed = _step(
        (float32(0.8) * coarse[0] + float32(0.6) * fine[1] - materials[row, _MIX_AT])
        * materials[row, _MIX_SLOPE]
        + float32(0.5)
    )
    frayed = mark + materials[row, _MARK_NOISE] * (
        float32(0.7) * coarse[1] + float32(0.5) * fine[1]
    ) * (float32(4.0) * mark * (one - mark))
    marked = _step((frayed - float32(0.25)) * float32(2.0))
    texture = one + materials[row, _FINE] * fine[0] + materials[row, _COARSE] * coarse[0]
    texture -= materials[row, _PORES] * _step((float32(-1.2) - fine[0]) * float32(1.2))
    texture = max(texture, float32(0.1))
    bloody = _step(
        (coarse[1] + float32(0.22) * fine[1] - materials[row, _BLOOD_AT]) * float32(3.0)
        + float32(0.5)
    )
    # A film of blood is thin at its border and hides the ground in its middle.
    film = bloody * (float32(0.84) + float32(0.08) * fine[0])
    film = min(one, max(float32(0.0), film))
    for k in range(3):
        value = materials[row, _COLOUR + k] + mixed * (
            materials[row, _SECOND + k] - materials[row, _COLOUR + k]
        )
        value += marked * (materials[row, _MARKED + k] - value)
        out[k] = value * texture
    out[0] += film * (float32(0.020) - out[0])
    out[1] += film * (float32(0.022) - out[1])
    out[2] += film * (float32(0.23) - out[2])
    wet = one + marked * (materials[row, _MARKED_SPECULAR] - one)
    wet *= max(float32(0.0), one + float32(0.45) * coarse[1])
    out[3] = materials[row, _SPECULAR] * wet + film * float32(0.9)
    out[4] = film


@njit(cache=True, nogil=True, inline="always")
def _bilinear(grid: Floats, x: float, y: float) -> Any:
    """Value of a coarse grid; positions are clamped to it."""
    x = min(max(x, float32(0.0)), float32(grid.shape[1] - 1))
    y = min(max(y, float32(0.0)), float32(grid.shape[0] - 1))
    x0, y0 = int(x), int(y)
    x1, y1 = min(x0 + 1, grid.shape[1] - 1), min(y0 + 1, grid.shape[0] - 1)
    fx, fy = float32(x - x0), float32(y - y0)
    top = grid[y0, x0] + fx * (grid[y0, x1] - grid[y0, x0])
    bottom = grid[y1, x0] + fx * (grid[y1, x1] - grid[y1, x0])
    return top + fy * (bottom - top)


@njit(cache=True, nogil=True, inline="always")
def _corner_weights(
    screen: NDArray[np.float64], a: int, b: int, c: int, x: float, y: float, weights: Floats
) -> None:
    """Perspective-correct weights of a triangle's corners at a place of the picture."""
    ua, va = screen[a, 0], screen[a, 1]
    ub, vb = screen[b, 0], screen[b, 1]
    uc, vc = screen[c, 0], screen[c, 1]
    wa = ((uc - ub) * (y - vb) - (vc - vb) * (x - ub)) * screen[a, 2]
    wb = ((ua - uc) * (y - vc) - (va - vc) * (x - uc)) * screen[b, 2]
    wc = ((ub - ua) * (y - va) - (vb - va) * (x - ua)) * screen[c, 2]
    scale = 1.0 / (wa + wb + wc)
    weights[0] = wa * scale
    weights[1] = wb * scale
    weights[2] = wc * scale


@njit(cache=True, nogil=True, inline="always")
def _blend(attributes: Floats, a: int, b: int, c: int, column: int, weights: Floats) -> Any:
    """An attribute between its values at the corners."""
    return (
        weights[0] * attributes[a, column]
        + weights[1] * attributes[b, column]
        + weights[2] * attributes[c, column]
    )


@njit(cache=True, nogil=True, inline="always")
def _bump_normal(
    attributes: Floats,
    a: int,
    b: int,
    c: int,
    weights: Floats,
    bump: float,
    sign: float,
    fine: Floats,
    normal: Floats,
) -> None:
    """The smooth normal, tilted by the noise's slope; `sign` is -1 in a mirrored texture."""
    # The tile was sampled with its axes reversed.
    nx = _blend(attributes, a, b, c, 0, weights) - bump * fine[4] * sign
    ny = _blend(attributes, a, b, c, 1, weights) - bump * fine[3]
    nz = _blend(attributes, a, b, c, 2, weights) - bump * fine[2]
    scale = float32(1.0) / math.sqrt(nx * nx + ny * ny + nz * nz)
    normal[0] = nx * scale
    normal[1] = ny * scale
    normal[2] = nz * scale


@njit(cache=True, nogil=True, inline="always")
def _place(
    poses: Floats, part: int, ray_x: float, ray_y: float, z: float, point: Floats, eye: Floats
) -> None:
    """The seen point and the camera's centre in the body's frame."""
    x, y = ray_x * z, ray_y * z
    for k in range(3):
        eye[k] = poses[part, k, 3]
        point[k] = (
            poses[part, k, 0] * x
            + poses[part, k, 1] * y
            + poses[part, k, 2] * z
            + poses[part, k, 3]
        )


@njit(cache=True, nogil=True)
def compute_light(
    lamps: Floats,
    part: int,
    normal: Floats,
    point: Floats,
    eye: Floats,
    wrap: float,
    shininess: float,
    out: Floats,
) -> None:
    """Diffuse and highlight sums of all lamps at one point.

    Args:
        lamps: (P, L, 4) float32 unit direction towards the lamp, strength.
        part: whose frame.
        normal: (3,) float32 unit, in the body's frame.
        point: (3,) float32 mm, likewise.
        eye: (3,) float32 mm, likewise.
        wrap: of the material.
        shininess: of the material.
        out: (2,) float32 out: diffuse, highlight.
    """
    one = float32(1.0)
    vx, vy, vz = eye[0] - point[0], eye[1] - point[1], eye[2] - point[2]
    length = one / math.sqrt(vx * vx + vy * vy + vz * vz)
    vx, vy, vz = vx * length, vy * length, vz * length
    diffuse = float32(0.0)
    highlight = float32(0.0)
    unwrap = one / (one + wrap)
    for k in range(lamps.shape[1]):
        lx, ly, lz = lamps[part, k, 0], lamps[part, k, 1], lamps[part, k, 2]
        cosine = normal[0] * lx + normal[1] * ly + normal[2] * lz
        diffuse += lamps[part, k, 3] * max(float32(0.0), (cosine + wrap) * unwrap)
        if cosine <= float32(0.0):
            continue
        hx, hy, hz = lx + vx, ly + vy, lz + vz
        squared = hx * hx + hy * hy + hz * hz
        t = normal[0] * hx + normal[1] * hy + normal[2] * hz
        if t <= float32(0.0):
            continue
        # Schlick's rational form instead of a power: t / (n - n t + t), squared for a short tail.
        t = t / math.sqrt(squared)
        lobe = t / (shininess - shininess * t + t)
        highlight += lamps[part, k, 3] * lobe * lobe
    out[0] = diffuse
    out[1] = highlight


@njit(cache=True, nogil=True)
def compute_mirrored(
    lamps: Floats, part: int, normal: Floats, point: Floats, eye: Floats, rough: float
) -> Any:
    """Light that a mirror at one point throws into the eye: the lamps' discs, and a dim room.

    Args:
        lamps: (P, L, 4) float32 unit direction towards the lamp, strength.
        part: whose frame.
        normal: (3,) float32 unit, in the body's frame.
        point: (3,) float32 mm, likewise.
        eye: (3,) float32 mm, likewise.
        rough: over so much (rad) the edge of a disc fades.
    """
    one, two = float32(1.0), float32(2.0)
    vx, vy, vz = eye[0] - point[0], eye[1] - point[1], eye[2] - point[2]
    length = one / math.sqrt(vx * vx + vy * vy + vz * vz)
    vx, vy, vz = vx * length, vy * length, vz * length
    cosine = two * (normal[0] * vx + normal[1] * vy + normal[2] * vz)
    rx, ry, rz = cosine * normal[0] - vx, cosine * normal[1] - vy, cosine * normal[2] - vz
    # The room is brighter where the lamps light it, the cloths all round are dark.
    total, overhead = float32(0.0), float32(0.0)
    for k in range(lamps.shape[1]):
        along = rx * lamps[part, k, 0] + ry * lamps[part, k, 1] + rz * lamps[part, k, 2]
        apart = math.sqrt(max(float32(0.0), two - two * along))
        disc = _step((float32(_LAMP_RADIUS) - apart) / rough + float32(0.5))
        total += lamps[part, k, 3] * disc * float32(_LAMP_LIGHT)
        overhead += lamps[part, k, 3] * max(float32(0.0), along)
    return total + float32(0.08) + float32(0.9) * overhead * overhead


@njit(cache=True, nogil=True, inline="always")
def _open_light(
    surroundings: Floats, map_from_camera: Floats, ray_x: float, ray_y: float, z: float
) -> Any:
    """Light that reaches a point between what stands around it, 0 to 1."""
    x, y = ray_x * z, ray_y * z
    m = map_from_camera
    column = m[0, 0] * x + m[0, 1] * y + m[0, 2] * z + m[0, 3]
    row = m[1, 0] * x + m[1, 1] * y + m[1, 2] * z + m[1, 3]
    depth_mm = m[2, 0] * x + m[2, 1] * y + m[2, 2] * z + m[2, 3]
    behind_mm = depth_mm - _bilinear(surroundings, column, row)
    light = float32(1.0) - behind_mm * float32(1.0 / _DARK_BEHIND_MM)
    return min(float32(1.0), max(float32(_LEAST_LIGHT), light))


@njit(cache=True, nogil=True)
def shade(
    frame: tuple[Any, ...],
    geometry: tuple[Any, ...],
    parts: tuple[Any, ...],
    surface: tuple[Any, ...],
    image: Floats,
) -> None:
    """Colour every pixel of the box that shows a triangle or has an edge; places of none are black.

    Args:
        frame: (triangle (H, W) int32 with -1 for none, inverse_depth (H, W) float32, rays
            (H, W, 2) float32, box (4,) int64, and of the pixels with an edge (coverage_kernels):
            edge_number (H, W) int32, triangle (K, 9) int32 and inverse_depth (K, 9) float32 of
            their places).
        geometry: (screen (V, 3) float64, faces (F, 3) int32, attributes (V, 5) float32: normal,
            mark, exposure; part_of_face (F,) uint8, material_of_face (F,) uint8).
        parts: (body_from_camera (P, 3, 4) float32, lamps (P, L, 4) float32 directions
            in body frames and strengths,
            texture (P, 4) float32: sign of x and shift of the texture).
        surface: (materials (M, 23) float32, tile (n, n, n) uint16, ambient, constants (4,)
            float32: fine and coarse voxels per mm, vignetting per px^2, focal length in px;
            surroundings (h, w) and map_from_camera (3, 4) float32 of lamp_view).
        image: (H, W, 3) float32 in and out, BGR: other pixels stay.
    """
    triangle, inverse_depth, rays, box, edge_number, place_triangle, place_depth = frame
    screen, faces, attributes, part_of_face, material_of_face = geometry
    body_from_camera, lamps, texture = parts
    materials, tile, ambient, constants, surroundings, map_from_camera = surface
    one = float32(1.0)
    voxels_per_mm, focal_px = (constants[0], constants[1]), constants[3]
    # Reused by every place.
    weights, normal = np.empty(3, np.float32), np.empty(3, np.float32)
    point, eye = np.empty(3, np.float32), np.empty(3, np.float32)
    noise, across = np.empty((3, 5), np.float32), np.zeros(3, np.float32)
    fine, coarse = noise[0], noise[1]
    colour, sums = np.empty(5, np.float32), np.empty(2, np.float32)
    total = np.empty(3, np.float32)
    middle_x, middle_y = float32(0.5 * (image.shape[1] - 1)), float32(0.5 * (image.shape[0] - 1))
    for y in range(box[1], box[3]):
        for x in range(box[0], box[2]):
            edge = edge_number[y, x]
            if edge < 0 and triangle[y, x] < 0:
                continue
            n_places = 1 if edge < 0 else 9
            total[:] = float32(0.0)
            dx, dy = float32(x) - middle_x, float32(y) - middle_y
            vignette = one - constants[2] * (dx * dx + dy * dy)
            for m in range(n_places):
                if edge < 0:
                    shown, inverse_z, du, dv = triangle[y, x], inverse_depth[y, x], 0.0, 0.0
                else:
                    shown, inverse_z = place_triangle[edge, m], place_depth[edge, m]
                    du, dv = find_place(m)
                if shown < 0:
                    continue
                face = uint32(shown)
                a, b, c = uint32(faces[face, 0]), uint32(faces[face, 2]), uint32(faces[face, 1])
                part, row = part_of_face[face], material_of_face[face]
                _corner_weights(screen, a, b, c, x + du, y + dv, weights)
                z = one / inverse_z
                ray_x = rays[y, x, 0] + float32(du) / focal_px
                ray_y = rays[y, x, 1] + float32(dv) / focal_px
                _place(body_from_camera, part, ray_x, ray_y, z, point, eye)
                lookups = 1
                if edge < 0:
                    view = (ray_x, ray_y, z, focal_px)
                    lookups = cross_pixel(screen, (a, b, c), view, body_from_camera[part], across)
                sample_surface(tile, voxels_per_mm, texture[part], point, across, lookups, noise)
                mark = _blend(attributes, a, b, c, 3, weights)
                compute_albedo(materials, row, fine, coarse, mark, colour)
                bump = materials[row, _BUMP] * (one - float32(0.6) * colour[4])
                _bump_normal(attributes, a, b, c, weights, bump, texture[part, 0], fine, normal)
                wrap, shininess = materials[row, _WRAP], materials[row, _SHININESS]
                compute_light(lamps, part, normal, point, eye, wrap, shininess, sums)
                exposure = vignette * _blend(attributes, a, b, c, 4, weights)
                exposure *= _open_light(surroundings, map_from_camera, ray_x, ray_y, z)
                diffuse = (sums[0] + ambient) * exposure
                highlight = sums[1] * colour[3] * exposure
                if materials[row, _MIRROR] > float32(0.0):
                    rough = materials[row, _ROUGHNESS]
                    mirrored = compute_mirrored(lamps, part, normal, point, eye, rough)
                    # Blood hides the mirror below it.
                    highlight += materials[row, _MIRROR] * (one - colour[4]) * mirrored * exposure
                for k in range(3):
                    total[k] += colour[k] * diffuse + highlight
            for k in range(3):
                image[y, x, k] = total[k] / float32(n_places)
