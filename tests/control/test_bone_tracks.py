from types import SimpleNamespace

import pytest

from navapp.control.bone_tracks import BoneTracks
from navapp.control.registration_job import Registration
from navapp.control.stages import STAGES
from navapp.tracking import Goal
from navapp.values import Reason, Status
from tests.control.fakes import LOST, FakeTracker, Script, a_frame, a_pose, answer

OPENING = STAGES[0]


@pytest.fixture
def script() -> Script:
    return Script()


@pytest.fixture
def tracks(script: Script) -> BoneTracks:
    tracker = FakeTracker(script, SimpleNamespace(name="femur"))
    return BoneTracks(
        SimpleNamespace(
            tracker=lambda bone: tracker,
            goal=lambda stage: Goal(None, stage.tolerance_mm),
            register=lambda stage, frame: script.found,
            follows_refused=False,
        )
    )


def offered(tracks: BoneTracks, *answers) -> BoneTracks:
    tracks.offer(Registration(list(answers), 5))
    return tracks


def test_lost_answers_are_no_candidates(tracks: BoneTracks) -> None:
    offered(tracks, LOST, answer(), LOST, answer())
    assert (tracks.candidate.number, tracks.candidate.count) == (1, 2)
    assert tracks.reject().number == 1
    assert tracks.candidate.number == 2
    tracks.reject()
    assert tracks.candidate is None
    assert offered(tracks, LOST).candidate is None


def test_where_refused_poses_are_followed_lost_answers_are_reviewed(script: Script) -> None:
    refused = answer(Status.LOST, Reason.COVERAGE_LOW)
    tracks = BoneTracks(SimpleNamespace(follows_refused=True))
    assert offered(tracks, refused).candidate.tracked is refused
    assert offered(tracks, answer(Status.LOST, has_pose=False)).candidate is None


def test_an_accepted_candidate_is_the_bones_track(tracks: BoneTracks, script: Script) -> None:
    offered(tracks, answer(pose=a_pose(x_mm=3.0)))
    assert not tracks.is_accepted(OPENING)
    tracks.accept(OPENING)
    assert tracks.accepted == ("femur",)
    assert tracks.candidate is None
    tracks.follow(OPENING, a_frame())
    assert script.tracks[-1][1].left_from_bone.translation_mm[0] == 3.0


def test_every_new_candidate_has_another_number_and_acceptance_keeps_it(
    tracks: BoneTracks,
) -> None:
    numbers = [tracks.track_number]
    offered(tracks, answer(), answer())
    numbers.append(tracks.track_number)
    tracks.reject()
    numbers.append(tracks.track_number)
    tracks.propose("femur", a_pose(), 9)
    numbers.append(tracks.track_number)
    assert len(set(numbers)) == len(numbers)
    tracks.accept(OPENING)
    tracks.follow(OPENING, a_frame())
    assert tracks.track_number == numbers[-1]


def test_what_is_registered_without_a_review_is_taken_unless_it_is_lost(
    tracks: BoneTracks, script: Script
) -> None:
    script.found = [LOST]
    assert tracks.register_now(OPENING, a_frame()) is LOST
    script.found = []
    assert tracks.register_now(OPENING, a_frame()).verdict.status is Status.LOST
    assert tracks.accepted == ()
    script.found = [answer()]
    tracks.register_now(OPENING, a_frame())
    assert tracks.accepted == ("femur",)


def test_trackers_are_handed_the_very_pictures(tracks: BoneTracks, script: Script) -> None:
    tracker = FakeTracker(script, SimpleNamespace(name="femur"))
    frames = [a_frame(captured_ns=number * 10**9, sequence=number) for number in range(1, 5)]
    offered(tracks, answer())
    tracks.review(OPENING, frames[0])
    tracks.accept(OPENING)
    tracks.follow(OPENING, frames[1])
    tracks.glance(OPENING, frames[2], None, tracker)
    tracks.propose("femur", a_pose(), 9)
    tracks.review(OPENING, frames[3])
    assert [id(one) for one in script.pictures] == [id(frame) for frame in frames]
    assert script.calls[-1] == "assess femur"
