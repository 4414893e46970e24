"""Where an edge crosses a line in a picture, to a fraction of a pixel.

Along the line the grey value is m + a erf((x - c) / (sqrt(2) s)): m, a and c are fitted to places
half a pixel apart (Gauss-Newton). The blur s is assumed: as long as the places lie evenly about the
edge, a wrong one moves c by nothing.
"""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

BLUR_PX, STEP_PX = 0.8, 0.5
_MOST_PLACES, _ROUNDS, _LEAST_CHANGE_PX = 64, 4, 1e-3


@njit(cache=True, nogil=True)
def read_between(picture: NDArray[np.uint8], x: float, y: float) -> float:
    """Grey value between four pixels; NaN outside the picture."""
    height, width = picture.shape
    if not (0.0 <= x < width - 1.0 and 0.0 <= y < height - 1.0):
        return math.nan
    left, top = int(x), int(y)
    u, v = x - left, y - top
    upper = (1.0 - u) * picture[top, left] + u * picture[top, left + 1]
    lower = (1.0 - u) * picture[top + 1, left] + u * picture[top + 1, left + 1]
    value: float = (1.0 - v) * upper + v * lower
    return value


@njit(cache=True, nogil=True)
def fit_edge(greys: NDArray[np.float64], told: NDArray[np.float64]) -> None:
    """Fit one edge.

    Args:
        greys: (n,) values STEP_PX apart, evenly about the expected place.
        told: (3,) written: place c, half contrast a, root mean square of what the fit leaves; NaN
            where there is no edge.
    """
    told[:] = np.nan
    n = len(greys)
    m = greys.mean()
    a = 0.5 * (greys[-1] - greys[0])
    c = 0.0
    half = 0.5 * (n - 1) * STEP_PX
    for _ in range(_ROUNDS):
        # Normal equations of dm, da, dc.
        s_bb, s_bd, s_dd, s_b, s_d = 0.0, 0.0, 0.0, 0.0, 0.0
        r_1, r_b, r_d = 0.0, 0.0, 0.0
        for k in range(n):
            t = (k * STEP_PX - half - c) / BLUR_PX
            b = math.erf(t / math.sqrt(2.0))
            d = -a * math.sqrt(2.0 / math.pi) * math.exp(-0.5 * t * t) / BLUR_PX
            r = greys[k] - m - a * b
            s_bb += b * b
            s_bd += b * d
            s_dd += d * d
            s_b += b
            s_d += d
            r_1 += r
            r_b += r * b
            r_d += r * d
        # The mean is solved for first.
        bb, bd, dd = s_bb - s_b * s_b / n, s_bd - s_b * s_d / n, s_dd - s_d * s_d / n
        rb, rd = r_b - r_1 * s_b / n, r_d - r_1 * s_d / n
        determinant = bb * dd - bd * bd
        if not determinant > 1e-9 * max(bb * dd, 1e-9):
            return
        da = (dd * rb - bd * rd) / determinant
        dc = (bb * rd - bd * rb) / determinant
        m += (r_1 - da * s_b - dc * s_d) / n
        a += da
        c += dc
        if not abs(c) <= half:
            return
        if abs(dc) < _LEAST_CHANGE_PX:
            break
    squares = 0.0
    for k in range(n):
        t = (k * STEP_PX - half - c) / BLUR_PX
        squares += (greys[k] - m - a * math.erf(t / math.sqrt(2.0))) ** 2
    told[0], told[1], told[2] = c, a, math.sqrt(squares / n)


@njit(cache=True, nogil=True)
def locate_edges(
    picture: NDArray[np.uint8],
    places_px: NDArray[np.float64],
    steps_px: NDArray[np.float64],
    reach_px: NDArray[np.float64],
    told: NDArray[np.float64],
) -> None:
    """`fit_edge` along a short line across each expected edge.

    Args:
        picture: (H, W) grey.
        places_px: (N, 2) where edges are expected.
        steps_px: (N, 2) towards white, to 1 px beyond each edge; not always at right angles to it.
        reach_px: (N,) how far it is looked, at right angles to the edge.
        told: (N, 3) written.
    """
    greys = np.empty(_MOST_PLACES)
    for i in range(len(places_px)):
        n_side = min(int(reach_px[i] / STEP_PX), (_MOST_PLACES - 1) // 2)
        n = 2 * n_side + 1
        is_seen = n_side >= 3
        if is_seen:
            for k in range(n):
                s = (k - n_side) * STEP_PX
                x = places_px[i, 0] + s * steps_px[i, 0]
                y = places_px[i, 1] + s * steps_px[i, 1]
                greys[k] = read_between(picture, x, y)
                is_seen = is_seen and not math.isnan(greys[k])
        if is_seen:
            fit_edge(greys[:n], told[i])
        else:
            told[i, :] = np.nan
