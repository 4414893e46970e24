"""Compiled scores of hypotheses by table look-ups: edges in both pictures, and the surface."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

N_BINS = 8


class Hypotheses(NamedTuple):
    """Poses as the kernels read them: an orientation at a place; H of them.

    Attributes:
        orientation: (H,) index into `aspect` and `rotation`.
        place: (H,) index into `towards` and `position`.
        aspect: (O,) the view of each orientation.
        rotation: (O, 3, 3) of each, for a bone on the optical axis.
        towards: (C, 3, 3) turns the optical axis into the line of sight of each place.
        position: (C, 3) mm, in the rectified left camera.
        anchor: (O, 3) the point of the bone, mm, that lies at the place.
    """

    orientation: NDArray[np.int32]
    place: NDArray[np.int32]
    aspect: NDArray[np.int32]
    rotation: NDArray[np.float64]
    towards: NDArray[np.float64]
    position: NDArray[np.float64]
    anchor: NDArray[np.float64]


class Optics(NamedTuple):
    """A rectified pair that has been scaled: px of its own, and the baseline in mm."""

    focal: float
    centre_x: float
    centre_y: float
    baseline: float


@njit(cache=True, nogil=True)
def quantise_gradients(
    picture: NDArray[np.float32],
    least: float,
    rows: tuple[int, int],
    bins: NDArray[np.uint8],
) -> None:
    """The direction of each gradient as one bit of a byte; 0 where it is too weak.

    Args:
        picture: (h, w).
        least: a weaker gradient says nothing, grey levels per px.
        rows: first and last (exclusive) to be done.
        bins: (h, w) in place; bit k: a direction of about k pi / 8 (a direction has no sign).
    """
    height, width = picture.shape
    for y in range(max(rows[0], 1), min(rows[1], height - 1)):
        for x in range(1, width - 1):
            gx = 0.5 * (picture[y, x + 1] - picture[y, x - 1])
            gy = 0.5 * (picture[y + 1, x] - picture[y - 1, x])
            if gx * gx + gy * gy <= least * least:
                continue
            k = int(np.floor(np.arctan2(gy, gx) * N_BINS / np.pi + 0.5)) % N_BINS
            bins[y, x] = np.uint8(1 << k)


@njit(cache=True, nogil=True)
def spread_responses(
    bins: NDArray[np.uint8],
    reach: int,
    answers: NDArray[np.uint8],
    rows: tuple[int, int],
    response: NDArray[np.uint8],
) -> None:
    """What an edge of each direction finds around each pixel.

    Args:
        bins: (h, w) of `quantise_gradients`.
        reach: px in both directions within which the best gradient counts.
        answers: (256, 8) response of a byte of bins to each direction.
        rows: first and last (exclusive) to be done.
        response: (h, w, 8) in place.
    """
    height, width = bins.shape
    for y in range(rows[0], rows[1]):
        for x in range(width):
            around = 0
            for row in range(max(y - reach, 0), min(y + reach + 1, height)):
                for column in range(max(x - reach, 0), min(x + reach + 1, width)):
                    around |= bins[row, column]
            for k in range(N_BINS):
                response[y, x, k] = answers[around, k]


@njit(cache=True, nogil=True)
def pose_of(
    some: Hypotheses, h: int, rotation: NDArray[np.float64], shift: NDArray[np.float64]
) -> int:
    """Rotation and translation of a hypothesis, in place; its view."""
    o, c = some.orientation[h], some.place[h]
    v: int = some.aspect[o]
    for i in range(3):
        shift[i] = some.position[c, i]
        for j in range(3):
            rotation[i, j] = (
                some.towards[c, i, 0] * some.rotation[o, 0, j]
                + some.towards[c, i, 1] * some.rotation[o, 1, j]
                + some.towards[c, i, 2] * some.rotation[o, 2, j]
            )
    for i in range(3):
        for j in range(3):
            shift[i] -= rotation[i, j] * some.anchor[o, j]
    return v


@njit(cache=True, nogil=True)
def response_at(
    response: NDArray[np.uint8], u: float, v: float, direction_x: float, direction_y: float
) -> float:
    """0 to 1: what an edge at a place, with its normal in a direction, finds; 0 outside."""
    height, width = response.shape[0], response.shape[1]
    x, y = int(np.floor(u + 0.5)), int(np.floor(v + 0.5))
    if not (0 <= x < width and 0 <= y < height):
        return 0.0
    k = int(np.floor(np.arctan2(direction_y, direction_x) * N_BINS / np.pi + 0.5)) % N_BINS
    found: float = response[y, x, k] / 255.0
    return found


@njit(cache=True, nogil=True)
def score_edges(
    some: Hypotheses,
    points: NDArray[np.float64],
    tangents: NDArray[np.float64],
    starts: NDArray[np.int64],
    n_first: int,
    left: NDArray[np.uint8],
    right: NDArray[np.uint8],
    optics: Optics,
    span: tuple[int, int],
    score: NDArray[np.float32],
) -> None:
    """Equations 2 and 3: mean response of a view's edges, over both pictures.

    Args:
        some: hypotheses.
        points: (N, 3) of all views, mm.
        tangents: (N, 3) along their edges.
        starts: (V + 1,) where each view's points begin.
        n_first: so many points of a view at most.
        left: (h, w, 8) response.
        right: of the other picture.
        optics: of both.
        span: first and last (exclusive) hypothesis to be done.
        score: (H,) in place; what is outside the pictures counts as 0.
    """
    R, t = np.empty((3, 3)), np.empty(3)
    for h in range(span[0], span[1]):
        view = pose_of(some, h, R, t)
        first = starts[view]
        n = min(starts[view + 1] - first, n_first)
        total = 0.0
        for i in range(first, first + n):
            x, y, z = points[i, 0], points[i, 1], points[i, 2]
            px = R[0, 0] * x + R[0, 1] * y + R[0, 2] * z + t[0]
            py = R[1, 0] * x + R[1, 1] * y + R[1, 2] * z + t[1]
            pz = R[2, 0] * x + R[2, 1] * y + R[2, 2] * z + t[2]
            if pz <= 1e-6:
                continue
            a, b, c = tangents[i, 0], tangents[i, 1], tangents[i, 2]
            dx = R[0, 0] * a + R[0, 1] * b + R[0, 2] * c
            dy = R[1, 0] * a + R[1, 1] * b + R[1, 2] * c
            dz = R[2, 0] * a + R[2, 1] * b + R[2, 2] * c
            inverse = optics.focal / pz
            # Derivative of the projection along the edge, without its factor f / z.
            along_y = dy - py / pz * dz
            u, v = px * inverse + optics.centre_x, py * inverse + optics.centre_y
            total += response_at(left, u, v, -along_y, dx - px / pz * dz)
            across = dx - (px - optics.baseline) / pz * dz
            total += response_at(right, u - optics.baseline * inverse, v, -along_y, across)
        score[h] = total / (2.0 * n) if n > 0 else 0.0


@njit(cache=True, nogil=True)
def score_surface(
    some: Hypotheses,
    points: NDArray[np.float64],
    starts: NDArray[np.int64],
    depth: NDArray[np.float32],
    optics: Optics,
    reach_mm: float,
    span: tuple[int, int],
    score: NDArray[np.float32],
) -> None:
    """Share of a view's surface that was measured there, less what was seen through.

    Args:
        some: hypotheses.
        points: (N, 3) of the surfaces that all views show, mm.
        starts: (V + 1,) where each view's points begin.
        depth: (h, w) measured, mm; 0 where unknown.
        optics: of that map.
        reach_mm: a depth within this agrees; one further away contradicts; what is nearer may
            hide the bone.
        span: first and last (exclusive) hypothesis to be done.
        score: (H,) in place, -1 to 1.
    """
    height, width = depth.shape
    R, t = np.empty((3, 3)), np.empty(3)
    for h in range(span[0], span[1]):
        view = pose_of(some, h, R, t)
        first, last = starts[view], starts[view + 1]
        agreeing = 0
        for i in range(first, last):
            x, y, z = points[i, 0], points[i, 1], points[i, 2]
            pz = R[2, 0] * x + R[2, 1] * y + R[2, 2] * z + t[2]
            if pz <= 1e-6:
                continue
            inverse = optics.focal / pz
            px = R[0, 0] * x + R[0, 1] * y + R[0, 2] * z + t[0]
            py = R[1, 0] * x + R[1, 1] * y + R[1, 2] * z + t[1]
            u = int(np.floor(px * inverse + optics.centre_x + 0.5))
            v = int(np.floor(py * inverse + optics.centre_y + 0.5))
            if not (0 <= u < width and 0 <= v < height) or depth[v, u] <= 0.0:
                continue
            behind = depth[v, u] - pz
            if behind > reach_mm:
                agreeing -= 1
            elif behind > -reach_mm:
                agreeing += 1
        score[h] = agreeing / (last - first) if last > first else 0.0
