"""Where a plane cuts a mesh: lines, and the area that they enclose."""

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.directions import perpendicular_axes
from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.transform import FloatArray

_Edge = tuple[int, int]


def section_lines(mesh: TriangleMesh, height_mm: FloatArray) -> list[FloatArray]:
    """Polylines (N, 3) in which a plane cuts a mesh; closed ones end as they begin.

    Args:
        mesh: that is cut.
        height_mm: (V,) distance of its vertices from the plane, positive on one side.
    """
    lines = []
    for chain in _chain(*_cut_edges(mesh.faces, height_mm)):
        low, high = np.array(chain).T
        share = height_mm[low] / (height_mm[low] - height_mm[high])
        points = mesh.vertices_mm[low]
        lines.append(points + share[:, None] * (mesh.vertices_mm[high] - points))
    return lines


def find_piece(
    mesh: TriangleMesh, height_mm: FloatArray, is_over: NDArray[np.bool_]
) -> NDArray[np.bool_]:
    """(V,) vertices of the piece that a cut takes off a mesh.

    A plane meets other parts of a mesh, too. The piece is what hangs together beyond the plane and
    lies, in part at least, over the place of the cut.

    Args:
        mesh: that is cut.
        height_mm: (V,) distance of its vertices from the plane, positive beyond.
        is_over: (V,) vertices over the place of the cut.
    """
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    is_beyond = height_mm > 0.0
    a, b, c = mesh.faces.T
    start, end = np.concatenate([a, b, c]), np.concatenate([b, c, a])
    is_kept = is_beyond[start] & is_beyond[end]
    start, end = start[is_kept], end[is_kept]
    n = len(height_mm)
    graph = coo_matrix((np.ones(len(start), dtype=np.int8), (start, end)), shape=(n, n))
    _, part = connected_components(graph, directed=False)
    is_piece: NDArray[np.bool_] = is_beyond & np.isin(part, part[is_beyond & is_over])
    return is_piece


def count_corners(faces: NDArray[np.int32], is_marked: NDArray[np.bool_]) -> NDArray[np.uint8]:
    """(F,) how many corners of each triangle are marked; `is_marked` is one of each vertex."""
    marks = is_marked.astype(np.uint8)
    a, b, c = faces.T
    # A sum along an axis of three takes several times as long.
    n_corners: NDArray[np.uint8] = marks[a] + marks[b] + marks[c]
    return n_corners


def clip_below(mesh: TriangleMesh, height_mm: FloatArray) -> TriangleMesh:
    """The part of a mesh on the negative side of a plane; triangles across it are cut in two.

    Its first vertices are those of the mesh. The arguments are those of `section_lines`.
    """
    is_below = height_mm <= 0.0
    n_below = count_corners(mesh.faces, is_below)
    whole = mesh.faces[n_below == 3]
    # Each with its odd corner first: the one below, or the one above.
    one, two = (
        _turn(mesh.faces[n_below == n], is_below[mesh.faces[n_below == n]] == (n == 1))
        for n in (1, 2)
    )
    edges = np.concatenate([one[:, [0, 1]], one[:, [0, 2]], two[:, [0, 1]], two[:, [0, 2]]])
    edges, index = np.unique(np.sort(edges, axis=1), axis=0, return_inverse=True)
    start, end = edges.T
    share = (height_mm[start] / (height_mm[start] - height_mm[end]))[:, None]
    points, normals = (
        values[start] + share * (values[end] - values[start])
        for values in (mesh.vertices_mm, mesh.normals)
    )
    a, b, c, d = np.split(
        index.ravel() + len(mesh.vertices_mm), np.cumsum([len(one)] * 2 + [len(two)])
    )
    faces = [
        whole,
        np.column_stack([one[:, 0], a, b]),
        np.column_stack([c, two[:, 1], two[:, 2]]),
        np.column_stack([c, two[:, 2], d]),
    ]
    return TriangleMesh(
        np.concatenate([mesh.vertices_mm, points]),
        np.concatenate(faces).astype(np.int32),
        np.concatenate([mesh.normals, normals]),
    )


def _turn(faces: NDArray[np.int32], is_first: NDArray[np.bool_]) -> NDArray[np.int32]:
    """Triangles (F, 3) with the marked corner first, the same way round."""
    first = is_first.argmax(axis=1)
    columns = (first[:, None] + np.arange(3)) % 3
    return np.take_along_axis(faces, columns, axis=1)


def fill_section(
    lines: list[FloatArray], normal: FloatArray, step_mm: float | None = None
) -> TriangleMesh | None:
    """The area that closed lines (N, 3) of a plane enclose, as triangles that face along a normal.

    A point is inside when the lines go round it an odd number of times. None without any area.

    Args:
        lines: of one plane.
        normal: (3,) unit, of the plane.
        step_mm: further vertices so far apart fill the area; None: it has those of the lines alone.
    """
    from scipy.spatial import Delaunay, QhullError

    closed = [line for line in lines if len(line) > 3 and np.allclose(line[0], line[-1])]
    if not closed:
        return None
    points = np.concatenate([line[:-1] for line in closed])
    axes = perpendicular_axes(normal[None])[0]
    flat, outlines = points @ axes.T, [line @ axes.T for line in closed]
    if step_mm is not None:
        inner = _grid_inside(flat, outlines, step_mm)
        points = np.concatenate([points, inner @ axes + (points[0] @ normal) * normal])
        flat = np.concatenate([flat, inner])
    try:
        faces = Delaunay(flat).simplices
    except QhullError:  # all on one line
        return None
    faces = faces[_is_inside(flat[faces].mean(axis=1), outlines)]
    if len(faces) == 0:
        return None
    a, b, c = (flat[faces[:, k]] for k in range(3))
    first, second = b - a, c - a
    is_turned = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0] < 0.0
    faces[is_turned] = faces[is_turned][:, ::-1]
    return TriangleMesh(points, faces.astype(np.int32), np.tile(normal, (len(points), 1)))


def _grid_inside(flat: FloatArray, outlines: list[FloatArray], step_mm: float) -> FloatArray:
    """(N, 2) points of a square grid within outlines, none near the vertices of these."""
    from scipy.spatial import cKDTree

    x, y = (
        np.arange(low + step_mm, high, step_mm)
        for low, high in zip(flat.min(axis=0), flat.max(axis=0), strict=True)
    )
    grid = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    grid = grid[cKDTree(flat).query(grid)[0] > 0.7 * step_mm]
    inside: FloatArray = grid[_is_inside(grid, outlines)]
    return inside


def _is_inside(points: FloatArray, outlines: list[FloatArray]) -> NDArray[np.bool_]:
    """(N,) whether closed lines (M, 2) go round points (N, 2) an odd number of times together."""
    is_inside = np.zeros(len(points), dtype=np.bool_)
    for line in outlines:
        is_inside ^= _is_enclosed(points, line)
    return is_inside


def _is_enclosed(points: FloatArray, line: FloatArray) -> NDArray[np.bool_]:
    """(N,) whether a closed line (M, 2) goes round points (N, 2) an odd number of times."""
    start, end = line[:-1], line[1:]
    x, y = points[:, :1], points[:, 1:]
    crosses = (start[:, 1] > y) != (end[:, 1] > y)
    rise = np.where(end[:, 1] == start[:, 1], 1.0, end[:, 1] - start[:, 1])
    at_x = start[:, 0] + (y - start[:, 1]) / rise * (end[:, 0] - start[:, 0])
    is_odd: NDArray[np.bool_] = (crosses & (x < at_x)).sum(axis=1) % 2 == 1
    return is_odd


def _cut_edges(faces: NDArray[np.int32], height_mm: FloatArray) -> tuple[list[_Edge], list[_Edge]]:
    """For each cut triangle the edge at which the plane enters it, and the one at which it leaves.

    An edge is named by its vertex below the plane and the one above.
    """
    is_above = height_mm > 0.0
    n_above = count_corners(faces, is_above)
    cut = faces[(n_above > 0) & (n_above < 3)]
    starts, ends = [], []
    for corners, above in zip(cut.tolist(), is_above[cut].tolist(), strict=True):
        for k in range(3):
            here, there = corners[k], corners[(k + 1) % 3]
            if above[k] and not above[(k + 1) % 3]:
                starts.append((there, here))
            elif not above[k] and above[(k + 1) % 3]:
                ends.append((here, there))
    return starts, ends


def _chain(starts: list[_Edge], ends: list[_Edge]) -> list[list[_Edge]]:
    """Edges in the order in which the plane meets them; triangles look the same way round."""
    following = dict(zip(starts, ends, strict=True))
    entered = set(ends)
    chains = []
    # Open lines begin at an edge that no triangle leads to.
    for first in [edge for edge in starts if edge not in entered] + starts:
        if first not in following:
            continue
        chain = [first]
        while chain[-1] in following:
            chain.append(following.pop(chain[-1]))
        chains.append(chain)
    return chains
