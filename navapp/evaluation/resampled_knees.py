"""Intervals by drawing knees anew: frames of one knee are much alike, knees are not."""

from collections.abc import Sequence

import numpy as np

_N_RESAMPLED, _RESAMPLING_SEED = 2000, 20


def find_mean_interval(sums: Sequence[float], counts: Sequence[int]) -> tuple[float, float] | None:
    """95 % interval of the mean over all frames (percentile bootstrap); None of fewer than two.

    Args:
        sums: of each knee, over its frames.
        counts: of its frames; knees without any are drawn as well.
    """
    if sum(count > 0 for count in counts) < 2:
        return None
    drawn = np.random.default_rng(_RESAMPLING_SEED).integers(
        0, len(sums), (_N_RESAMPLED, len(sums))
    )
    n_values = np.array(counts)[drawn].sum(axis=1)
    means = np.array(sums)[drawn].sum(axis=1)[n_values > 0] / n_values[n_values > 0]
    low, high = np.percentile(means, (2.5, 97.5))
    return float(low), float(high)
