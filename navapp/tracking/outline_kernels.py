"""Compiled search for a model's outline: where one eye should see it end."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

# Nearer by this much, something hides a point; behind an outline everything is so much further.
# A fold less deep is no outline: what lies behind it is lit as it is.
_HIDDEN_MM, _DEPTH_STEP_MM = 1.0, 3.0
# So far beyond the outline the rendered surface must have ended.
_BEYOND_PX = 3
# Neighbours within this distance that look the same way give a point its normal; of those close by
# only the outermost is the outline.
_AROUND_PX, _SAME_COSINE = 4.0, 0.5
_CLOSE_PX, _INNER_PX = 1.5, 0.2
# Errors along a rim go together: more points than this say little more.
_SPACING_PX = 3.0
_MOST_CLOSE = 64
_NEAREST_MM, _SHORTEST_PX = 1e-6, 1e-3


class Ridges(NamedTuple):
    """The arrays of `navapp.geometry.mesh_edges.RidgeEdges`, by the same names."""

    vertices: NDArray[np.float64]
    edges: NDArray[np.int32]
    faces: NDArray[np.int32]
    opposite: NDArray[np.int32]
    planes: NDArray[np.float32]


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
def find_turned_edges(
    faces: NDArray[np.int32], planes: NDArray[np.float32], eye: NDArray[np.float64]
) -> tuple[NDArray[np.int32], NDArray[np.bool_]]:
    """Edges of which one triangle looks at an eye and one away, and which triangles look at it.

    Args:
        faces: (E, 2) the triangles of each edge.
        planes: (4, F) as in `RidgeEdges`.
        eye: (3,) in the mesh's frame.
    """
    x, y, z = np.float32(eye[0]), np.float32(eye[1]), np.float32(eye[2])
    looks = np.empty(planes.shape[1], dtype=np.bool_)
    for f in range(len(looks)):
        looks[f] = planes[0, f] * x + planes[1, f] * y + planes[2, f] * z > planes[3, f]
    found = np.empty(faces.shape[0], dtype=np.int32)
    n = 0
    for i in range(faces.shape[0]):
        if looks[faces[i, 0]] != looks[faces[i, 1]]:
            found[n] = i
            n += 1
    return found[:n], looks


@njit(cache=True, nogil=True)
def _project(
    rotation: NDArray[np.float64], translation: NDArray[np.float64],
    vertices: NDArray[np.float64], v: int, eye: Eye, corner: NDArray[np.float64],
    place: NDArray[np.float64],
) -> bool:  # fmt: skip
    """Vertex v in the left camera and in an eye's picture, both in place; False behind it."""
    for a in range(3):
        corner[a] = (
            rotation[a, 0] * vertices[v, 0] + rotation[a, 1] * vertices[v, 1]
            + rotation[a, 2] * vertices[v, 2] + translation[a]
        )  # fmt: skip
    if not corner[2] > _NEAREST_MM:
        return False
    _see(corner, eye, place)
    return True


@njit(cache=True, nogil=True)
def _see(point: NDArray[np.float64], eye: Eye, place: NDArray[np.float64]) -> None:
    scale = eye.focal_px / point[2]
    place[0] = scale * (point[0] - eye.x_mm) + eye.centre_x_px
    place[1] = scale * point[1] + eye.centre_y_px


@njit(cache=True, nogil=True)
def find_rim(
    ridges: Ridges, rotation: NDArray[np.float64], translation: NDArray[np.float64], eye: Eye
) -> Rim:
    """Middles of the edges over which a mesh turns away from an eye, hidden ones too.

    Args:
        ridges: of the mesh.
        rotation: (3, 3) of the mesh in the rectified left camera.
        translation: (3,) of it, mm.
        eye: that looks.
    """
    vertices, edges, faces = ridges.vertices, ridges.edges, ridges.faces
    seat = rotation.T @ (np.array([eye.x_mm, 0.0, 0.0]) - translation)
    found, looks = find_turned_edges(faces, ridges.planes, seat)
    n = len(found)
    rim = Rim(
        np.empty((n, 3)), np.empty((n, 2)), np.empty((n, 2)), np.empty(n),
        np.empty(n, dtype=np.int32),
    )  # fmt: skip
    corner, place = np.empty((3, 3)), np.empty((3, 2))
    m = 0
    for i in found:
        is_ahead = True
        for c in range(3):
            v = edges[i, c] if c < 2 else ridges.opposite[i, 0 if looks[faces[i, 0]] else 1]
            is_ahead = is_ahead and _project(
                rotation, translation, vertices, v, eye, corner[c], place[c]
            )
        dx, dy = place[1, 0] - place[0, 0], place[1, 1] - place[0, 1]
        length = np.sqrt(dx * dx + dy * dy)
        if not is_ahead or length < _SHORTEST_PX:
            continue
        for a in range(3):
            rim.point[m, a] = 0.5 * (corner[0, a] + corner[1, a])
        _see(rim.point[m], eye, rim.pixel[m])
        inward = dy * (place[2, 0] - place[0, 0]) - dx * (place[2, 1] - place[0, 1])
        outward = (-1.0 if inward > 0.0 else 1.0) / length
        rim.normal[m, 0], rim.normal[m, 1] = outward * dy, -outward * dx
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
    last_column, shift_px = warped.shape[1] - 1, np.float32(first_column - first_warped)
    scale_px_mm = np.float32(eye.focal_px * eye.x_mm)
    for r in range(height):
        for c in range(width):
            z = depth[r, c]
            if not z > np.float32(0.0):
                continue
            at = int(np.floor(np.float32(c) + shift_px - scale_px_mm / z))
            if 0 <= at <= last_column and not warped[r, at] <= z:
                warped[r, at] = z
            if -1 <= at < last_column and not warped[r, at + 1] <= z:
                warped[r, at + 1] = z


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
def _cell(rim: Rim, i: int, low: NDArray[np.float64], size_px: float) -> tuple[int, int]:
    """Row and column of the cell that point i falls in."""
    return (
        int((rim.pixel[i, 1] - low[1]) / size_px), int((rim.pixel[i, 0] - low[0]) / size_px)
    )  # fmt: skip


@njit(cache=True, nogil=True)
def smooth_normal(
    rim: Rim, i: int, low: NDArray[np.float64], head: NDArray[np.int32],
    following: NDArray[np.int32],
) -> tuple[float, float, bool]:  # fmt: skip
    """Normal of point i over its neighbours, and whether none of those close by is further out.

    Args:
        rim: of one eye.
        i: the point.
        low: (2,) px corner of the cells.
        head: (rows, columns) a point in each cell, -1 without one.
        following: (N,) the next in the same cell.
    """
    row, column = _cell(rim, i, low, _AROUND_PX)
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
    """The outermost points, about one per spacing and direction, with the normals smoothed."""
    n = rim.pixel.shape[0]
    if n == 0:
        return rim
    low = np.array([rim.pixel[:, 0].min(), rim.pixel[:, 1].min()])
    width, height = rim.pixel[:, 0].max() - low[0], rim.pixel[:, 1].max() - low[1]
    head = np.full((int(height / _AROUND_PX) + 1, int(width / _AROUND_PX) + 1), -1, dtype=np.int32)
    following = np.empty(n, dtype=np.int32)
    for i in range(n):
        row, column = _cell(rim, i, low, _AROUND_PX)
        following[i] = head[row, column]
        head[row, column] = i
    shape = (int(height / _SPACING_PX) + 1, int(width / _SPACING_PX) + 1, 4)
    taken = np.zeros(shape, dtype=np.bool_)
    kept, normal = np.empty(n, dtype=np.int32), np.empty((n, 2))
    m = 0
    for i in range(n):
        ux, uy, is_outermost = smooth_normal(rim, i, low, head, following)
        steep = abs(uy) > abs(ux)
        facing = (2 if steep else 0) + (1 if (uy if steep else ux) > 0.0 else 0)
        row, column = _cell(rim, i, low, _SPACING_PX)
        if is_outermost and not taken[row, column, facing]:
            taken[row, column, facing] = True
            kept[m], normal[m, 0], normal[m, 1] = i, ux, uy
            m += 1
    index = kept[:m]
    return Rim(
        rim.point[index], rim.pixel[index], normal[:m].copy(), rim.length[index], rim.vertex[index]
    )
