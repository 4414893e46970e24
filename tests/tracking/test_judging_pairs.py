"""What the pictures themselves say against any pose: cameras that moved, no light, a cover."""

from dataclasses import replace

import numpy as np
import pytest

from navapp.geometry.rig import StereoRig
from navapp.geometry.transform import RigidTransform, rotation_from_vector
from navapp.registration import solution_at
from navapp.stereo.health import PictureHealth, StereoHealth
from navapp.tracking import Goal, TrackState
from navapp.tracking.bimcc_tracker import BimccTracker
from navapp.tracking.frame import FREE_SETTINGS
from navapp.values import Reason, RowCheck, Status
from tests.many import few_of
from tests.registration.shapes import GEOMETRY, TRUE
from tests.tracking.judged import GOOD_PICTURE as GOOD
from tests.tracking.judged import MAP, MODEL, NO_TARGETS, judged, scene_of
from tests.tracking.rooms import GOAL, room

DEPTH_MM = float(TRUE.apply(MODEL.centre_mm)[2])
# Half a millimetre of depth.
LIMIT_PX = 0.5 * GEOMETRY.focal_px * GEOMETRY.baseline_mm / DEPTH_MM**2


def judged_right(health: StereoHealth, tolerance_mm: float = 9.0):
    """Of a right pose, in a pair of that health."""
    estimate = solution_at(scene_of(MAP), MODEL, TRUE, FREE_SETTINGS).estimate
    return judged(estimate, goal=Goal(NO_TARGETS, tolerance_mm), health=health)


def doubts(health: StereoHealth) -> tuple[Reason, ...]:
    return judged_right(health).verdict.reasons


def test_rows_widen_the_bound_and_that_is_told_beside_other_reasons() -> None:
    off = StereoHealth(GOOD, GOOD, 3.0 * LIMIT_PX, 0.01, 100)
    wide, narrow = judged_right(off).verdict, judged_right(off, tolerance_mm=1.4).verdict
    right_mm = judged_right(StereoHealth(GOOD, GOOD)).verdict.predicted_tre_mm
    assert wide.predicted_tre_mm == pytest.approx(np.hypot(right_mm, 1.5))
    assert wide.reasons == (Reason.ROWS_DISAGREE,)
    assert narrow.reasons == (Reason.ROWS_DISAGREE, Reason.TRE_TOO_LARGE)
    assert narrow.status is Status.DEGRADED


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_rows_that_cost_half_a_millimetre_are_doubted(sign: float) -> None:
    assert doubts(StereoHealth(GOOD, GOOD, sign * 0.95 * LIMIT_PX, 0.01, 100)) == ()
    found = doubts(StereoHealth(GOOD, GOOD, sign * 1.05 * LIMIT_PX, 0.01, 100))
    assert found == (Reason.ROWS_DISAGREE,)


def test_rows_are_doubted_only_beyond_their_own_noise() -> None:
    assert doubts(StereoHealth(GOOD, GOOD, 2.0 * LIMIT_PX, LIMIT_PX, 12)) == ()
    assert doubts(StereoHealth(GOOD, GOOD, 3.2 * LIMIT_PX, LIMIT_PX, 12)) == (Reason.ROWS_DISAGREE,)
    assert doubts(StereoHealth(GOOD, GOOD)) == ()
    lost = StereoHealth(GOOD, GOOD, n_points=90, correlation=0.1)
    assert doubts(lost) == (Reason.ROWS_DISAGREE,)


@pytest.mark.parametrize(
    ("bad", "reason"),
    [
        (PictureHealth(0.8, 0.0, 0.2), Reason.PICTURE_DARK),
        (PictureHealth(0.0, 0.8, 0.01), Reason.PICTURE_OVEREXPOSED),
        (PictureHealth(0.0, 0.0, 0.07), Reason.PICTURES_UNLIKE),
        (PictureHealth(0.0, 0.0, 0.15, 3.0), Reason.PICTURES_DEFOCUSED),
        (PictureHealth(0.6, 0.3, 0.14), None),
        (PictureHealth(0.0, 0.0, 0.15, 2.8), None),
    ],
)
def test_an_unusable_picture_is_named(bad: PictureHealth, reason: Reason | None) -> None:
    expected = () if reason is None else (reason,)
    assert doubts(StereoHealth(bad, GOOD)) == expected
    assert doubts(StereoHealth(GOOD, bad)) == expected


def test_usable_pairs_say_how_their_rows_stand() -> None:
    off = judged_right(StereoHealth(GOOD, GOOD, -1.05 * LIMIT_PX, 0.01, 100)).rows
    assert off == RowCheck(-1.05 * LIMIT_PX, True)
    within = judged_right(StereoHealth(GOOD, GOOD, 0.95 * LIMIT_PX, 0.01, 100)).rows
    assert within == RowCheck(0.95 * LIMIT_PX, False)


@pytest.mark.parametrize(
    "health",
    [
        StereoHealth(GOOD, GOOD),
        StereoHealth(GOOD, GOOD, n_points=90, correlation=0.1),
        StereoHealth(PictureHealth(0.8, 0.0, 0.2), GOOD, 3.0 * LIMIT_PX, 0.01, 100),
        StereoHealth(GOOD, PictureHealth(0.0, 0.0, 0.07), 3.0 * LIMIT_PX, 0.01, 100),
        StereoHealth(GOOD, PictureHealth(0.0, 0.0, 0.15, 3.0), 3.0 * LIMIT_PX, 0.01, 100),
    ],
    ids=["few points", "lost rows", "dark", "unlike", "blurred"],
)
def test_poor_pairs_say_nothing_of_the_rig(health: StereoHealth) -> None:
    assert judged_right(health).rows is None


def tracked(tracker: BimccTracker, *, dark: str = "") -> tuple[Status, tuple[Reason, ...]]:
    a = room()
    frame = a.frames[0]
    if dark:
        frame = replace(frame, **{dark: np.zeros_like(frame.left)})
    state = TrackState.at_rest(a.truth(frame), frame.captured_ns)
    state = replace(state, n_doubted=1)  # a search is due
    verdict = tracker.track(frame, state, GOAL)[0].verdict
    return verdict.status, verdict.reasons


def turned(rig: StereoRig, row_offset_px: float) -> StereoRig:
    """A calibration that is off by a turn of the right camera about the line between both."""
    turn = rotation_from_vector((row_offset_px / rig.right.focal_px, 0.0, 0.0))
    right_from_left = rig.right_from_left
    moved = RigidTransform.from_parts(
        "right", "left", turn @ right_from_left.rotation, turn @ right_from_left.translation_mm
    )
    return replace(rig, right_from_left=moved)


@pytest.mark.parametrize("row_offset_px", few_of([0.5, -1.0]))
def test_a_rig_that_moved_is_never_ok(row_offset_px: float) -> None:
    a = room()
    assert tracked(a.tracker) == (Status.OK, ())
    status, reasons = tracked(BimccTracker(turned(a.rig, row_offset_px), a.tracker.model.bone))
    assert status is not Status.OK
    assert reasons[0] is Reason.ROWS_DISAGREE


@pytest.mark.parametrize("back_mm", few_of([4.0, -4.0]))
def test_a_camera_that_stands_further_back_is_never_ok(back_mm: float) -> None:
    """What it shows is smaller. Lowered as well, so that the rows agree in the bone's middle."""
    a = room()
    old = a.rig.right_from_left
    centre_mm = old.apply(a.truth(a.frames[0]).apply(a.tracker.model.centre_mm))
    back = np.array([0.0, -centre_mm[1] / centre_mm[2], -1.0])
    moved = RigidTransform.from_parts(
        "right", "left", old.rotation, old.translation_mm + back_mm * back
    )
    status, reasons = tracked(
        BimccTracker(replace(a.rig, right_from_left=moved), a.tracker.model.bone)
    )
    assert status is not Status.OK
    assert reasons[0] is Reason.ROWS_DISAGREE


class Asked:
    """Stands for the search for a buried bone: counts how often it is asked, and finds none."""

    def __init__(self) -> None:
        self.n_searches = 0

    def find(self, frame):
        self.n_searches += 1
        return iter(())


def test_a_doubt_is_searched_for_only_while_the_rows_agree() -> None:
    a = room()
    bone = a.tracker.model.bone
    larger = replace(bone, mesh=replace(bone.mesh, vertices_mm=1.05 * bone.mesh.vertices_mm))
    for rig, one, n_searches in ((a.rig, larger, 1), (turned(a.rig, -1.0), bone, 0)):
        asked = Asked()
        tracker = BimccTracker(rig, one)
        tracker.buried = asked
        status, reasons = tracked(tracker)
        assert status is Status.DEGRADED
        assert Reason.SURFACE_MISFIT in reasons
        assert asked.n_searches == n_searches


@pytest.mark.parametrize("eye", ["left", "right"])
def test_a_dark_picture_is_the_first_reason(eye: str) -> None:
    status, reasons = tracked(room().tracker, dark=eye)
    assert status is Status.LOST
    assert reasons[0] is Reason.PICTURE_DARK


@pytest.mark.slow
def test_rows_that_surely_disagree_widen_the_predicted_error() -> None:
    """Too little for a doubt, but it may cost that much."""
    a, offset_px = room(), 0.2
    frame = a.frames[0]
    state = TrackState.at_rest(a.truth(frame), frame.captured_ns)
    rigs = (a.rig, turned(a.rig, offset_px))
    trackers = [BimccTracker(rig, a.tracker.model.bone) for rig in rigs]
    right, turned_by = (one.track(frame, state, GOAL)[0].verdict for one in trackers)
    geometry = a.tracker.meter.geometry
    depth_mm = float((a.truth(frame).apply(a.tracker.model.centre_mm))[2])
    cost_mm = offset_px * depth_mm**2 / (geometry.focal_px * geometry.baseline_mm)
    expected_mm = float(np.hypot(right.predicted_tre_mm, cost_mm))
    # The rows' residuals, which go together, cost something too.
    assert 0.8 * expected_mm < turned_by.predicted_tre_mm < 1.4 * expected_mm
    assert turned_by.predicted_tre_mm > 1.2 * right.predicted_tre_mm
