"""Compiled scores of hypotheses by look-ups: edges in both pictures, and the measured surface."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from navapp.geometry.transform import FloatArray
from navapp.registration.depth_map import DepthMap, Optics

# Directions k pi / N_BINS of an edge's normal, which has no sign; chosen: one bit of a byte each.
N_BINS = 8


class Hypotheses(NamedTuple):
    """H poses, each one of O orientations at one of C places; O and C are much fewer than H."""

    orientation: NDArray[np.int32]  # (H,) index into `view_index`, `rotation` and `anchor_mm`
    place: NDArray[np.int32]  # (H,) index into `towards` and `position_mm`
    view_index: NDArray[np.int32]  # (O,) of the view that is seen
    rotation: FloatArray  # (O, 3, 3) of a bone on the optical axis
    anchor_mm: FloatArray  # (O, 3) the point of the bone that lies at the place
    towards: FloatArray  # (C, 3, 3) turns the optical axis into the line of sight of the place
    position_mm: FloatArray  # (C, 3) in the rectified left camera


class ViewEdges(NamedTuple):
    """Edges of V views, N points together."""

    starts: NDArray[np.int64]  # (V + 1,) where each view's points begin
    points_mm: FloatArray  # (N, 3)
    tangents: FloatArray  # (N, 3) unit, along the edge


class EdgeTables(NamedTuple):
    """What an edge of each direction finds at each pixel of both pictures, made smaller.

    (h, w, N_BINS) each; 255 where a gradient is across the edge.
    """

    left: NDArray[np.uint8]
    right: NDArray[np.uint8]
    optics: Optics


@njit(cache=True, nogil=True)
def rotate(R: FloatArray, vectors: FloatArray, i: int) -> tuple[float, float, float]:
    """Vector i of (N, 3) after a rotation."""
    x, y, z = vectors[i, 0], vectors[i, 1], vectors[i, 2]
    return (
        R[0, 0] * x + R[0, 1] * y + R[0, 2] * z,
        R[1, 0] * x + R[1, 1] * y + R[1, 2] * z,
        R[2, 0] * x + R[2, 1] * y + R[2, 2] * z,
    )


@njit(cache=True, nogil=True)
def compose_pose(some: Hypotheses, h: int, R: FloatArray, t: FloatArray) -> int:
    """Write rotation (3, 3) and translation (3,) of hypothesis h; returns its view."""
    o, c = some.orientation[h], some.place[h]
    for i in range(3):
        for j in range(3):
            R[i, j] = (
                some.towards[c, i, 0] * some.rotation[o, 0, j]
                + some.towards[c, i, 1] * some.rotation[o, 1, j]
                + some.towards[c, i, 2] * some.rotation[o, 2, j]
            )
        t[i] = some.position_mm[c, i]
        for j in range(3):
            t[i] -= R[i, j] * some.anchor_mm[o, j]
    view: int = some.view_index[o]
    return view


@njit(cache=True, nogil=True)
def response_at(
    response: NDArray[np.uint8], u: float, v: float, normal_x: float, normal_y: float
) -> float:
    """0 to 1: what an edge with this normal finds at a place in the picture; 0 outside."""
    x, y = int(np.floor(u + 0.5)), int(np.floor(v + 0.5))
    if not (0 <= x < response.shape[1] and 0 <= y < response.shape[0]):
        return 0.0
    k = int(np.floor(np.arctan2(normal_y, normal_x) * N_BINS / np.pi + 0.5)) % N_BINS
    found: float = response[y, x, k] / 255.0
    return found


@njit(cache=True, nogil=True)
def score_edges(
    some: Hypotheses,
    edges: ViewEdges,
    n_first: int,
    tables: EdgeTables,
    score: NDArray[np.float32],
    span: tuple[int, int],
) -> None:
    """Equations 2 and 3: mean response of a view's edges, over both pictures.

    Args:
        some: H hypotheses.
        edges: of all views.
        n_first: so many points of a view at most.
        tables: of the pictures.
        score: (H,) in place, 0 to 1; what is outside the pictures counts as 0.
        span: first and last (exclusive) hypothesis to be done.
    """
    optics = tables.optics
    R, t = np.empty((3, 3)), np.empty(3)
    for h in range(span[0], span[1]):
        view = compose_pose(some, h, R, t)
        first = edges.starts[view]
        n = min(edges.starts[view + 1] - first, n_first)
        total = 0.0
        for i in range(first, first + n):
            x, y, z = rotate(R, edges.points_mm, i)
            x, y, z = x + t[0], y + t[1], z + t[2]
            if z <= 1e-6:
                continue
            scale = optics.focal_px / z
            u, v = x * scale + optics.centre_x_px, y * scale + optics.centre_y_px
            # Derivatives of the projection along the edge, without their factor f / z.
            dx, dy, dz = rotate(R, edges.tangents, i)
            along_y = dy - y / z * dz
            total += response_at(tables.left, u, v, -along_y, dx - x / z * dz)
            u -= optics.baseline_mm * scale
            along_x = dx - (x - optics.baseline_mm) / z * dz
            total += response_at(tables.right, u, v, -along_y, along_x)
        score[h] = total / (2.0 * n) if n > 0 else 0.0


@njit(cache=True, nogil=True)
def score_surface(
    some: Hypotheses,
    surface_mm: FloatArray,
    depth: DepthMap,
    reach_mm: float,
    score: NDArray[np.float32],
    span: tuple[int, int],
) -> None:
    """Fraction of a view's surface that was measured there, less what was seen through.

    Args:
        some: H hypotheses.
        surface_mm: (V, n, 3) n points of the surface that each view shows.
        depth: measured.
        reach_mm: a depth within this agrees; one further away contradicts; what is nearer may
            hide the bone.
        score: (H,) in place, -1 to 1.
        span: first and last (exclusive) hypothesis to be done.
    """
    depth_mm, optics = depth.depth_mm, depth.optics
    height, width = depth_mm.shape
    n = surface_mm.shape[1]
    R, t = np.empty((3, 3)), np.empty(3)
    for h in range(span[0], span[1]):
        points_mm = surface_mm[compose_pose(some, h, R, t)]
        agreeing = 0
        for i in range(n):
            x, y, z = rotate(R, points_mm, i)
            x, y, z = x + t[0], y + t[1], z + t[2]
            if z <= 1e-6:
                continue
            scale = optics.focal_px / z
            u = int(np.floor(x * scale + optics.centre_x_px + 0.5))
            v = int(np.floor(y * scale + optics.centre_y_px + 0.5))
            if not (0 <= u < width and 0 <= v < height) or depth_mm[v, u] <= 0.0:
                continue
            behind_mm = depth_mm[v, u] - z
            if behind_mm > -reach_mm:
                agreeing += 1 if behind_mm <= reach_mm else -1
        score[h] = agreeing / n
