"""What stands in front of a bone at its pose."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from navapp.geometry.box import Box
from navapp.tracking import TrackState
from navapp.tracking.foreground import IN_FRONT_MM, NEAR_PX, fill_in_time, find_foreground
from navapp.values import DisparityMap, Origin, Status
from tests.registration.shapes import GEOMETRY, TRUE
from tests.tracking.judged import MAP, MODEL
from tests.tracking.rooms import GOAL, room

BOX = MAP.box
VIEW = MODEL.render(TRUE, GEOMETRY, BOX)


def everywhere(depth_mm: np.ndarray, box: Box = BOX) -> DisparityMap:
    disparity_px = GEOMETRY.disparity_map_px(depth_mm)
    origin = np.where(np.isfinite(disparity_px), Origin.MATCHED, Origin.UNKNOWN).astype(np.uint8)
    return DisparityMap(disparity_px, np.full_like(disparity_px, 0.2), origin, box.x, box.y)


def interior(margin_px: int = NEAR_PX + 1) -> np.ndarray:
    size = 2 * margin_px + 1
    return cv2.erode(VIEW.mask.astype(np.uint8), np.ones((size, size), np.uint8)) > 0


def test_the_view_holds_the_bone() -> None:
    assert 0.1 < VIEW.mask.mean() < 0.9


@pytest.mark.parametrize(("nearer_mm", "is_marked"), [(40.0, True), (-20.0, False), (0.0, False)])
def test_what_is_nearer_than_the_bone_is_in_front(nearer_mm: float, is_marked: bool) -> None:
    found = find_foreground(everywhere(VIEW.depth_mm - nearer_mm), VIEW, GEOMETRY)
    assert (found.is_in_front[interior()] == is_marked).all()


def test_as_near_as_the_tolerance_counts_from_the_nearest_bone_around() -> None:
    flat = replace(VIEW, depth_mm=np.where(VIEW.mask, np.float32(450.0), np.float32(np.nan)))
    flat.depth_mm[150, 160] = 440.0  # a crest
    assert flat.depth_mm[140:161, 150:171].min() == 440.0
    for nearer_mm, is_marked in ((IN_FRONT_MM + 0.1, True), (IN_FRONT_MM - 0.1, False)):
        at = np.full(VIEW.depth_mm.shape, 450.0 - nearer_mm, np.float32)
        found = find_foreground(everywhere(at), flat, GEOMETRY).is_in_front
        assert found[100, 160] == is_marked
        # Around the crest the depth of the crest counts.
        beside = 150 + NEAR_PX
        assert not found[beside, 160]
        assert found[beside + 1, 160] == is_marked


def test_unknown_depth_and_what_lies_beside_the_bone_are_not_marked() -> None:
    near = everywhere(np.full(VIEW.depth_mm.shape, 300.0, np.float32))
    found = find_foreground(near, VIEW, GEOMETRY).is_in_front
    assert found[VIEW.mask].all()
    size = 2 * NEAR_PX + 1
    around = cv2.dilate(VIEW.mask.astype(np.uint8), np.ones((size, size), np.uint8)) > 0
    np.testing.assert_array_equal(found, around)
    unknown = near.only(np.zeros(VIEW.mask.shape, dtype=np.bool_))
    assert not find_foreground(unknown, VIEW, GEOMETRY).is_in_front.any()


@pytest.mark.parametrize("box", [BOX.grow(30), BOX.grow(-60)])
def test_surroundings_may_be_larger_or_smaller_than_the_view(box: Box) -> None:
    near = everywhere(np.full((box.height, box.width), 300.0, np.float32), box)
    found = find_foreground(near, VIEW, GEOMETRY)
    assert found.surroundings is near
    expected = find_foreground(near, MODEL.render(TRUE, GEOMETRY, box), GEOMETRY).is_in_front
    inner = np.s_[8:-8, 8:-8]
    np.testing.assert_array_equal(found.is_in_front[inner], expected[inner])


def test_a_frame_tells_what_stands_in_front_and_which_of_it_is_a_guess() -> None:
    a = room()
    frame = a.frames[0]
    state = TrackState.at_rest(a.truth(frame), frame.captured_ns)
    tracked, _ = a.tracker.track(frame.left, frame.right, frame.captured_ns, state, GOAL)
    assert tracked.verdict.status is Status.OK
    foreground = tracked.foreground
    surroundings = foreground.surroundings
    origins = set(np.unique(surroundings.origin))
    assert {Origin.MATCHED, Origin.FILLED_INTERIOR} <= origins
    assert np.array_equal(np.isnan(surroundings.disparity_px), surroundings.origin == 0)
    # The bone's own surface is measured, and not in front of itself.
    pose = a.tracker.rectify_pose(tracked.left_from_bone)
    view = a.tracker.model.render(pose, a.tracker.meter.geometry, surroundings.box)
    deviation_px = surroundings.disparity_px - a.tracker.meter.geometry.disparity_map_px(
        view.depth_mm
    )
    assert abs(np.nanmedian(deviation_px[view.mask])) < 0.1
    assert not foreground.is_in_front[np.abs(deviation_px) < 1.0].any()
    timings = tracked.timings
    assert timings.fill_beside_ms > 0.0
    assert timings.fill_ms == 0.0


def test_without_a_coarse_map_there_is_nothing_to_fill() -> None:
    assert fill_in_time(None)[0] is None
