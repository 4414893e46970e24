"""A bone that moves is not measured in pictures that are not exposed at once."""

from dataclasses import replace

import numpy as np
import pytest

from navapp.control.rest_watch import RestWatch
from tests.control.fakes import a_frame, a_pose

FRAME_NS = 33_000_000


def told(speed_mm_s: float, skew_ns: int = 0, row_delay_ns: int = 0, gap: int = 1) -> bool:
    """Of the second of two frames."""
    watch = RestWatch(np.zeros((1, 3)))
    frame = replace(a_frame(), skew_ns=skew_ns, row_delay_ns=row_delay_ns)
    watch.is_at_rest(frame, a_pose())
    elapsed_ns = gap * FRAME_NS
    moved = a_pose().move((1e-9 * elapsed_ns * speed_mm_s, 0, 0, 0, 0, 0), np.zeros(3))
    return watch.is_at_rest(replace(frame, captured_ns=frame.captured_ns + elapsed_ns), moved)


@pytest.mark.parametrize(
    ("speed_mm_s", "skew_ns", "row_delay_ns", "rests"),
    [
        (200.0, 0, 0, True),
        (1.0, 4_000_000, 0, True),
        (25.0, 4_000_000, 0, False),
        (25.0, -4_000_000, 0, False),
        (1.0, 0, 14_000, True),
        (25.0, 0, 14_000, False),
    ],
)
def test_what_a_bone_goes_between_both_exposures_counts(
    speed_mm_s: float, skew_ns: int, row_delay_ns: int, rests: bool
) -> None:
    assert told(speed_mm_s, skew_ns, row_delay_ns) == rests


def test_without_an_earlier_frame_only_pictures_that_are_exposed_at_once_are_known() -> None:
    assert RestWatch(np.zeros((1, 3))).is_at_rest(a_frame(), a_pose())
    assert not RestWatch(np.zeros((1, 3))).is_at_rest(replace(a_frame(), skew_ns=1000), a_pose())
    assert told(0.0, 1000, gap=12)
    assert not told(0.0, 1000, gap=13)
