"""Fits the lag at which a code explains a grey value best, and resamples it for its scatter."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.transform import FloatArray

# Exposure and spread of the switches together, from a quick shutter to some refreshes.
WIDTHS_MS = (4.0, 5.7, 8.0, 11.3, 16.0, 22.6, 32.0, 45.3, 64.0)
# About an exposure and a refresh: what is finer does not matter to a coarse search.
COARSE_WIDTH_MS = 20.0
# From stamps that come before the light to the slowest of televisions.
_COARSE_MS, _COARSE_STEP_MS = (-100.0, 700.0), 5.0
_FINE_STEP_MS, _FINE_REACH_MS = 0.25, 60.0
_N_DRAWS = 400
# Explained shares that differ by less are the same but for rounding.
_SAME = 1e-9


@dataclass(frozen=True, slots=True, eq=False)
class BlockSums:
    """Products summed over blocks of frames, each less the means of its block, at k lags.

    Slow changes of the room's light move all frames of a block alike and leave no trace.
    """

    lags_ms: FloatArray  # (k,)
    # lit_grey, lit_lit: (b, k) of lit share and grey value, of lit share and itself.
    lit_grey: FloatArray
    lit_lit: FloatArray
    grey_grey: FloatArray  # (b,)

    def compute_explained(self, counts: FloatArray) -> FloatArray:
        """(r, k) share of the grey values' squares that the code explains; upside down it is 0.

        Args:
            counts: (r, b) how often each block counts.
        """
        together = np.maximum(counts @ self.lit_grey, 0.0)
        apart = (counts @ self.lit_lit) * (counts @ self.grey_grey)[:, None]
        return np.asarray(together**2 / np.maximum(apart, 1e-9))

    def best_lags_ms(self, counts: FloatArray) -> FloatArray:
        """(r,) that explain most; the middle of them where several do."""
        explained = self.compute_explained(counts)
        is_best = explained >= explained.max(axis=1, keepdims=True) - _SAME
        return np.asarray((is_best * self.lags_ms).sum(axis=1) / is_best.sum(axis=1))


def compute_block_sums(
    shares: FloatArray, grey: FloatArray, blocks: Sequence[slice], lags_ms: FloatArray
) -> BlockSums:
    """Of (n, k) lit shares and (n,) grey values."""
    centred = [
        (shares[block] - shares[block].mean(axis=0), grey[block] - grey[block].mean())
        for block in blocks
    ]
    return BlockSums(
        lags_ms,
        np.array([seen @ share for share, seen in centred]),
        np.array([(share**2).sum(axis=0) for share, _ in centred]),
        np.array([seen @ seen for _, seen in centred]),
    )


def list_coarse_lags_ms() -> FloatArray:
    """(k,) of the whole range."""
    return np.arange(*_COARSE_MS, _COARSE_STEP_MS)


def list_fine_lags_ms(around_ms: float) -> FloatArray:
    """(k,) around one of them."""
    n = round(_FINE_REACH_MS / _FINE_STEP_MS)
    return np.asarray(around_ms + _FINE_STEP_MS * np.arange(-n, n + 1))


def draw_counts(n_blocks: int, is_drawn: NDArray[np.bool_] | None = None) -> FloatArray:
    """(r, b) how often each block counts in recordings that are drawn from this one.

    Blocks, not frames, because neighbouring frames see the same switch.

    Source: H. R. Kuensch, The Jackknife and the Bootstrap for General Stationary Observations,
    Annals of Statistics 17(3), 1989; here with blocks that do not overlap.

    Args:
        n_blocks: of the recording.
        is_drawn: (b,) those that may count; all when absent.
    """
    among = np.ones(n_blocks) if is_drawn is None else is_drawn.astype(np.float64)
    n = int(among.sum())
    drawn = np.random.default_rng(0).multinomial(n, among / n, _N_DRAWS)
    return np.asarray(drawn, dtype=np.float64)
