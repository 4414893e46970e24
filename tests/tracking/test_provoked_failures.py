"""Short operations in which something goes wrong; the long ones are in tests/bench."""

from functools import lru_cache

import numpy as np
import pytest

from navapp.config import Configuration
from navapp.config.camera_sections import CameraSection, SimulationSection
from navapp.evaluation.sequence import render_room
from navapp.tracking import Goal, Tracker, TrackState, make_tracker
from navapp.values import Reason, Status
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


@pytest.mark.slow
@pytest.mark.parametrize("defocus_px", few_of([4.0, 6.0]))
def test_what_is_out_of_focus_is_never_shown(defocus_px: float) -> None:
    settings = SimulationSection(seed=2_400_001, stepped=True, defocus_px=defocus_px)
    configuration = Configuration(camera=CameraSection(simulated=settings))
    sequence = render_room(configuration, "opening", 1)
    tracker = make_tracker(sequence.rig, sequence.plan.bones["femur"])
    state = TrackState.at_rest(sequence.truth[0], sequence.frames[0].captured_ns)
    goal = Goal(sequence.plan.targets_of(sequence.stage.targets), sequence.stage.tolerance_mm)
    found, _ = tracker.track(sequence.frames[0], state, goal)
    assert Reason.PICTURES_DEFOCUSED in found.verdict.reasons


@pytest.mark.slow
@pytest.mark.parametrize("seed", few_of([2_100_030, 2_100_058, 2_100_093]))
def test_a_patella_among_tissue_is_found_from_its_rough_pose(seed: int) -> None:
    simulated = SimulationSection(
        seed=seed,
        side="left" if seed % 2 else "right",
        sex="female" if seed // 2 % 2 else "male",
        age_group="middle" if seed // 4 % 2 else "young",
        stepped=True,
    )
    sequence = render_room(Configuration(camera=CameraSection(simulated=simulated)), "patella", 1)
    tracker = make_tracker(sequence.rig, sequence.plan.bones["patella"])
    targets_mm = sequence.plan.targets_of(sequence.stage.targets)
    goal = Goal(targets_mm, sequence.stage.tolerance_mm)
    found = tracker.register(sequence.frames[0], sequence.prior, goal)[0]
    assert found.verdict.status is Status.OK
    off_mm = found.left_from_bone.apply(targets_mm) - sequence.truth[0].apply(targets_mm)
    assert np.linalg.norm(off_mm, axis=1).mean() < 0.5


@pytest.mark.release
@pytest.mark.slow
def test_a_bone_that_moved_far_in_the_dark_is_found_again() -> None:
    """The search around the last pose alone does not find this one."""
    frames = frames_of(DARK, DARK.end_s + 0.7)
    assert max(one.tre_mm for one in frames if one.is_ok) < WORST_OK_MM
    assert back_after_s(DARK, frames) < 0.7
