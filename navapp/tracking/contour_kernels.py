"""Compiled search for a model's outline in one picture: where it should be, and where it is."""

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

# Nearer by this much, something hides a point; behind an outline everything is so much further.
# A fold less deep is no outline: what lies behind it is lit as it is.
_HIDDEN_MM, _DEPTH_STEP_MM = 1.0, 3.0
# So far beyond the outline the rendered surface must have ended.
_BEYOND_PX = 3
# Neighbours within this distance that look the same way give a point its normal; of those as close
# as the spacing only the outermost is the outline.
_AROUND_PX, _SAME_COSINE = 4.0, 0.5
_SPACING_PX, _INNER_PX = 1.5, 0.2

# Samples along the normal, and the derivative of a Gaussian that finds edges in them.
_STEP_PX, _SIGMA_PX = 0.5, 0.8
_TAPS = 6
_SEARCH, _NEAR_ENOUGH = 9, 4
_HALF = _SEARCH + _TAPS
# The step between two levels is told from so many samples on either side; the levels themselves
# from the outer ones.
_FLANK, _LEVEL_FROM = 8, 4
_WIDTHS_PX = np.array([0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.2, 1.4, 1.7, 2.0, 2.5])


def _derivative() -> NDArray[np.float64]:
    at = _STEP_PX * np.arange(-_TAPS, _TAPS + 1)
    weight = np.exp(-0.5 * (at / _SIGMA_PX) ** 2)
    slope: NDArray[np.float64] = -at * weight / (weight * at * at).sum()
    return slope


def _steps() -> NDArray[np.float64]:
    """(widths, samples) of a falling step blurred by each width, mean-free."""
    at = _STEP_PX * np.arange(-_FLANK, _FLANK + 1) / _WIDTHS_PX[:, None]
    shapes = 0.5 - 0.5 * np.vectorize(math.erf)(at / math.sqrt(2.0))
    centred: NDArray[np.float64] = shapes - shapes.mean(axis=1, keepdims=True)
    return centred


DERIVATIVE, STEPS = _derivative(), _steps()


class Rim(NamedTuple):
    """Points of an outline.

    Attributes:
        point: (N, 3) mm, rectified left camera.
        pixel: (N, 2) px in the picture.
        normal: (N, 2) unit, away from the model, in the picture.
        length: (N,) px of the edge that the point stands for.
        vertex: (N,) a vertex beside it.
    """

    point: NDArray[np.float64]
    pixel: NDArray[np.float64]
    normal: NDArray[np.float64]
    length: NDArray[np.float64]
    vertex: NDArray[np.int32]


class Eye(NamedTuple):
    """A rectified camera: its place on the x axis, mm, and how it projects, px."""

    x_mm: float
    focal_px: float
    centre_x_px: float
    centre_y_px: float


@njit(cache=True, nogil=True)
def find_rim(
    vertices: NDArray[np.float64], edges: NDArray[np.int32], faces: NDArray[np.int32],
    opposite: NDArray[np.int32], normals: NDArray[np.float64], offsets: NDArray[np.float64],
    rotation: NDArray[np.float64], translation: NDArray[np.float64], eye: Eye,
) -> Rim:  # fmt: skip
    """Middles of the edges over which a mesh turns away from an eye, hidden ones too.

    Args:
        vertices, edges, faces, opposite, normals, offsets: as in `RidgeEdges`.
        rotation, translation: the rectified left camera from the mesh.
        eye: that looks.
    """
    cx, cy, cz = eye.x_mm - translation[0], -translation[1], -translation[2]
    x, y, z = (
        rotation[0, 0] * cx + rotation[1, 0] * cy + rotation[2, 0] * cz,
        rotation[0, 1] * cx + rotation[1, 1] * cy + rotation[2, 1] * cz,
        rotation[0, 2] * cx + rotation[1, 2] * cy + rotation[2, 2] * cz,
    )
    n_faces = normals.shape[0]
    faces_eye = np.empty(n_faces, dtype=np.bool_)
    for f in range(n_faces):
        faces_eye[f] = normals[f, 0] * x + normals[f, 1] * y + normals[f, 2] * z > offsets[f]
    found = np.empty(edges.shape[0], dtype=np.int32)
    n = 0
    for i in range(edges.shape[0]):
        if faces_eye[faces[i, 0]] != faces_eye[faces[i, 1]]:
            found[n] = i
            n += 1
    rim = Rim(
        np.empty((n, 3)), np.empty((n, 2)), np.empty((n, 2)), np.empty(n),
        np.empty(n, dtype=np.int32),
    )  # fmt: skip
    corner = np.empty((3, 3))
    place = np.empty((3, 2))
    m = 0
    for k in range(n):
        i = found[k]
        side = 0 if faces_eye[faces[i, 0]] else 1
        is_ahead = True
        for c in range(3):
            v = opposite[i, side] if c == 2 else edges[i, c]
            for a in range(3):
                corner[c, a] = (
                    rotation[a, 0] * vertices[v, 0] + rotation[a, 1] * vertices[v, 1]
                    + rotation[a, 2] * vertices[v, 2] + translation[a]
                )  # fmt: skip
            is_ahead = is_ahead and corner[c, 2] > 1e-6
            if is_ahead:
                scale = eye.focal_px / corner[c, 2]
                place[c, 0] = scale * (corner[c, 0] - eye.x_mm) + eye.centre_x_px
                place[c, 1] = scale * corner[c, 1] + eye.centre_y_px
        dx, dy = place[1, 0] - place[0, 0], place[1, 1] - place[0, 1]
        length = np.sqrt(dx * dx + dy * dy)
        if not is_ahead or length < 1e-3:
            continue
        for a in range(3):
            rim.point[m, a] = 0.5 * (corner[0, a] + corner[1, a])
        scale = eye.focal_px / rim.point[m, 2]
        rim.pixel[m, 0] = scale * (rim.point[m, 0] - eye.x_mm) + eye.centre_x_px
        rim.pixel[m, 1] = scale * rim.point[m, 1] + eye.centre_y_px
        ux, uy = dy / length, -dx / length
        inward = ux * (place[2, 0] - rim.pixel[m, 0]) + uy * (place[2, 1] - rim.pixel[m, 1])
        outward = -1.0 if inward > 0.0 else 1.0
        rim.normal[m, 0], rim.normal[m, 1] = outward * ux, outward * uy
        rim.length[m], rim.vertex[m] = length, edges[i, 0]
        m += 1
    return Rim(rim.point[:m], rim.pixel[:m], rim.normal[:m], rim.length[:m], rim.vertex[:m])


@njit(cache=True, nogil=True)
def warp_depth(
    depth: NDArray[np.float32], first_column: int, eye: Eye, warped: NDArray[np.float32],
    first_warped: int,
) -> None:  # fmt: skip
    """The left depth buffer as an eye further right sees it; what only that eye sees is missing.

    Args:
        depth: (h, w) mm, NaN where nothing is.
        first_column: of its place in the left picture.
        eye: that looks.
        warped: (h, w2) in place, filled with NaN.
        first_warped: its first column in that eye's picture.
    """
    height, width = depth.shape
    for r in range(height):
        for c in range(width):
            z = depth[r, c]
            if not z > 0.0:
                continue
            column = c + first_column - eye.focal_px * eye.x_mm / z - first_warped
            first = int(np.floor(column))
            for at in range(first, first + 2):
                if 0 <= at < warped.shape[1] and not warped[r, at] <= z:
                    warped[r, at] = z


@njit(cache=True, nogil=True)
def is_outline(
    rim: Rim, depth: NDArray[np.float32], first_column: int, first_row: int
) -> NDArray[np.bool_]:
    """(N,) points that nothing hides and beyond which the model has ended, or is much further.

    Args:
        rim: of the eye whose buffer it is.
        depth: (h, w) mm, NaN where nothing is.
        first_column: of the buffer, in the picture.
        first_row: of the buffer.
    """
    height, width = depth.shape
    answer = np.zeros(rim.pixel.shape[0], dtype=np.bool_)
    for i in range(len(answer)):
        z = rim.point[i, 2]
        is_seen = True
        for k in range(_BEYOND_PX + 1):
            c = int(np.floor(rim.pixel[i, 0] + k * rim.normal[i, 0] + 0.5)) - first_column
            r = int(np.floor(rim.pixel[i, 1] + k * rim.normal[i, 1] + 0.5)) - first_row
            if not (0 <= c < width and 0 <= r < height):
                is_seen = is_seen and k > 0
                continue
            limit = z - _HIDDEN_MM if k == 0 else z + _DEPTH_STEP_MM
            is_seen = is_seen and not depth[r, c] <= limit
        answer[i] = is_seen
    return answer


@njit(cache=True, nogil=True)
def thin_rim(rim: Rim) -> Rim:
    """The outermost points, about one per spacing and direction, with the normals smoothed."""
    n = rim.pixel.shape[0]
    if n == 0:
        return rim
    low_x, low_y = rim.pixel[:, 0].min(), rim.pixel[:, 1].min()
    columns = int((rim.pixel[:, 0].max() - low_x) / _AROUND_PX) + 1
    rows = int((rim.pixel[:, 1].max() - low_y) / _AROUND_PX) + 1
    head = np.full((rows, columns), -1, dtype=np.int32)
    following = np.empty(n, dtype=np.int32)
    for i in range(n):
        c, r = (
            int((rim.pixel[i, 0] - low_x) / _AROUND_PX),
            int((rim.pixel[i, 1] - low_y) / _AROUND_PX),
        )
        following[i] = head[r, c]
        head[r, c] = i
    fine = _AROUND_PX / _SPACING_PX
    taken = np.zeros((int(rows * fine) + 2, int(columns * fine) + 2, 4), dtype=np.bool_)
    kept = np.empty(n, dtype=np.int32)
    normal = np.empty((n, 2))
    m = 0
    near = np.empty(n, dtype=np.int32)
    for i in range(n):
        c, r = (
            int((rim.pixel[i, 0] - low_x) / _AROUND_PX),
            int((rim.pixel[i, 1] - low_y) / _AROUND_PX),
        )
        ux, uy, n_near = 0.0, 0.0, 0
        for row in range(max(r - 1, 0), min(r + 2, rows)):
            for column in range(max(c - 1, 0), min(c + 2, columns)):
                j = head[row, column]
                while j >= 0:
                    dx, dy = (
                        rim.pixel[j, 0] - rim.pixel[i, 0],
                        rim.pixel[j, 1] - rim.pixel[i, 1],
                    )
                    cosine = (
                        rim.normal[i, 0] * rim.normal[j, 0] + rim.normal[i, 1] * rim.normal[j, 1]
                    )
                    distance2 = dx * dx + dy * dy
                    if cosine > _SAME_COSINE and distance2 <= _AROUND_PX**2:
                        ux += rim.length[j] * rim.normal[j, 0]
                        uy += rim.length[j] * rim.normal[j, 1]
                        if distance2 < _SPACING_PX**2:
                            near[n_near] = j
                            n_near += 1
                    j = following[j]
        size = np.sqrt(ux * ux + uy * uy)
        ux, uy = ux / size, uy / size
        is_outermost = True
        for k in range(n_near):
            dx = rim.pixel[near[k], 0] - rim.pixel[i, 0]
            dy = rim.pixel[near[k], 1] - rim.pixel[i, 1]
            is_outermost = is_outermost and dx * ux + dy * uy < _INNER_PX
        steep = abs(uy) > abs(ux)
        facing = (2 if steep else 0) + (1 if (uy if steep else ux) > 0.0 else 0)
        cell_r = int((rim.pixel[i, 1] - low_y) / _SPACING_PX)
        cell_c = int((rim.pixel[i, 0] - low_x) / _SPACING_PX)
        if is_outermost and not taken[cell_r, cell_c, facing]:
            taken[cell_r, cell_c, facing] = True
            kept[m] = i
            normal[m, 0], normal[m, 1] = ux, uy
            m += 1
    index = kept[:m]
    return Rim(
        rim.point[index], rim.pixel[index], normal[:m].copy(), rim.length[index], rim.vertex[index]
    )


@njit(cache=True, nogil=True)
def sample_across(
    picture: NDArray[np.uint8], x: float, y: float, ux: float, uy: float, profile: NDArray[np.float64],
) -> bool:  # fmt: skip
    """Grey values along a normal, the mean over three lines a pixel apart; False out of view.

    Args:
        picture: (h, w).
        x, y: px, where the middle sample lies.
        ux, uy: unit direction.
        profile: (2 K + 1,) in place.
    """
    half = profile.shape[0] // 2
    reach = _STEP_PX * half + 2.0
    if not (reach <= x < picture.shape[1] - reach and reach <= y < picture.shape[0] - reach):
        return False
    for k in range(profile.shape[0]):
        total = 0.0
        for side in range(-1, 2):
            px = x + _STEP_PX * (k - half) * ux - side * uy
            py = y + _STEP_PX * (k - half) * uy + side * ux
            c, r = int(np.floor(px)), int(np.floor(py))
            fx, fy = px - c, py - r
            total += (1.0 - fy) * ((1.0 - fx) * picture[r, c] + fx * picture[r, c + 1])
            total += fy * ((1.0 - fx) * picture[r + 1, c] + fx * picture[r + 1, c + 1])
        profile[k] = total / 3.0
    return True


@njit(cache=True, nogil=True)
def strongest_edge(profile: NDArray[np.float64]) -> float:
    """Place of the steepest slope of a profile, px from its middle; NaN when not near it.

    Bright inside or dark inside: only the strongest counts, so that a weaker slope nearby is not
    taken for the outline.
    """
    middle = profile.shape[0] // 2
    slope = np.empty(2 * _SEARCH + 1)
    for k in range(-_SEARCH, _SEARCH + 1):
        total = 0.0
        for tap in range(-_TAPS, _TAPS + 1):
            total -= DERIVATIVE[tap + _TAPS] * profile[middle + k + tap]
        slope[k + _SEARCH] = abs(total)
    best = int(slope.argmax())
    if abs(best - _SEARCH) > _NEAR_ENOUGH:
        return np.nan
    before, here, after = slope[best - 1], slope[best], slope[best + 1]
    bend = before - 2.0 * here + after
    part = 0.5 * (before - after) / bend if bend < 0.0 else 0.0
    return _STEP_PX * (best - _SEARCH + min(max(part, -0.5), 0.5))


@njit(cache=True, nogil=True)
def step_quality(profile: NDArray[np.float64]) -> tuple[float, float]:
    """How much darker it is behind an edge, and how unlike a blurred step the profile is.

    Args:
        profile: (2 K + 1,) grey values across the edge, from inside to outside, its middle on it.

    Returns:
        Share of the inner level that is missing outside; rms of what the best step leaves over the
        height of that step.
    """
    n = 2 * _FLANK + 1
    inside, outside, mean = 0.0, 0.0, 0.0
    for k in range(n):
        mean += profile[k] / n
        if k <= _FLANK - _LEVEL_FROM:
            inside += profile[k] / (_FLANK - _LEVEL_FROM + 1)
        elif k >= _FLANK + _LEVEL_FROM:
            outside += profile[k] / (_FLANK - _LEVEL_FROM + 1)
    squares = 0.0
    for k in range(n):
        squares += (profile[k] - mean) ** 2
    misfit = np.inf
    for s in range(STEPS.shape[0]):
        cross, own = 0.0, 0.0
        for k in range(n):
            cross += STEPS[s, k] * profile[k]
            own += STEPS[s, k] ** 2
        height = cross / own
        rest = max(squares - height * cross, 0.0)
        misfit = min(misfit, np.sqrt(rest / n) / max(abs(height), 1.0))
    return (inside - outside) / max(inside, 1.0), misfit


@njit(cache=True, nogil=True)
def find_steps(
    picture: NDArray[np.uint8], rim: Rim, darker: float, misfit: float
) -> NDArray[np.float64]:
    """(N,) px from each point to the picture's edge along the normal; NaN without a plain step.

    Args:
        picture: (h, w).
        rim: of the eye that took it.
        darker: least share of the level inside that is missing outside.
        misfit: most that a blurred step may leave, in heights of it.
    """
    wide, flank = np.empty(2 * _HALF + 1), np.empty(2 * _FLANK + 1)
    offset = np.full(rim.pixel.shape[0], np.nan)
    for i in range(len(offset)):
        x, y, ux, uy = rim.pixel[i, 0], rim.pixel[i, 1], rim.normal[i, 0], rim.normal[i, 1]
        if not sample_across(picture, x, y, ux, uy, wide):
            continue
        if wide[_HALF:].min() > (1.0 - darker) * wide[: _HALF + 1].max():
            continue
        at = strongest_edge(wide)
        if np.isnan(at) or not sample_across(picture, x + at * ux, y + at * uy, ux, uy, flank):
            continue
        missing, left_over = step_quality(flank)
        if missing >= darker and left_over <= misfit:
            offset[i] = at
    return offset
