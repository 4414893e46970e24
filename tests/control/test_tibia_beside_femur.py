"""A tibia that was asked for: when it is searched for from the femur, and what becomes of it."""

from types import SimpleNamespace

import numpy as np
import pytest

from navapp.control.beside_femur import FoundBone
from navapp.control.bone_tracks import BoneTracks
from navapp.control.other_bones import AskedBones, OtherBones
from navapp.control.registration_job import Registration
from navapp.control.stages import STAGES, stage_of
from navapp.limb import LimbMeasurement
from navapp.tracking import Goal
from navapp.values import Reason, Status, TrackedFrame
from tests.control.fakes import (
    LOST,
    PERIOD_NS,
    FakeTracker,
    Script,
    a_frame,
    a_plan,
    a_pose,
    answer,
)

OPENING = STAGES[0]
DEGRADED = answer(Status.DEGRADED, Reason.SURFACE_MISFIT, pose=a_pose("tibia", x_mm=9.0))


class FakeBeside:
    """Finds what it is told to find, some frames after the search began."""

    def __init__(self, tracker: FakeTracker, found: TrackedFrame, after: int = 0) -> None:
        self._tracker, self.found, self.after = tracker, found, after
        self.began: list[int] = []
        self.hidden_behind: list[object] = []
        self.spread, self.kept = 1.0, None
        self.spreads: list[float | None] = []
        self._due: tuple[int, FoundBone] | None = None

    @property
    def is_searching(self) -> bool:
        return self._due is not None

    def can_find(self, bone, active) -> bool:
        return (bone, active) == ("tibia", "femur")

    def tracker(self, bone, left_from_femur, *, is_found):
        self.hidden_behind.append(left_from_femur)
        self.spreads.append(self.kept if is_found else None)
        return self._tracker

    def keep(self, found) -> None:
        self.kept = found.spread[0, 0]

    def start(self, stage, frame, left_from_femur, track_number) -> None:
        self.began.append(frame.sequence)
        found = FoundBone(
            self.found,
            frame.captured_ns,
            left_from_femur,
            track_number,
            self.spread * np.eye(6),
        )
        self._due = frame.sequence + self.after, found

    def take_due(self, sequence):
        if self._due is None or sequence < self._due[0]:
            return None
        found, self._due = self._due[1], None
        return found

    def cancel(self) -> None:
        self._due = None

    def measure_limb(self, femur, tibia) -> LimbMeasurement:
        return LimbMeasurement(None, {}, f"{femur.camera_from_bone.source} and {tibia.n_points}")


class Room:
    """Other bones beside an active femur, frame by frame."""

    def __init__(self, found: TrackedFrame, after: int = 0, **asked) -> None:
        self.script = Script(tracked_of={"tibia": answer(pose=a_pose("tibia"))})
        tracker = FakeTracker(self.script, SimpleNamespace(name="tibia"))
        trackers = SimpleNamespace(
            tracker=lambda bone: tracker,
            goal=lambda stage: Goal(None, stage.tolerance_mm),
            register=lambda stage, frame: [],
            follows_refused=False,
        )
        self.tracks = BoneTracks(trackers)
        self.beside = FakeBeside(tracker, found, after)
        self.taken_over: list[int] = []
        self.others = OtherBones(
            self.tracks, a_plan(), self.beside, AskedBones(("tibia",), **asked),
            self.taken_over.append,
        )  # fmt: skip
        self.sequence = -1

    def step(self, femur: TrackedFrame | None = None, *, is_accepted: bool = True):
        self.sequence += 1
        frame = a_frame(10**9 + self.sequence * PERIOD_NS, self.sequence)
        active = answer() if femur is None else femur
        return self.others.follow(OPENING, frame, active, is_accepted=is_accepted).get("tibia")

    def steps(self, n: int, **words):
        return [self.step(**words) for _ in range(n)]


FOUND = answer(pose=a_pose("tibia", x_mm=4.0))


def test_it_is_found_in_its_first_turn_and_followed_in_the_next_ones() -> None:
    room = Room(FOUND)
    first, none, second = room.steps(3)
    assert first is FOUND
    assert none is None
    assert second is room.script.tracked_of["tibia"]
    assert room.beside.began == [0]
    assert room.taken_over == [0]
    # Behind the femur, from where it was found.
    (behind,) = room.beside.hidden_behind
    assert (behind.matrix == a_pose().matrix).all()
    started = room.script.tracks[0][1].left_from_bone
    assert (started.matrix == FOUND.left_from_bone.matrix).all()


def test_it_is_not_found_beside_a_femur_in_doubt_or_lost() -> None:
    for femur in (answer(Status.DEGRADED, Reason.SURFACE_MISFIT), LOST):
        room = Room(FOUND)
        tracked = room.step(femur)
        assert tracked.verdict.status is Status.LOST
        assert room.beside.began == []


def test_it_is_found_again_where_it_is_not_ok() -> None:
    room = Room(FOUND)
    room.steps(2)
    room.script.tracked_of["tibia"] = DEGRADED
    assert room.step() is FOUND
    assert room.beside.began == [0, 2]


def test_the_better_of_both_answers_stands() -> None:
    room = Room(FOUND)
    room.steps(2)
    room.script.tracked_of["tibia"] = DEGRADED
    room.beside.found = LOST
    assert room.step() is DEGRADED


def test_where_every_frame_stands_for_itself_it_is_found_in_each() -> None:
    room = Room(FOUND, is_each=True)
    assert room.steps(3) == [FOUND] * 3
    assert room.beside.began == [0, 1, 2]
    assert room.script.tracks == []


def test_a_live_search_goes_on_while_frames_are_handled_and_its_pose_goes_with_the_femur() -> None:
    room = Room(FOUND, after=4, is_live=True)
    assert room.steps(4) == [None] * 4
    tracked = room.step(answer(pose=a_pose(x_mm=2.5)))
    assert tracked is room.script.tracked_of["tibia"]
    assert room.beside.began == [0]
    assert room.taken_over == [4]
    expected = room.script.tracks[0][1].expected.translation_mm
    assert expected[0] == pytest.approx(4.0 + 2.5)


def test_a_live_session_asks_for_an_accepted_femur() -> None:
    room = Room(FOUND, is_live=True)
    assert room.steps(3, is_accepted=False) == [None] * 3
    assert room.beside.began == []
    assert room.steps(2) == [None, FOUND]


def test_a_live_session_follows_nothing_in_doubt_and_does_not_search_without_a_break() -> None:
    room = Room(DEGRADED, is_live=True, turns_between=3)
    answers = room.steps(16)
    assert room.beside.began == [0, 8]
    assert [one for one in answers if one is not None] == [DEGRADED] * 2
    assert room.script.tracks == []


def test_what_was_found_beside_a_femur_that_was_registered_anew_is_dropped() -> None:
    room = Room(FOUND, after=2, is_live=True)
    room.steps(2)
    room.tracks.drop_candidates()
    assert room.step() is None
    assert room.taken_over == [2]


def test_a_found_pose_keeps_its_spread_when_a_later_search_finds_nothing() -> None:
    room = Room(FOUND)
    room.steps(2)
    room.script.tracked_of["tibia"] = DEGRADED
    room.beside.found, room.beside.spread = LOST, 0.0
    room.steps(3)
    assert room.beside.spreads == [1.0, 1.0]


def test_what_was_found_is_not_followed_where_the_femur_is_not_ok() -> None:
    room = Room(FOUND)
    room.steps(2)
    tracked = room.step(answer(Status.DEGRADED, Reason.SURFACE_MISFIT))
    assert tracked is None or tracked.verdict.status is Status.LOST
    assert room.beside.hidden_behind == []
    assert room.script.tracks == []


def test_a_found_pose_takes_the_place_of_an_accepted_one_unaccepted() -> None:
    room, own = Room(FOUND), stage_of("tibia", a_plan())
    room.tracks.offer(Registration([answer(pose=a_pose("tibia"))], 10**9))
    room.tracks.accept(own)
    room.script.tracked_of["tibia"] = DEGRADED
    room.steps(2)
    assert room.tracks.is_followed(own)
    assert not room.tracks.is_accepted(own)


def test_nobody_has_accepted_what_was_found() -> None:
    room = Room(FOUND)
    room.steps(3)
    own = stage_of("tibia", a_plan())
    assert room.tracks.is_followed(own)
    assert not room.tracks.is_accepted(own)
    assert room.tracks.accepted == ()


def test_the_limb_is_described_while_both_are_followed() -> None:
    room = Room(FOUND)
    line = room.others.describe_limb(OPENING, 0)
    assert (line.measurement, line.age_ms) == (None, None)
    assert room.others.describe_limb(stage_of("patella", a_plan("patella", "femur")), 0) is None


def test_the_limb_is_measured_in_one_frame_of_two_ok_poses_of_which_the_active_is_accepted() -> (
    None
):
    room = Room(FOUND, is_live=True)
    frame = a_frame(10**9)
    pair = {"tibia": FOUND}
    measured = room.others.measure_limb(OPENING, frame, answer(), pair)
    assert measured.missing == "femur and 500"
    line = room.others.describe_limb(OPENING, 10**9 + 40_000_000)
    assert (line.measurement, line.age_ms) == (measured, 40.0)
    assert room.others.measure_limb(OPENING, frame, answer(), pair, is_accepted=False) is None
    assert room.others.measure_limb(OPENING, frame, answer(), {}) is None
    assert room.others.measure_limb(OPENING, frame, answer(), {"tibia": DEGRADED}) is None
    assert room.others.measure_limb(OPENING, frame, LOST, pair) is None
    room.others.forget()
    assert room.others.describe_limb(OPENING, 0).measurement is None
