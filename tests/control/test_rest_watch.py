"""A bone that moves is not measured in pictures that are not exposed at once."""

from dataclasses import replace

import numpy as np
import pytest

from navapp.control.rest_watch import RestWatch
from tests.control.fakes import a_frame, a_pose

FRAME_NS = 33_000_000
HERE = np.zeros((1, 3))


def rests_in_second_frame(
    speed_mm_s: float, skew_ns: int = 0, row_delay_ns: int = 0, elapsed_ns: int = FRAME_NS
) -> bool:
    watch, frame = RestWatch(HERE, row_delay_ns), replace(a_frame(), skew_ns=skew_ns)
    watch.is_at_rest(frame, a_pose())
    moved = a_pose().move((1e-9 * elapsed_ns * speed_mm_s, 0, 0, 0, 0, 0), np.zeros(3))
    return watch.is_at_rest(replace(frame, captured_ns=frame.captured_ns + elapsed_ns), moved)


@pytest.mark.parametrize(
    ("skew_ns", "row_delay_ns", "limit_mm_s"),
    [
        (4_000_000, 0, 2.5),
        (-4_000_000, 0, 2.5),
        (0, 14_000, 3.57),
        (1_200_000, 14_000, 2.5),
    ],
)
def test_what_a_bone_goes_between_both_exposures_counts(
    skew_ns: int, row_delay_ns: int, limit_mm_s: float
) -> None:
    assert rests_in_second_frame(0.9 * limit_mm_s, skew_ns, row_delay_ns)
    assert not rests_in_second_frame(1.1 * limit_mm_s, skew_ns, row_delay_ns)


def test_pictures_that_are_exposed_at_once_show_any_bone_as_it_is() -> None:
    assert rests_in_second_frame(200.0)
    assert RestWatch(HERE, 0).is_at_rest(a_frame(), a_pose())


def test_without_an_earlier_frame_the_motion_is_not_known() -> None:
    assert not RestWatch(HERE, 0).is_at_rest(replace(a_frame(), skew_ns=1000), a_pose())
    # A live frame does not tell the rows' delay: the rig does.
    assert not RestWatch(HERE, 14_000).is_at_rest(a_frame(), a_pose())
    assert rests_in_second_frame(0.0, 1000, elapsed_ns=400_000_000)
    assert not rests_in_second_frame(0.0, 1000, elapsed_ns=401_000_000)
