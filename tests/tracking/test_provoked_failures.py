"""Short operations in which something goes wrong; the long ones are in tests/bench."""

from functools import lru_cache

import pytest

from navapp.tracking import Tracker, make_tracker
from navapp.values import Reason
from tests.bench.provoked import Event, Shown, Theatre, played
from tests.bench.provoked_failures import back_after_s
from tests.many import few_of

SEED = 143
RATE_HZ = 15.0
WORST_OK_MM = 0.5
BEGIN_S, END_S = 0.2, 0.4
DARK = Event("dark, far", BEGIN_S, END_S, light=0.0, moved_mm=25.0, moved_deg=16.0)
EVENTS = {
    "60 % covered": Event("covered", BEGIN_S, END_S + 0.2, covered_share=0.6),
    "one camera blocked": Event("blocked", BEGIN_S, END_S, blocked="right"),
    "blurred": Event("blurred", BEGIN_S, END_S, blur_px=5.0),
    "lights out, moved": Event("dark", BEGIN_S, END_S, light=0.0, moved_mm=14.0, moved_deg=9.0),
    "jump": Event("jump", BEGIN_S, BEGIN_S, moved_mm=14.0, moved_deg=9.0),
}


@lru_cache(maxsize=1)
def tracker() -> Tracker:
    theatre = Theatre(SEED, Event("nothing"))
    return make_tracker(theatre.rig, theatre.bone)


def frames_of(event: Event, until_s: float) -> list[Shown]:
    return list(played(Theatre(SEED, event), tracker(), RATE_HZ, until_s))


@pytest.mark.slow
@pytest.mark.parametrize("name", few_of(EVENTS))
def test_what_goes_wrong_shows_no_wrong_pose_and_is_over_soon(name: str) -> None:
    event = EVENTS[name]
    frames = frames_of(event, event.end_s + 0.2)
    assert all(one.is_ok for one in frames if one.time_s < event.start_s)
    assert max(one.tre_mm for one in frames if one.is_ok) < WORST_OK_MM
    assert back_after_s(event, frames) <= 0.2
    for one in frames:
        assert one.is_ok or one.tracked.verdict.reasons
        if event.is_on(one.time_s) and (event.blocked or event.light < 1.0):
            assert not one.is_ok
            assert one.tracked.verdict.reasons[0] is Reason.PICTURE_DARK


@pytest.mark.release
@pytest.mark.slow
def test_a_bone_that_moved_far_in_the_dark_is_found_again() -> None:
    """The search around the last pose alone does not find this one."""
    frames = frames_of(DARK, DARK.end_s + 0.7)
    assert max(one.tre_mm for one in frames if one.is_ok) < WORST_OK_MM
    assert back_after_s(DARK, frames) < 0.7
