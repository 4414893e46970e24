"""The code that a display shows: alternately light and dark, for random times."""

from dataclasses import dataclass

import numpy as np

from navapp.geometry.transform import FloatArray

# The longer the pauses, the fewer frames fall beside a switch and say when it was; the shorter,
# the more frames see two. Two refreshes at 60 Hz are the least that a window shows.
SHORTEST_PAUSE_MS, LONGEST_PAUSE_MS = 40.0, 100.0


def draw_pauses_ms(duration_s: float, seed: int) -> FloatArray:
    """(n,) times between the switches, n odd: it begins and ends dark.

    Drawn evenly from 40 to 100 ms, all different: no rate of a camera or of a display is in step
    with the code, so that frames fall on every part of it, and the code looks like itself at one
    delay only.

    Args:
        duration_s: of the whole code, at most, but three pauses.
        seed: of the draw.
    """
    most = max(int(duration_s * 1e3 / SHORTEST_PAUSE_MS), 3)
    drawn = np.random.default_rng(seed).uniform(SHORTEST_PAUSE_MS, LONGEST_PAUSE_MS, most)
    fits = int(np.searchsorted(np.cumsum(drawn), duration_s * 1e3))
    return np.asarray(drawn[: max(fits - (fits + 1) % 2, 3)], dtype=np.float64)


@dataclass(frozen=True, slots=True, eq=False)
class Switches:
    """Times at which the display was told to switch between dark and light."""

    # (m,) rising, m even; dark before the first, lit after it, dark after the next.
    times_ms: FloatArray

    def compute_lit_fractions(
        self, times_ms: FloatArray, lags_ms: FloatArray, width_ms: float
    ) -> FloatArray:
        """(n, k) share of light in a window around each time, for each lag of the display.

        Args:
            times_ms: (n,) middles of the windows.
            lags_ms: (k,) by which all switches are late.
            width_ms: of the windows: the exposure, and what spreads the switches.
        """
        steps_ms = np.diff(self.times_ms, prepend=self.times_ms[0])
        # Time spent lit until each switch; it grows on the way to every second one.
        lit_ms = np.cumsum(np.where(np.arange(len(steps_ms)) % 2 == 1, steps_ms, 0.0))
        seen_ms = times_ms[:, None] - lags_ms
        until = np.interp(seen_ms + 0.5 * width_ms, self.times_ms, lit_ms)
        since = np.interp(seen_ms - 0.5 * width_ms, self.times_ms, lit_ms)
        return np.asarray((until - since) / width_ms)
