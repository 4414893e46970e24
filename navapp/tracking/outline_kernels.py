"""Compiled search for a model's outline: where one eye should see it end."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from navapp.geometry.mesh_edges import RidgeEdges

# All chosen. What is nearer by this much hides a point. Behind an outline everything is further by
# this much: what lies behind a shallower fold is lit as the fold is.
_HIDDEN_MM, _DEPTH_STEP_MM = 1.0, 3.0
# So far beyond the outline the rendered surface must have ended.
_BEYOND_PX = 3
# Neighbours within this distance whose normals point the same way give a point its normal.
_AROUND_PX, _SAME_COSINE = 4.0, 0.5
# Of those closer still, a point that another one lies beyond by this much is not the outline.
_CLOSE_PX, _INNER_PX, _MOST_CLOSE = 1.5, 0.2, 64
# Neighbouring points share their errors: more of them say little more.
_SPACING_PX = 3.0
# A vertex nearer to the camera is behind it; a shorter edge has no direction.
_NEAREST_MM, _SHORTEST_PX = 1e-6, 1e-3


class Rim(NamedTuple):
    """Points of an outline."""

    point: NDArray[np.float64]  # (N, 3) mm, rectified left camera
    pixel: NDArray[np.float64]  # (N, 2) px in the eye's picture
    normal: NDArray[np.float64]  # (N, 2) unit, away from the model, in the picture
    length: NDArray[np.float64]  # (N,) px of the edge that the point stands for
    vertex: NDArray[np.int32]  # (N,) one end of that edge


class Eye(NamedTuple):
    """A rectified camera: its place on the x axis, mm, and how it projects, px."""

    x_mm: float
    focal_px: float
    centre_x_px: float
    centre_y_px: float


@njit(cache=True, nogil=True)
def _project(point: NDArray[np.float64], eye: Eye, pixel: NDArray[np.float64]) -> None:
    scale = eye.focal_px / point[2]
    pixel[0] = scale * (point[0] - eye.x_mm) + eye.centre_x_px
    pixel[1] = scale * point[1] + eye.centre_y_px


@njit(cache=True, nogil=True)
def find_rim(
    ridges: RidgeEdges, rotation: NDArray[np.float64], translation: NDArray[np.float64], eye: Eye
) -> Rim:
    """Middles of the edges of which one triangle faces an eye and one does not, hidden ones too.

    Args:
        ridges: of the mesh.
        rotation: (3, 3) rectified left camera from mesh.
        translation: (3,) of the same, mm.
        eye: that looks.
    """
    vertices, edges, faces, planes = ridges.vertices_mm, ridges.edges, ridges.faces, ridges.planes
    seat = (rotation.T @ (np.array([eye.x_mm, 0.0, 0.0]) - translation)).astype(np.float32)
    is_facing = np.empty(planes.shape[1], dtype=np.bool_)
    x, y, z = seat[0], seat[1], seat[2]
    for f in range(len(is_facing)):
        is_facing[f] = planes[0, f] * x + planes[1, f] * y + planes[2, f] * z > planes[3, f]
    found = [i for i in range(len(faces)) if is_facing[faces[i, 0]] != is_facing[faces[i, 1]]]
    n = len(found)
    point, pixel, normal = np.empty((n, 3)), np.empty((n, 2)), np.empty((n, 2))
    length, vertex = np.empty(n), np.empty(n, dtype=np.int32)
    corner, place = np.empty((3, 3)), np.empty((3, 2))
    m = 0
    for i in found:
        third = ridges.opposite[i, 0 if is_facing[faces[i, 0]] else 1]
        for c, v in enumerate((edges[i, 0], edges[i, 1], third)):
            for a in range(3):
                corner[c, a] = (
                    rotation[a, 0] * vertices[v, 0] + rotation[a, 1] * vertices[v, 1]
                    + rotation[a, 2] * vertices[v, 2] + translation[a]
                )  # fmt: skip
        if not corner[:, 2].min() > _NEAREST_MM:
            continue
        for c in range(3):
            _project(corner[c], eye, place[c])
        dx, dy = place[1, 0] - place[0, 0], place[1, 1] - place[0, 1]
        length[m] = np.sqrt(dx * dx + dy * dy)
        if length[m] < _SHORTEST_PX:
            continue
        for a in range(3):
            point[m, a] = 0.5 * (corner[0, a] + corner[1, a])
        _project(point[m], eye, pixel[m])
        inward = dy * (place[2, 0] - place[0, 0]) - dx * (place[2, 1] - place[0, 1])
        outward = (-1.0 if inward > 0.0 else 1.0) / length[m]
        normal[m, 0], normal[m, 1] = outward * dy, -outward * dx
        vertex[m] = edges[i, 0]
        m += 1
    return Rim(point[:m], pixel[:m], normal[:m], length[:m], vertex[:m])


@njit(cache=True, nogil=True)
def is_outline(
    rim: Rim, depth: NDArray[np.float32], first_column: int, first_row: int
) -> NDArray[np.bool_]:
    """(N,) points that nothing hides and beyond which the model has ended, or is much further.

    `depth` (h, w) mm is what the rim's eye sees of the model, NaN beside it, from a column and a
    row of its picture on.
    """
    height, width = depth.shape
    answer = np.ones(rim.pixel.shape[0], dtype=np.bool_)
    for i in range(len(answer)):
        z = rim.point[i, 2]
        for k in range(_BEYOND_PX + 1):
            c = int(np.floor(rim.pixel[i, 0] + k * rim.normal[i, 0] + 0.5)) - first_column
            r = int(np.floor(rim.pixel[i, 1] + k * rim.normal[i, 1] + 0.5)) - first_row
            if 0 <= c < width and 0 <= r < height:
                limit = z - _HIDDEN_MM if k == 0 else z + _DEPTH_STEP_MM
                answer[i] &= not depth[r, c] <= limit
            elif k == 0:
                answer[i] = False
    return answer


@njit(cache=True, nogil=True)
def _smooth_normal(
    rim: Rim, i: int, cell: NDArray[np.int32], head: NDArray[np.int32],
    following: NDArray[np.int32],
) -> tuple[float, float, bool]:  # fmt: skip
    """Mean normal around point i, and whether no point close by lies further out.

    Points are linked lists by their cell: `cell` (N, 2) is its column and row, `head` (rows,
    columns) the first point in it, `following` (N,) the next in the same one; -1 ends a list.
    """
    column, row = cell[i, 0], cell[i, 1]
    ux, uy, n_close = 0.0, 0.0, 0
    close = np.empty((_MOST_CLOSE, 2))
    for r in range(max(row - 1, 0), min(row + 2, head.shape[0])):
        for c in range(max(column - 1, 0), min(column + 2, head.shape[1])):
            j = head[r, c]
            while j >= 0:
                dx = rim.pixel[j, 0] - rim.pixel[i, 0]
                dy = rim.pixel[j, 1] - rim.pixel[i, 1]
                cosine = rim.normal[i, 0] * rim.normal[j, 0] + rim.normal[i, 1] * rim.normal[j, 1]
                distance2 = dx * dx + dy * dy
                if cosine > _SAME_COSINE and distance2 <= _AROUND_PX * _AROUND_PX:
                    ux += rim.length[j] * rim.normal[j, 0]
                    uy += rim.length[j] * rim.normal[j, 1]
                    if distance2 < _CLOSE_PX * _CLOSE_PX and n_close < _MOST_CLOSE:
                        close[n_close, 0], close[n_close, 1] = dx, dy
                        n_close += 1
                j = following[j]
    size = np.sqrt(ux * ux + uy * uy)
    ux, uy = ux / size, uy / size
    is_outermost = True
    for k in range(n_close):
        is_outermost = is_outermost and close[k, 0] * ux + close[k, 1] * uy < _INNER_PX
    return ux, uy, is_outermost


@njit(cache=True, nogil=True)
def thin_rim(rim: Rim) -> Rim:
    """The outermost points, one per cell of the spacing and direction, with smoothed normals."""
    n = rim.pixel.shape[0]
    if n == 0:
        return rim
    place_px = rim.pixel - np.array([rim.pixel[:, 0].min(), rim.pixel[:, 1].min()])
    cell = (place_px / _AROUND_PX).astype(np.int32)
    head = np.full((cell[:, 1].max() + 1, cell[:, 0].max() + 1), -1, dtype=np.int32)
    following = np.empty(n, dtype=np.int32)
    for i in range(n):
        following[i] = head[cell[i, 1], cell[i, 0]]
        head[cell[i, 1], cell[i, 0]] = i
    square = (place_px / _SPACING_PX).astype(np.int32)
    is_filled = np.zeros((square[:, 1].max() + 1, square[:, 0].max() + 1, 4), dtype=np.bool_)
    kept, normal = np.empty(n, dtype=np.int32), np.empty((n, 2))
    m = 0
    for i in range(n):
        ux, uy, is_outermost = _smooth_normal(rim, i, cell, head, following)
        is_steep = abs(uy) > abs(ux)
        main = uy if is_steep else ux
        facing = 2 * is_steep + (main > 0.0)
        column, row = square[i, 0], square[i, 1]
        if is_outermost and not is_filled[row, column, facing]:
            is_filled[row, column, facing] = True
            kept[m], normal[m, 0], normal[m, 1] = i, ux, uy
            m += 1
    index = kept[:m]
    return Rim(rim.point[index], rim.pixel[index], normal[:m], rim.length[index], rim.vertex[index])


@njit(cache=True, nogil=True)
def count_near(pixel: NDArray[np.float64], reach_px: float) -> NDArray[np.float64]:
    """(N,) how many of some pixels (N, 2) lie within reach of each, itself included."""
    n = pixel.shape[0]
    counts = np.zeros(n)
    for i in range(n):
        for j in range(n):
            dx, dy = pixel[i, 0] - pixel[j, 0], pixel[i, 1] - pixel[j, 1]
            if dx * dx + dy * dy <= reach_px * reach_px:
                counts[i] += 1.0
    return counts
