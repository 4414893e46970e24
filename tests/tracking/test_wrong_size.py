"""A plan of another size: what is seen of it is in the bound, or the pose is refused."""

import pytest

from tests.bench.bounds import FIRST_SEED, render_knee
from tests.bench.wrong_sizes import SizedFrame, track_sized


def track_patella(size: float, highlights: float) -> list[SizedFrame]:
    sequence = render_knee("patella", "overlay", 1, FIRST_SEED, 2, highlights)
    return list(track_sized(sequence, size))


@pytest.mark.parametrize("highlights", [0.0, 1.0])
@pytest.mark.parametrize("size", [0.99, 1.0, 1.01])
def test_the_bound_of_a_small_bone_counts_a_size_that_is_a_little_off(
    size: float, highlights: float
) -> None:
    frames = track_patella(size, highlights)
    assert all(one.is_ok for one in frames)
    # One per cent is as much as edges may be off in common: not all of it is seen as size.
    assert max(one.error_mm / one.bound_mm for one in frames) < 1.2


@pytest.mark.parametrize("highlights", [0.0, 1.0])
@pytest.mark.parametrize("size", [0.93, 0.95, 0.97, 1.03, 1.05, 1.07])
def test_a_small_bone_of_another_size_is_refused(size: float, highlights: float) -> None:
    assert not any(one.is_ok for one in track_patella(size, highlights))
