"""A sawn patella is followed by its face."""

from dataclasses import replace
from itertools import cycle

import numpy as np
import pytest

from navapp.control.stages import stage_by_name
from navapp.control.trackers import Trackers
from navapp.face_tracking import FaceTracker
from navapp.face_tracking.face_plane import face_twists
from navapp.geometry.directions import ViewCone
from navapp.registration.verdict import Evidence, find_reasons
from navapp.tracking import TrackerSettings, TrackState
from navapp.tracking.frame import TOLERATED_VARIANCE_RATIO, Fit
from navapp.tracking.methods import make_tracker
from navapp.tracking.surface_meter import NEAR_BOX
from navapp.values import (
    MeasuredFace,
    Plan,
    Prior,
    Reason,
    ResectionPlane,
    Status,
    TrackedFrame,
)
from tests.face_tracking.rooms import SMALL, SawnRoom, sawn_room


def followed(room: SawnRoom, tracker, shift_mm=(0.4, -0.3, 0.5)) -> list[TrackedFrame]:
    """The frames, from a pose next to the first one's."""
    truth = room.truth(room.frames[0])
    start = truth.move((*shift_mm, 0.004, -0.003, 0.005), truth.translation_mm)
    state = TrackState.at_rest(start, room.frames[0].captured_ns)
    answers = []
    for frame in room.frames:
        answer, state = tracker.track(frame, state, room.goal)
        answers.append(answer)
    return answers


@pytest.mark.parametrize("highlights", [0.0, 1.0])
def test_plane_and_outline_fix_the_pose_of_a_known_face(highlights) -> None:
    room = sawn_room(highlights=highlights)
    for frame, answer in zip(room.frames, followed(room, room.tracker()), strict=True):
        assert answer.verdict.status is Status.OK, answer.verdict.reasons
        error_mm = room.error_mm(answer.left_from_bone, frame)
        assert error_mm < 0.2
        assert error_mm < answer.verdict.predicted_tre_mm < 0.5
        assert answer.foreground is not None


def test_it_goes_with_a_bone_that_moves_while_its_rows_are_exposed() -> None:
    """At first the motion is not known, and is told as the reason."""
    room = sawn_room(9, drift_mm_s=50.0, shutter_ms=10.0, skew_ms=4.0)
    answers = followed(room, room.tracker(), shift_mm=(0.0, 0.0, 0.0))
    assert Reason.MOTION_UNKNOWN in answers[0].verdict.reasons
    assert sum(answer.verdict.status is Status.OK for answer in answers) >= 3
    for frame, answer in zip(room.frames, answers, strict=True):
        assert room.error_mm(answer.left_from_bone, frame) < 0.4
        assert room.error_mm(answer.left_from_bone, frame) < answer.verdict.predicted_tre_mm


class FakeMeter:
    """Measures every face to lie so much higher than it is known to, or none."""

    def __init__(self, higher_mm: float | None) -> None:
        self._higher_mm = higher_mm

    def measure(self, left, right, estimate, planned, others, *, expected, row_shifts_px):
        if self._higher_mm is None:
            return None
        tilts = planned.axes @ expected.normal / (planned.normal @ expected.normal)
        offset_mm = (expected.point_mm - planned.point_mm) @ expected.normal + self._higher_mm
        return MeasuredFace(planned, np.array([*tilts, offset_mm]), 0.01 * SMALL, 1.0)


@pytest.mark.parametrize(
    ("higher_mm", "reason"),
    [
        (None, Reason.NOT_CONVERGED),
        (0.7, Reason.OUTLIERS),
        (-0.7, Reason.OUTLIERS),
        (1.5, Reason.NOT_CONVERGED),
    ],
)
def test_a_face_that_is_not_confirmed_without_highlights_is_doubted(higher_mm, reason) -> None:
    room, tracker = sawn_room(), sawn_room().tracker()
    tracker._search._face_meter = FakeMeter(higher_mm)
    answer = followed(room, tracker)[0]
    assert answer.verdict.status is not Status.OK
    assert reason in answer.verdict.reasons


def test_around_a_part_what_highlights_may_do_is_left_open() -> None:
    room = sawn_room(highlights=0.0)
    whole, ring = room.tracker(), room.tracker()
    ring._search._face_meter, ring._search._has_part = FakeMeter(None), True
    measured, unmeasured = (followed(room, tracker)[0].verdict for tracker in (whole, ring))
    assert Reason.NOT_CONVERGED not in unmeasured.reasons
    # 0.1 px of disparity are 0.2 mm here.
    assert unmeasured.predicted_tre_mm > np.hypot(measured.predicted_tre_mm, 0.2)


def test_parts_and_other_cuts_of_the_bone_are_known_to_its_search() -> None:
    room = sawn_room()
    known = room.bone.with_caliper_face("patella", room.made)
    plane = room.made.plane
    aside = ResectionPlane("patella", plane.point_mm + 9.0 * plane.axes[0], plane.axes[0])
    search = FaceTracker(room.rig, known.make("aside", aside))._search
    assert [cut.plane for cut in search._others] == [aside]
    assert not search._has_part
    assert not room.tracker()._search._others


@pytest.mark.parametrize("depth_mm", [0.0, 0.7])
def test_what_is_no_plane_does_not_fit(depth_mm) -> None:
    """A face that is a bowl, so deep from its middle to its rim."""
    room = sawn_room(highlights=0.0)
    tracker = room.tracker()
    frame = tracker.begin(room.frames[0], room.truth(room.frames[0]))
    meter = tracker.meter
    measured = meter.measure_on_model(meter.render(frame.pair, frame.start, NEAR_BOX))
    cloud = measured.cloud
    away_mm = np.linalg.norm(cloud.points_mm - cloud.points_mm.mean(axis=0), axis=1)
    bowl_mm = depth_mm * (away_mm / np.percentile(away_mm, 95)) ** 2
    bent = replace(cloud, points_mm=cloud.points_mm + bowl_mm[:, None] * (0.0, 0.0, 1.0))
    estimate = tracker._search._fit_plane(replace(measured, make_cloud=lambda: bent), frame.start)
    ratio = Fit(estimate, measured).variance_ratio / TOLERATED_VARIANCE_RATIO
    is_misfit = Reason.SURFACE_MISFIT in find_reasons(Evidence(correlated_ratio=ratio))
    assert is_misfit == (depth_mm > 0.0)


class FakeOutline:
    """Stands for the outline: it shifts the pose each time, or finds no edges."""

    def __init__(self, *shifts_mm: float) -> None:
        self._shifts_mm = cycle(shifts_mm or (0.0,))

    def join(self, pair, fit, coarse_px, noise_variance_ratio, **_):
        twist = (next(self._shifts_mm), 0.0, 0.0, 0.0, 0.0, 0.0)
        pose = fit.pose.move(twist, fit.pose.translation_mm)
        moved = replace(fit.estimate, camera_from_bone=pose).scale_noise(noise_variance_ratio)
        return replace(fit, estimate=moved)


def test_without_a_border_a_plane_fixes_no_pose() -> None:
    room, tracker = sawn_room(), sawn_room().tracker()
    tracker.judge.outline = tracker._search._outline = FakeOutline()
    for answer in followed(room, tracker):
        assert answer.verdict.status is not Status.OK
        # Of three numbers nothing is known but the window.
        assert answer.verdict.predicted_tre_mm > 2.0


@pytest.mark.parametrize(("shift_mm", "rests"), [(0.15, False), (0.01, True)])
def test_what_goes_to_and_fro_has_not_settled(shift_mm: float, rests: bool) -> None:
    room, tracker = sawn_room(), sawn_room().tracker()
    tracker._search._outline = FakeOutline(shift_mm, -shift_mm)
    answer = followed(room, tracker)[0]
    assert (Reason.NOT_CONVERGED not in answer.verdict.reasons) == rests


def test_a_pose_is_known_no_better_than_its_face() -> None:
    room = sawn_room()
    surely = followed(room, room.tracker(replace(room.made, covariance=1e-8 * SMALL)))[0]
    loosely = followed(room, room.tracker(replace(room.made, covariance=25.0 * SMALL)))[0]
    assert loosely.verdict.predicted_tre_mm > 1.96 * 0.5
    assert surely.verdict.predicted_tre_mm < 0.5
    assert surely.verdict.status is Status.OK
    assert loosely.verdict.status is Status.DEGRADED


def test_a_bone_goes_with_the_face_that_is_known_of_it() -> None:
    """A reading that is 1 mm too thick puts the bone 1 mm too far from the eyes."""
    room = sawn_room()
    wrong = replace(room.made, tilts_offset=room.made.tilts_offset + np.array([0.0, 0.0, 1.0]))
    truth = room.truth(room.frames[0])
    normal = truth.rotation @ room.made.normal
    pose = followed(room, room.tracker(wrong))[0].left_from_bone
    moved_mm = pose.apply(room.made.point_mm) - truth.apply(room.made.point_mm)
    assert moved_mm @ normal == pytest.approx(-1.0, abs=0.15)


def test_what_is_not_there_is_not_found() -> None:
    room = sawn_room()
    far = followed(room, room.tracker(), shift_mm=(25.0, 0.0, 0.0))
    assert all(answer.verdict.status is not Status.OK for answer in far)


def test_it_registers_next_to_a_pose_alone() -> None:
    room, tracker = sawn_room(), sawn_room().tracker()
    frame = room.frames[0]
    (lost,) = tracker.register(frame, Prior(), room.goal)
    assert lost.verdict.reasons == (Reason.BONE_LOST,)
    near = Prior({"patella": room.truth(frame)})
    (found,) = tracker.register(frame, near, room.goal)
    assert found.verdict.status is Status.OK


def test_a_bone_without_a_face_has_no_such_tracker() -> None:
    room = sawn_room()
    with pytest.raises(ValueError, match="has no known face"):
        FaceTracker(room.rig, room.bone)


@pytest.mark.parametrize("method", ["bimcc", "icp"])
def test_a_session_follows_by_the_face_once_it_is_known(method) -> None:
    room = sawn_room()
    plan = Plan({"patella": room.bone.planned})
    settings = TrackerSettings(method=method)
    trackers = Trackers(room.rig, plan, Prior(), settings, make_tracker)
    trackers.set_bone(room.bone)
    assert not isinstance(trackers.tracker("patella"), FaceTracker)
    trackers.set_bone(room.bone.with_caliper_face("patella", room.made))
    tracker = trackers.tracker("patella")
    assert isinstance(tracker, FaceTracker) == (method == "bimcc")
    # Others would not count what the caliper leaves open.
    assert (tracker.model.bone.face is None) == (method == "icp")


def test_no_views_are_built_to_find_a_bone_by_its_face() -> None:
    room = sawn_room()
    cone = ViewCone(np.array([0.0, -1.0, 0.0]), 20.0)
    prior = Prior(cones={"patella": cone}, box=(500, 250, 200, 200))
    trackers = Trackers(room.rig, Plan({"patella": room.bone.planned}), prior, TrackerSettings())
    trackers.set_bone(room.bone.with_caliper_face("patella", room.made))
    stage = stage_by_name("patella")
    before = trackers.tracker("patella")
    (answer,) = trackers.register(stage, room.frames[0])
    assert answer.verdict.reasons == (Reason.BONE_LOST,)
    assert trackers.tracker("patella") is before


def test_a_face_is_described_by_its_twists() -> None:
    """A pose that is moved by them lays the known face on another one."""
    room = sawn_room()
    pose, centre_mm = room.truth(room.frames[0]), np.array([1.0, -2.0, 3.0])
    change = np.array([0.002, -0.001, 0.05])
    other = MeasuredFace(room.made.plane, room.made.tilts_offset + change, SMALL, 1.0)
    fixed, free = face_twists(room.made, pose, centre_mm)
    moved = pose.move(fixed @ change, pose.apply(centre_mm))
    np.testing.assert_allclose(
        moved.rotate(room.made.normal[None]), pose.rotate(other.normal[None]), atol=1e-5
    )
    off_mm = moved.apply(room.made.point_mm) - pose.apply(other.point_mm)
    assert abs(off_mm @ pose.rotate(other.normal[None])[0]) < 2e-3
    # Along the face, and about its normal.
    slid = pose.move(free @ (0.3, -0.2, 0.01), pose.apply(centre_mm))
    normal = pose.rotate(room.made.normal[None])[0]
    np.testing.assert_allclose(slid.rotate(room.made.normal[None])[0], normal, atol=1e-9)
    slid_mm = slid.apply(room.made.plane.point_mm) - pose.apply(room.made.plane.point_mm)
    assert abs(slid_mm @ normal) < 0.05
    assert np.linalg.norm(slid_mm) == pytest.approx(np.hypot(0.3, 0.2), rel=0.01)
