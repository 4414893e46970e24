"""An order of points in which any first n are spread evenly over all of them."""

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.transform import FloatArray


def order_evenly(points_mm: FloatArray) -> NDArray[np.int64]:
    """(N,) indices of points (N, 3), such that any first n are spread over all of them.

    Neighbours follow each other along a curve that fills space (Morton); halving it again and again
    (van der Corput) gives the order.
    """
    size_mm = np.ptp(points_mm, axis=0).max()
    cells = (points_mm - points_mm.min(axis=0)) * (1023.0 / max(size_mm, 1e-9))
    bits = (cells.astype(np.int64)[:, :, None] >> np.arange(10)) & 1
    along = np.argsort((bits << (3 * np.arange(10) + np.arange(3)[:, None])).sum(axis=(1, 2)))
    halved = np.zeros(1, dtype=np.int64)
    while len(halved) < len(points_mm):
        halved = np.concatenate([2 * halved, 2 * halved + 1])
    order: NDArray[np.int64] = along[halved[halved < len(points_mm)]]
    return order
