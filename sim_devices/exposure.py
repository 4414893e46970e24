"""A picture whose rows gather light for a while, and one after the other.

The scene is rendered at some instants, evenly spread over the time in which any row is exposed. A
row's light is the mean over its own exposure, in which every instant stands for the time around it.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sim_devices.sensor import Rows

# Between two instants nothing moves farther than this in the picture: within the motion blur, and
# where there is none that would cover the steps between bands of rows.
_LONGEST_STEP_PX = 0.5
_FINE_STEP_PX = 0.25
# What moves like a flash would take minutes: the steps become longer then.
_MOST_INSTANTS = 160


@dataclass(frozen=True, slots=True)
class Shutter:
    """How the rows of a picture are exposed."""

    exposure_ns: int  # how long each row gathers light; 0: an instant
    row_delay_ns: int  # a row is exposed later by this than the row above it
    n_rows: int

    @property
    def rolling_ns(self) -> int:
        """From the first to the last row."""
        return self.row_delay_ns * (self.n_rows - 1)

    @property
    def total_ns(self) -> int:
        """From the first moment of the first row to the last one of the last row."""
        return self.rolling_ns + self.exposure_ns

    def weigh(self, path_px: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """The instants at which to render, and what each row takes of them.

        Args:
            path_px: how far anything moves in the picture during `total_ns`.

        Returns:
            (n,) instants in ns against mid exposure of the middle row, and (n, rows) weights,
            which add up to 1 for each row.
        """
        own_px = path_px * self.exposure_ns / max(self.total_ns, 1)
        step_px = min(max(own_px, _FINE_STEP_PX), _LONGEST_STEP_PX)
        n = min(math.ceil(path_px / step_px), _MOST_INSTANTS)
        if n <= 1:
            return np.zeros(1), np.ones((1, self.n_rows))
        # Exposed for less than a step, a row takes the two nearest instants.
        step_ns = max(self.total_ns / n, self.rolling_ns / (n - 1))
        window_ns = max(float(self.exposure_ns), step_ns)
        last_ns = 0.5 * (n - 1) * step_ns
        instants_ns = np.linspace(-last_ns, last_ns, n)
        rows_ns = (np.arange(self.n_rows) - 0.5 * (self.n_rows - 1)) * self.row_delay_ns
        apart_ns = np.abs(instants_ns[:, None] - rows_ns)
        shared_ns = np.clip(0.5 * (window_ns + step_ns) - apart_ns, 0.0, step_ns)
        return instants_ns, shared_ns / shared_ns.sum(axis=0)


def expose(
    render: Callable[[int, Rows | None], NDArray[np.float32]],
    shutter: Shutter,
    path_px: float,
    middle_ns: int,
) -> NDArray[np.float32]:
    """(H, W, 3) radiance of a picture.

    Args:
        render: the scene at a time in ns; only these rows of it are taken (None: all).
        shutter: of the camera.
        path_px: how far anything moves in the picture during the shutter's `total_ns`.
        middle_ns: mid exposure of the middle row.
    """
    instants_ns, weights = shutter.weigh(path_px)
    if len(instants_ns) == 1:
        return render(middle_ns, None)
    total: NDArray[np.float32] | None = None
    for instant_ns, row_weights in zip(instants_ns, weights.astype(np.float32), strict=True):
        taken = np.flatnonzero(row_weights)
        rows = (int(taken[0]), int(taken[-1]) + 1)
        light = render(middle_ns + round(instant_ns), rows)
        if total is None:
            total = np.zeros_like(light)
        part = slice(*rows)
        total[part] += row_weights[part, None, None] * light[part]
    if total is None:
        raise AssertionError("a picture has one instant at least")
    return total
