"""A bone that moves while the rows of both pictures are exposed."""

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from navapp.geometry.rig import StereoRig
from navapp.registration import RegistrationModel
from navapp.tracking import TrackState
from navapp.tracking.bimcc_tracker import BimccTracker
from navapp.tracking.row_times import RowTimes
from navapp.tracking.surface_meter import SurfaceMeter
from navapp.values import Reason, Status
from tests.tracking.rooms import GOAL, room

ROW_DELAY_NS = 20_862  # 15 ms over 720 rows
VELOCITY = np.array([100.0, -20.0, 10.0, 0.0, 0.0, 0.0])
ALONG_X = np.eye(6)[0]


@lru_cache(maxsize=4)
def meter(row_delay_ns: int = ROW_DELAY_NS) -> SurfaceMeter:
    a = room()
    rig: StereoRig = replace(a.rig, row_delay_ns=row_delay_ns)
    return SurfaceMeter(rig, RegistrationModel(a.tracker.model.bone), (300.0, 700.0), 2500)


def rectified():
    a = room()
    return a.tracker.rectify_pose(a.truth(a.frames[0]))


def times(velocity=VELOCITY, skew_s: float = 0.0, row_delay_ns: int = ROW_DELAY_NS) -> RowTimes:
    """Of a bone that has moved evenly by `VELOCITY` since the frame before."""
    pose = rectified()
    last = pose.move(-0.05 * VELOCITY, pose.apply(room().tracker.centre_mm))
    return RowTimes(meter(row_delay_ns), np.asarray(velocity), last, 0.05, skew_s)


def test_rows_that_are_exposed_at_once_know_no_motion() -> None:
    state = TrackState.at_rest(room().truth(room().frames[0]), 0)
    assert RowTimes.of_pair(meter(0), state, 66_000_000, 0) is None
    assert RowTimes.of_pair(meter(0), state, 66_000_000, 1) is not None
    assert RowTimes.of_pair(meter(), state, 66_000_000, 0) is not None


def test_a_bone_at_rest_is_looked_up_where_it_is() -> None:
    assert times(np.zeros(6)).find_shifts(rectified()) is None


def test_rows_are_looked_up_where_the_bone_was_when_they_were_exposed() -> None:
    """The shift of a row is the way in the picture until it was exposed."""
    left_px, right_px = times().find_shifts(rectified())
    focal_px, depth_mm = room().rig.left.focal_px, rectified().apply(room().tracker.centre_mm)[2]
    per_row_px = VELOCITY[0] * focal_px / depth_mm * ROW_DELAY_NS * 1e-9
    for one in (left_px, right_px):
        steps_px = np.diff(one[:, 0])
        np.testing.assert_allclose(steps_px, steps_px[0])
        assert steps_px[0] == pytest.approx(per_row_px, rel=0.15)
    # Across the bone's box the left rows are moved to both sides alike.
    rows = times()._rows_of(rectified())
    assert np.interp(rows, np.arange(720), left_px[:, 0]).sum() == pytest.approx(0.0, abs=0.01)


def test_a_right_eye_that_looks_later_is_moved_along() -> None:
    together = times().find_shifts(rectified())
    later = times(skew_s=2e-3).find_shifts(rectified())
    np.testing.assert_array_equal(together[0], later[0])
    way_px = VELOCITY[0] * 2e-3 * room().rig.left.focal_px / rectified().translation_mm[2]
    assert np.mean(later[1] - together[1], axis=0)[0] == pytest.approx(way_px, rel=0.15)


def test_an_even_motion_costs_nothing() -> None:
    assert times().error_mm(rectified()) == pytest.approx(0.0, abs=1e-6)
    assert times().correct(rectified()) is None


def test_a_change_of_speed_costs_depth_by_the_time_between_the_eyes() -> None:
    one = times(VELOCITY - 40.0 * ALONG_X, skew_s=5e-3, row_delay_ns=0)
    baseline_mm = room().rig.baseline_mm
    depth_mm = rectified().apply(room().tracker.centre_mm)[2]
    expected_mm = 40.0 * 5e-3 * depth_mm / baseline_mm
    assert one.error_mm(rectified()) == pytest.approx(expected_mm, rel=1e-6)


def test_the_motion_that_a_pose_shows_goes_on_as_it_changed() -> None:
    one = times(VELOCITY - 40.0 * ALONG_X, skew_s=5e-3, row_delay_ns=0)
    corrected = one.correct(rectified())
    np.testing.assert_allclose(corrected.velocity, VELOCITY + 20.0 * ALONG_X, atol=1e-6)
    before_mm = one.error_mm(rectified())
    assert corrected.error_mm(rectified()) == pytest.approx(0.5 * before_mm)


def moving_room(shutter_ms: float, skew_ms: float):
    """A knee that is carried across the view at 50 mm/s; its tracker, frames and truth."""
    from navapp.config import Configuration
    from navapp.config.camera_sections import CameraSection, SimulationSection
    from navapp.evaluation.sequence import render_room

    settings = SimulationSection(
        seed=11, stepped=True, drift_mm_s=50.0, shutter_ms=shutter_ms, skew_ms=skew_ms
    )
    camera = CameraSection(simulated=settings, rate_hz=30.0)
    return render_room(Configuration(camera=camera), "opening", 12)


@pytest.mark.slow
@pytest.mark.parametrize(("shutter_ms", "skew_ms"), [(15.0, 0.0), (0.0, 3.0)])
def test_a_carried_bone_is_measured_as_if_all_rows_had_been_exposed_at_once(
    shutter_ms: float, skew_ms: float
) -> None:
    known = moving_room(shutter_ms, skew_ms)
    bone = known.plan.bones["femur"]
    points = bone.mesh.vertices_mm[bone.mesh.visible_vertices(known.truth[0])]

    def errors_mm(rig: StereoRig, *, tells_skew: bool) -> list[float]:
        tracker = BimccTracker(rig, bone)
        state, errors = TrackState.at_rest(known.truth[0], known.frames[0].captured_ns), []
        for frame, true in zip(known.frames, known.truth, strict=True):
            tracked, state = tracker.track(
                frame.left, frame.right, frame.captured_ns, state, GOAL,
                frame.skew_ns if tells_skew else 0,
            )  # fmt: skip
            assert tracked.verdict.status is Status.OK
            apart = tracked.left_from_bone.apply(points) - true.apply(points)
            errors.append(float(np.linalg.norm(apart, axis=1).mean()))
        return errors[9:]

    blind = errors_mm(replace(known.rig, row_delay_ns=0), tells_skew=False)
    seeing = errors_mm(known.rig, tells_skew=True)
    assert max(seeing) < 0.15
    assert np.mean(seeing) < 0.6 * np.mean(blind)


def test_a_bone_that_jerks_is_refused_with_the_reason() -> None:
    a = room()
    frame = a.frames[0]
    truth = a.truth(frame)
    start = truth.move([-3.0, 0.0, 0.0, 0.0, 0.0, 0.0], truth.apply(a.tracker.centre_mm))
    state = TrackState.at_rest(start, frame.captured_ns - 20_000_000)
    args = (frame.left, frame.right, frame.captured_ns, state, GOAL)
    assert a.tracker.track(*args)[0].verdict.status is Status.OK
    tracked, _ = a.tracker.track(*args, skew_ns=4_000_000)
    assert Reason.MOVED_UNEVENLY in tracked.verdict.reasons
    assert tracked.verdict.status is Status.DEGRADED
