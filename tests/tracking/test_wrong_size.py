"""Part of a plan's wrong size moves the pose: the bound counts what is seen of it."""

import pytest

from tests.bench.bounds import FIRST_SEED, render_knee
from tests.bench.wrong_sizes import track_sized


@pytest.mark.parametrize("highlights", [0.0, 1.0])
@pytest.mark.parametrize("size", [0.99, 1.0, 1.01])
def test_the_bound_of_a_small_bone_counts_a_size_that_is_off(
    size: float, highlights: float
) -> None:
    sequence = render_knee("patella", "overlay", 1, FIRST_SEED, 2, highlights)
    frames = list(track_sized(sequence, size))
    assert all(one.is_ok for one in frames)
    assert max(one.error_mm / one.bound_mm for one in frames) < (1.8 if size < 1.0 else 1.0)
