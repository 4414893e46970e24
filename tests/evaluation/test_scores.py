"""What is said of a frame, by hand."""

import pytest

from tests.evaluation.scored import score


@pytest.mark.parametrize(
    ("frame", "within", "wrong"),
    [
        (score(0.4), True, False),
        (score(0.5), True, False),
        (score(0.9), False, False),  # beyond its bound, but not by more than 1 mm off
        (score(1.1), False, True),
        (score(1.1, bound_mm=1.2), True, False),
        (score(1.1, bound_mm=None), False, True),
        (score(9.0, "DEGRADED"), False, False),
        (score(None, "LOST"), False, False),
    ],
)
def test_wrong_is_ok_far_and_beyond_the_bound(frame, within, wrong) -> None:
    assert (frame.is_within_bound, frame.is_wrong) == (within, wrong)
