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
from navapp.tracking.surface_meter import Margins, SurfaceMeter
from navapp.values import DisparityMap, Origin, Reason, Status
from tests.pictures import Pictures
from tests.tracking.rooms import GOAL, room

ROW_DELAY_NS = 20_862  # 15 ms over 720 rows
VELOCITY = np.array([100.0, -20.0, 10.0, 0.0, 0.0, 0.0])
ALONG_X = np.eye(6)[0]


@lru_cache(maxsize=4)
def meter(row_delay_ns: int = ROW_DELAY_NS) -> SurfaceMeter:
    a = room()
    rig: StereoRig = replace(a.rig, row_delay_ns=row_delay_ns)
    return SurfaceMeter(rig, RegistrationModel(a.tracker.model.bone), (300.0, 700.0))


def rectified():
    a = room()
    return a.tracker.rectify_pose(a.truth(a.frames[0]))


def depth_mm() -> float:
    return float(rectified().apply(room().tracker.model.centre_mm)[2])


def times(velocity=VELOCITY, skew_s: float = 0.0, row_delay_ns: int = ROW_DELAY_NS) -> RowTimes:
    """Of a bone that has moved evenly by `VELOCITY` since the frame before."""
    pose = rectified()
    last = pose.move(-0.05 * VELOCITY, pose.apply(room().tracker.model.centre_mm))
    known = None if velocity is None else np.asarray(velocity)
    return RowTimes(meter(row_delay_ns), known, np.zeros(6), last, 0.05, skew_s)


def taken(captured_ns: int, skew_ns: int = 0) -> Pictures:
    return Pictures(None, None, captured_ns, skew_ns)


def test_without_row_delay_and_skew_nothing_is_corrected() -> None:
    state = TrackState.at_rest(room().truth(room().frames[0]), 0)
    assert RowTimes.of_pair(meter(0), state, taken(66_000_000)) is None
    assert RowTimes.of_pair(meter(0), state, taken(66_000_000, 1)) is not None
    assert RowTimes.of_pair(meter(), state, taken(66_000_000)) is not None


def test_a_bone_of_unknown_velocity_is_looked_up_where_it_is() -> None:
    assert times(None).find_shifts(rectified()) is None


def test_rows_are_looked_up_where_the_bone_was_when_they_were_exposed() -> None:
    """The shift of a row is the way in the picture until it was exposed."""
    left_px, right_px = times().find_shifts(rectified())
    per_row_px = VELOCITY[0] * room().rig.left.focal_px / depth_mm() * ROW_DELAY_NS * 1e-9
    for one in (left_px, right_px):
        steps_px = np.diff(one[:, 0])
        np.testing.assert_allclose(steps_px, steps_px[0])
        assert steps_px[0] == pytest.approx(per_row_px, rel=0.15)
    # Across the bone's box the left rows are moved to both sides alike.
    box = meter().find_region(rectified(), Margins(0, 0.0))[0]
    rows = [box.y - 0.5, box.y + box.height - 0.5]
    assert np.interp(rows, np.arange(720), left_px[:, 0]).sum() == pytest.approx(0.0, abs=0.01)


def test_in_a_right_picture_that_is_taken_later_the_bone_is_looked_up_further_on() -> None:
    together = times().find_shifts(rectified())
    later = times(skew_s=2e-3).find_shifts(rectified())
    np.testing.assert_array_equal(together[0], later[0])
    moved_px = VELOCITY[0] * 2e-3 * room().rig.left.focal_px / depth_mm()
    assert np.mean(later[1] - together[1], axis=0)[0] == pytest.approx(moved_px, rel=0.15)


def test_an_even_motion_costs_what_a_shift_by_rows_leaves_of_it() -> None:
    """Bone nearer than the middle moves further in the picture than its row is shifted."""
    assert times().with_motion_to(rectified()) is None
    assert times().error_mm(rectified()) < 0.05
    # The relief of a knee is a twentieth of its distance.
    uncorrected_mm = VELOCITY[0] * 5e-3 * depth_mm() / room().rig.baseline_mm
    assert 0.0 < times(skew_s=5e-3).error_mm(rectified()) < 0.1 * uncorrected_mm


def test_a_change_of_speed_costs_depth_in_proportion_to_the_skew() -> None:
    one = times(VELOCITY - 40.0 * ALONG_X, skew_s=5e-3, row_delay_ns=0)
    expected_mm = 40.0 * 5e-3 * depth_mm() / room().rig.baseline_mm
    assert one.error_mm(rectified()) == pytest.approx(expected_mm, rel=0.15)


def test_a_turn_costs_as_well() -> None:
    pose = rectified()
    turn = np.array([0.0, 0.0, 0.0, 0.0, 0.5, 0.0])
    last = pose.move(-0.05 * turn, pose.apply(room().tracker.model.centre_mm))
    one = RowTimes(meter(0), np.zeros(6), np.zeros(6), last, 0.05, 5e-3)
    assert one.error_mm(pose) > 0.2
    assert one.with_motion_to(pose) is not None


def test_the_motion_that_a_pose_shows_goes_on_as_it_changed_and_all_of_that_is_unsure() -> None:
    one = times(VELOCITY - 40.0 * ALONG_X, skew_s=5e-3, row_delay_ns=0)
    closer = one.with_motion_to(rectified())
    np.testing.assert_allclose(closer.velocity, VELOCITY + 20.0 * ALONG_X, atol=1e-6)
    assert closer.error_mm(rectified()) == pytest.approx(one.error_mm(rectified()), rel=0.1)


def test_a_first_velocity_is_taken_as_it_is() -> None:
    one = times(None, skew_s=5e-3, row_delay_ns=0)
    np.testing.assert_allclose(one.with_motion_to(rectified()).velocity, VELOCITY, atol=1e-6)
    assert one.with_motion_to(rectified()).error_mm(rectified()) > 2.0


@pytest.mark.parametrize("elapsed_ns", [0, 500_000_000])
def test_after_a_gap_nothing_is_known(elapsed_ns: int) -> None:
    state = replace(TrackState.at_rest(room().truth(room().frames[0]), 0), velocity=VELOCITY)
    one = RowTimes.of_pair(meter(), state, taken(elapsed_ns))
    assert one.velocity is None
    assert one.with_motion_to(rectified()) is None
    # 200 mm/s; both cameras see a point within 0.2 ms, and the bone's rows last 7 ms.
    assert 0.15 < one.error_mm(rectified()) < 1.0


def test_after_a_loss_nothing_is_known() -> None:
    state = replace(TrackState.at_rest(room().truth(room().frames[0]), 0), n_lost=1)
    times_of_pair = RowTimes.of_pair(meter(), state, taken(66_000_000, 5_000_000))
    assert times_of_pair.error_mm(rectified()) > 4.0


def matched_rows(first: float, last: float) -> DisparityMap:
    """Of the bone's box only rows between these shares of its height are matched."""
    box = meter().find_region(rectified(), Margins(0, 0.0))[0]
    origin = np.full((box.height, box.width), Origin.UNKNOWN, np.uint8)
    origin[round(first * box.height) : round(last * box.height)] = Origin.MATCHED
    nothing = np.full(origin.shape, np.nan, np.float32)
    return DisparityMap(nothing, nothing, origin, box.x, box.y)


def test_the_pose_is_that_at_the_middle_of_the_rows_that_were_matched() -> None:
    box = meter().find_region(rectified(), Margins(0, 0.0))[0]
    quarter_s = 0.25 * box.height * ROW_DELAY_NS * 1e-9

    def moved_mm(one: RowTimes, first: float, last: float) -> np.ndarray:
        pose = one.move_to_seen(rectified(), matched_rows(first, last))
        return pose.apply(room().tracker.model.centre_mm) - rectified().apply(
            room().tracker.model.centre_mm
        )

    assert moved_mm(times(), 0.5, 1.0) == pytest.approx(VELOCITY[:3] * quarter_s, rel=0.05)
    assert moved_mm(times(), 0.0, 0.5) == pytest.approx(-VELOCITY[:3] * quarter_s, rel=0.05)
    assert np.abs(moved_mm(times(), 0.0, 1.0)).max() < 0.05 * VELOCITY[0] * quarter_s
    assert not moved_mm(times(), 0.0, 0.0).any(), "nothing is matched"
    assert not moved_mm(times(None), 0.5, 1.0).any(), "the velocity is not known"


def moving_room(shutter_ms: float, skew_ms: float):
    """A knee that is carried across the view at 50 mm/s; its tracker, frames and truth."""
    from navapp.config import Configuration
    from navapp.config.camera_sections import CameraSection, SimulationSection
    from navapp.evaluation.sequence import render_room

    settings = SimulationSection(
        seed=11, stepped=True, drift_mm_s=50.0, shutter_ms=shutter_ms, skew_ms=skew_ms
    )
    camera = CameraSection(simulated=settings, rate_hz=30.0)
    return render_room(Configuration(camera=camera), "opening", 17)


@pytest.mark.release
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
            told = frame if tells_skew else replace(frame, skew_ns=0)
            tracked, state = tracker.track(told, state, GOAL)
            apart = tracked.left_from_bone.apply(points) - true.apply(points)
            errors.append(float(np.linalg.norm(apart, axis=1).mean()))
        return errors[11:]

    blind = errors_mm(replace(known.rig, row_delay_ns=0), tells_skew=False)
    seeing = errors_mm(known.rig, tells_skew=True)
    assert max(seeing) < 0.15
    assert np.mean(seeing) < 0.6 * np.mean(blind)


def test_a_bone_whose_motion_is_not_known_is_refused_until_the_next_frame() -> None:
    a = room()
    frame = replace(a.frames[0], skew_ns=4_000_000)
    later = replace(frame, captured_ns=frame.captured_ns + 66_000_000)
    state = TrackState.at_rest(a.truth(frame), frame.captured_ns - 1_000_000_000)
    tracked, state = a.tracker.track(frame, state, GOAL)
    assert tracked.verdict.reasons[0] is Reason.MOTION_UNKNOWN
    assert tracked.verdict.status is Status.DEGRADED
    tracked, _ = a.tracker.track(later, state, GOAL)
    assert tracked.verdict.status is Status.OK


@pytest.mark.release
@pytest.mark.slow
def test_a_bone_that_is_carried_by_another_one_is_glanced_at_with_its_motion() -> None:
    """As a second bone is, in every fourth frame."""
    known = moving_room(0.0, 4.0)
    bone = known.plan.bones["femur"]
    tracker = BimccTracker(known.rig, bone)
    before, now = known.frames[12], known.frames[16]
    state = TrackState.at_rest(known.truth[12], before.captured_ns)
    state = state.carry(known.truth[16] @ known.truth[12].inverse())
    tracked, after = tracker.glance(now, state, GOAL)
    points = bone.mesh.vertices_mm[bone.mesh.visible_vertices(known.truth[16])]
    apart = tracked.left_from_bone.apply(points) - known.truth[16].apply(points)
    assert np.linalg.norm(apart, axis=1).mean() < 0.2
    assert np.linalg.norm(after.velocity[:3]) > 20.0
