"""Compiled scores of poses by look-ups: in measured depth, and in the edges of both pictures."""

from typing import NamedTuple, Self

import numpy as np
from numba import njit
from numpy.typing import NDArray

from navapp.geometry.motion_kernels import move_point, rotate
from navapp.geometry.rectification import RectifiedGeometry
from navapp.geometry.transform import FloatArray
from navapp.values import DisparityMap

# Directions k pi / N_BINS of an edge's normal, which has no sign; chosen: one bit of a byte each.
N_BINS = 8
# Of `score_poses`, all chosen; its formula is in docs/how/registration.md, "A bone that is partly
# buried". Seen under a flatter angle, a point's depth hangs on fractions of a pixel.
LEAST_COSINE = 0.2
# Seen through: further away than so many widths of the kernel; fully so by this much more.
BEHIND_WIDTHS = 2.0
FULLY_BEHIND_MM = 1.0
BEHIND_WEIGHT = 2.0


class Optics(NamedTuple):
    """Focal length and centre in pixels of a scaled or cut rectified picture, and the baseline."""

    focal_px: float
    centre_x_px: float
    centre_y_px: float
    baseline_mm: float


class DepthMap(NamedTuple):
    """Measured depth (h, w), 0 where unknown, and the optics of its pixels."""

    depth_mm: NDArray[np.float32]
    optics: Optics

    @classmethod
    def of(cls, geometry: RectifiedGeometry, found: DisparityMap) -> Self:
        """The matched pixels of a map of disparity in a rectified pair."""
        is_known = found.is_matched & (found.disparity_px > 0.0)
        depth_mm = np.zeros(found.disparity_px.shape, dtype=np.float32)
        scale = geometry.focal_px * geometry.baseline_mm
        np.divide(scale, found.disparity_px, out=depth_mm, where=is_known)
        centre_px = geometry.centre_x_px - found.x, geometry.centre_y_px - found.y
        return cls(depth_mm, Optics(geometry.focal_px, *centre_px, geometry.baseline_mm))


def scale_optics(geometry: RectifiedGeometry, scale: int) -> Optics:
    """Optics of pictures made `scale` times smaller: u' = (u + 0.5) / scale - 0.5."""
    small = geometry.reduced(scale)
    return Optics(small.focal_px, small.centre_x_px, small.centre_y_px, small.baseline_mm)


class Hypotheses(NamedTuple):
    """H poses, each one of O orientations at one of C places; O and C are much fewer than H."""

    orientation: NDArray[np.int32]  # (H,) index into `view_index`, `rotation` and `anchor_mm`
    place: NDArray[np.int32]  # (H,) index into `towards` and `position_mm`
    view_index: NDArray[np.int32]  # (O,) of the view that is seen
    rotation: FloatArray  # (O, 3, 3) of a bone on the optical axis
    anchor_mm: FloatArray  # (O, 3) the point of the bone that lies at the place
    towards: FloatArray  # (C, 3, 3) turns the optical axis into the line of sight of the place
    position_mm: FloatArray  # (C, 3) in the rectified left camera


class EdgeTables(NamedTuple):
    """What an edge of each direction finds at each pixel of both pictures, made smaller.

    (h, w, N_BINS) each; 255 where a gradient is across the edge.
    """

    left: NDArray[np.uint8]
    right: NDArray[np.uint8]
    optics: Optics


class SurfacePoints(NamedTuple):
    """Points of a model."""

    points_mm: FloatArray  # (N, 3)
    normals: FloatArray  # (N, 3) unit, outward
    variance_mm2: FloatArray  # (N,) along the normal


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
    starts: NDArray[np.int64],
    edges_mm: FloatArray,
    tangents: FloatArray,
    n_first: int,
    tables: EdgeTables,
    score: NDArray[np.float32],
    span: tuple[int, int],
) -> None:
    """Equations 2 and 3: mean response of a view's edges, over both pictures.

    Args:
        some: H hypotheses.
        starts: (V + 1,) where each view's points begin.
        edges_mm: (N, 3) points on the edges of all views.
        tangents: (N, 3) unit, along the edge.
        n_first: so many points of a view at most.
        tables: of the pictures.
        score: (H,) in place, 0 to 1; what is outside the pictures counts as 0.
        span: first and last (exclusive) hypothesis to be done.
    """
    optics = tables.optics
    R, t = np.empty((3, 3)), np.empty(3)
    for h in range(span[0], span[1]):
        view = compose_pose(some, h, R, t)
        first = starts[view]
        n = min(starts[view + 1] - first, n_first)
        total = 0.0
        for i in range(first, first + n):
            x, y, z = move_point(R, t, edges_mm, i)
            if z <= 1e-6:
                continue
            scale = optics.focal_px / z
            u, v = x * scale + optics.centre_x_px, y * scale + optics.centre_y_px
            # Derivatives of the projection along the edge, without their factor f / z.
            dx, dy, dz = rotate(R, tangents, i)
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
            x, y, z = move_point(R, t, points_mm, i)
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


@njit(cache=True, nogil=True)
def score_poses(
    surface: SurfacePoints,
    n_first: int,
    rotations: FloatArray,
    shifts_mm: FloatArray,
    depth: DepthMap,
    sigma_mm: float,
    score: FloatArray,
    span: tuple[int, int],
) -> None:
    """Fraction of a model's seen area that was measured there, less what was seen through.

    The kernel is the fit's own; a point that something nearer hides, or where nothing was measured,
    counts for nothing.

    Args:
        surface: the model's.
        n_first: so many of its points count.
        rotations: (H, 3, 3) of the poses.
        shifts_mm: (H, 3).
        depth: measured.
        sigma_mm: width of the kernel, along the normal.
        score: (H,) in place, -2 to 1.
        span: first and last (exclusive) pose to be done.
    """
    depth_mm, optics = depth.depth_mm, depth.optics
    height, width = depth_mm.shape
    for k in range(span[0], span[1]):
        R, t = rotations[k], shifts_mm[k]
        area, agreeing, behind = 0.0, 0.0, 0.0
        for i in range(min(n_first, len(surface.points_mm))):
            x, y, z = move_point(R, t, surface.points_mm, i)
            normal_x, normal_y, normal_z = rotate(R, surface.normals, i)
            facing = -x * normal_x - y * normal_y - z * normal_z
            if z <= 1e-6 or facing <= 0.0:
                continue
            cosine = facing / np.sqrt(x * x + y * y + z * z)
            if cosine < LEAST_COSINE:
                continue
            area += cosine
            u = int(np.floor(optics.focal_px * x / z + optics.centre_x_px + 0.5))
            v = int(np.floor(optics.focal_px * y / z + optics.centre_y_px + 0.5))
            if not (0 <= u < width and 0 <= v < height) or depth_mm[v, u] <= 0.0:
                continue
            off_mm = (depth_mm[v, u] - z) * cosine
            kernel_mm2 = sigma_mm * sigma_mm + surface.variance_mm2[i]
            agreeing += cosine * np.exp(-0.5 * off_mm * off_mm / kernel_mm2)
            too_far_mm = off_mm - BEHIND_WIDTHS * np.sqrt(kernel_mm2)
            if too_far_mm > 0.0:
                behind += cosine * min(too_far_mm / FULLY_BEHIND_MM, 1.0)
        score[k] = (agreeing - BEHIND_WEIGHT * behind) / area if area > 0.0 else -1.0
