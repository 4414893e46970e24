"""What stands in front of a bone at its pose."""

from dataclasses import replace
from functools import lru_cache

import cv2
import numpy as np
import pytest

from navapp.geometry.box import Box
from navapp.geometry.halves import double, half_box
from navapp.geometry.zbuffer import RenderedView
from navapp.tracking import TrackerSettings, TrackState, make_tracker
from navapp.tracking.foreground import IN_FRONT_MM, NEAR_PX, find_foreground
from navapp.values import DisparityMap, Foreground, Origin, Status, Surroundings, TrackedFrame
from sim_devices.scenario import Scenario
from sim_devices.sensor import SensorModel
from tests.knees import SimulatedKnee, stepped_camera
from tests.registration.shapes import GEOMETRY, TRUE
from tests.tracking.judged import MAP, MODEL
from tests.tracking.rooms import GOAL, room

BOX = MAP.box
VIEW = MODEL.render(TRUE, GEOMETRY, BOX)


NOTHING = DisparityMap(*(np.empty((0, 0), np.float32),) * 2, np.empty((0, 0), np.uint8), 0, 0)


def everywhere(depth_mm: np.ndarray, box: Box = BOX) -> Surroundings:
    disparity_px = GEOMETRY.disparity_map_px(depth_mm)
    origin = np.where(np.isfinite(disparity_px), Origin.FILLED_BORDER, Origin.UNKNOWN)
    return surroundings_of(disparity_px, origin.astype(np.uint8), box, is_half=False)


def surroundings_of(
    disparity_px: np.ndarray, origin: np.ndarray, box: Box, *, is_half: bool
) -> Surroundings:
    """Before a picture that looks the same everywhere."""
    return Surroundings(disparity_px, origin, box, is_half, np.full(origin.shape, 90, np.uint8))


def find(surroundings: Surroundings, view: RenderedView = VIEW) -> Foreground:
    return find_foreground(surroundings, NOTHING, view, GEOMETRY)


def interior(margin_px: int = NEAR_PX + 1) -> np.ndarray:
    size = 2 * margin_px + 1
    return cv2.erode(VIEW.mask.astype(np.uint8), np.ones((size, size), np.uint8)) > 0


def test_the_view_holds_the_bone() -> None:
    assert 0.1 < VIEW.mask.mean() < 0.9


@pytest.mark.parametrize(("nearer_mm", "is_marked"), [(40.0, True), (-20.0, False), (0.0, False)])
def test_what_is_nearer_than_the_bone_is_in_front(nearer_mm: float, is_marked: bool) -> None:
    found = find(everywhere(VIEW.depth_mm - nearer_mm))
    assert (found.is_in_front[interior()] == is_marked).all()


def test_as_near_as_the_tolerance_counts_from_the_nearest_bone_around() -> None:
    flat = replace(VIEW, depth_mm=np.where(VIEW.mask, np.float32(450.0), np.float32(np.nan)))
    flat.depth_mm[150, 160] = 440.0  # a crest
    assert flat.depth_mm[140:161, 150:171].min() == 440.0
    for nearer_mm, is_marked in ((IN_FRONT_MM + 0.1, True), (IN_FRONT_MM - 0.1, False)):
        at = np.full(VIEW.depth_mm.shape, 450.0 - nearer_mm, np.float32)
        found = find(everywhere(at), flat).is_in_front
        assert found[100, 160] == is_marked
        # Around the crest the depth of the crest counts.
        beside = 150 + NEAR_PX
        assert not found[beside, 160]
        assert found[beside + 1, 160] == is_marked


def test_unknown_depth_and_what_lies_beside_the_bone_are_not_marked() -> None:
    near = everywhere(np.full(VIEW.depth_mm.shape, 300.0, np.float32))
    found = find(near).is_in_front
    assert found[VIEW.mask].all()
    size = 2 * NEAR_PX + 1
    around = cv2.dilate(VIEW.mask.astype(np.uint8), np.ones((size, size), np.uint8)) > 0
    np.testing.assert_array_equal(found, around)
    unknown = everywhere(np.full(VIEW.depth_mm.shape, np.nan, np.float32))
    assert not find(unknown).is_in_front.any()


@pytest.mark.parametrize("box", [BOX.grow(30), BOX.grow(-60)])
def test_surroundings_may_be_larger_or_smaller_than_the_view(box: Box) -> None:
    near = everywhere(np.full((box.height, box.width), 300.0, np.float32), box)
    found = find(near)
    assert found.box == box
    np.testing.assert_array_equal(found.depth[0], near.disparity_px)
    expected = find(near, MODEL.render(TRUE, GEOMETRY, box)).is_in_front
    inner = np.s_[8:-8, 8:-8]
    np.testing.assert_array_equal(found.is_in_front[inner], expected[inner])


@pytest.mark.parametrize("x", [-2, 0, 3, 40])
def test_what_was_measured_replaces_the_surroundings(x: int) -> None:
    """From column x of the box on, in every second row."""
    depth_mm = np.full(VIEW.depth_mm.shape, 300.0, np.float32)
    origin = np.zeros((6, 5), np.uint8)
    origin[::2] = Origin.MATCHED
    measured = DisparityMap(*(np.full((6, 5), 9.0, np.float32),) * 2, origin, BOX.x + x, BOX.y)
    found = find_foreground(everywhere(depth_mm), measured, VIEW, GEOMETRY)
    expected = np.full(depth_mm.shape, GEOMETRY.disparity_px(300.0), np.float32)
    expected[0:6:2, max(x, 0) : x + 5] = 9.0
    disparity_px, origin = found.depth
    np.testing.assert_array_equal(disparity_px, expected)
    np.testing.assert_array_equal(origin == Origin.MATCHED, expected == 9.0)
    assert not found.is_in_front[expected == 9.0].any()


@pytest.mark.parametrize("box", [BOX, Box(BOX.x + 1, BOX.y + 1, BOX.width - 2, BOX.height - 3)])
def test_half_the_resolution_is_doubled(box: Box) -> None:
    half = half_box(box)
    disparity_px = np.arange(half.width * half.height, dtype=np.float32)
    disparity_px = disparity_px.reshape(half.height, half.width)
    origin = (disparity_px % 5).astype(np.uint8)
    found = find(surroundings_of(disparity_px, origin, box, is_half=True))
    rows, columns = np.mgrid[: box.height, : box.width]
    there = (rows + box.y) // 2 - half.y, (columns + box.x) // 2 - half.x
    np.testing.assert_array_equal(found.depth[0], 2.0 * disparity_px[there])
    np.testing.assert_array_equal(found.depth[1], origin[there])


@pytest.mark.parametrize("shift", [0, 1])
def test_in_half_the_resolution_the_same_stands_in_front(shift: int) -> None:
    """But for a rim of the places that half a resolution leaves open."""
    box = Box(BOX.x + shift, BOX.y + shift, BOX.width - 3, BOX.height - 3)
    half = half_box(box)
    view = MODEL.render(TRUE, GEOMETRY, Box(box.x + 1, box.y, box.width - 2, box.height))
    rows, columns = np.mgrid[: half.height, : half.width]
    slant_mm = 380.0 + 0.5 * (columns + rows)
    near_px = GEOMETRY.disparity_map_px(slant_mm) / np.float32(2.0)
    origin = np.full(near_px.shape, Origin.FILLED_INTERIOR, np.uint8)
    found = find(surroundings_of(near_px, origin, box, is_half=True), view)
    exact = find(everywhere(*whole_of(slant_mm, box)), view).is_in_front
    assert 0.1 < exact.mean() < 0.9
    size = np.ones((7, 7), np.uint8)
    is_sure = cv2.erode(exact.astype(np.uint8), size) > 0
    is_never = cv2.dilate(exact.astype(np.uint8), size) == 0
    inner = np.s_[4:-4, 4:-4]
    assert found.is_in_front[inner][is_sure[inner]].all()
    assert not found.is_in_front[inner][is_never[inner]].any()


def whole_of(half_mm: np.ndarray, box: Box) -> tuple[np.ndarray, Box]:
    return double(half_mm.astype(np.float32), box), box


@pytest.mark.parametrize("is_half", [False, True])
def test_guesses_beside_a_matched_hand_that_look_like_it_are_marked(is_half: bool) -> None:
    """Filled from behind, a hand's rim has the bone's depth; its grey level tells it from bone."""
    box = Box(*(2 * (n // 2) for n in (BOX.x, BOX.y, BOX.width, BOX.height)))
    view, step = MODEL.render(TRUE, GEOMETRY, box), 2 if is_half else 1
    u = np.arange(box.width)
    hand_from, guess_from = box.width // 2, box.width // 2 - 12
    depth_mm = np.where(u >= hand_from, view.depth_mm - 60.0, view.depth_mm)[::step, ::step]
    disparity_px = GEOMETRY.disparity_map_px(depth_mm.astype(np.float32)) / np.float32(step)
    is_guess = ((u >= guess_from) & (u < hand_from))[::step]
    origin = np.where(is_guess, Origin.FILLED_BORDER, Origin.MATCHED).astype(np.uint8)
    origin = np.where(np.isfinite(disparity_px), origin, np.uint8(Origin.UNKNOWN))
    rim = view.mask & (u >= guess_from + 2) & (u < hand_from - NEAR_PX - 2)
    assert rim.sum() > 200
    for light_from, share in ((guess_from, 1.0), (hand_from, 0.0)):
        grey = np.broadcast_to(np.where(u >= light_from, 200, 90), view.mask.shape)
        picture = grey[::step, ::step].astype(np.uint8)
        found = find(Surroundings(disparity_px, origin, box, is_half, picture), view)
        assert abs(found.is_in_front[rim].mean() - share) < 0.05


@lru_cache
def swept() -> list[tuple[TrackedFrame, np.ndarray, np.ndarray]]:
    """Frames in which an instrument is over the bone; what of the box shows hand, and bone."""
    knee = SimulatedKnee(Scenario(seed=301, side="left", motion="breathing", instrument="sweep"))
    camera = stepped_camera(knee.world, SensorModel(seed=301), rate_hz=0.5)
    camera.read(1.0)
    tracker = make_tracker(knee.rig, knee.bone)
    frames = [camera.read(1.0) for _ in range(5)]
    # In the third the instrument is beside the bone.
    return [sweep(knee, camera, tracker, frames[k]) for k in (0, 1, 3, 4)]


def sweep(knee, camera, tracker, frame) -> tuple[TrackedFrame, np.ndarray, np.ndarray]:
    time_ns = camera.world_time_ns(frame.captured_ns)
    state = TrackState.at_rest(knee.world.left_from_body("femur", time_ns), frame.captured_ns)
    tracked, _ = tracker.track(frame, state, GOAL)
    box = tracked.foreground.box
    seen = knee.world.depth("left", time_ns)
    columns, rows = (one[box.slices] for one in tracker.meter.rectifier.maps[:2])
    pose = tracker.rectify_pose(tracked.left_from_bone)
    silhouette = tracker.model.render(pose, tracker.meter.geometry, box).mask
    masks = [(seen.body == seen.bodies.index(name)).astype(np.uint8) for name in ("hand", "femur")]
    masks[0] = cv2.erode(masks[0], np.ones((7, 7), np.uint8))
    hand, bone = (cv2.remap(mask, columns, rows, cv2.INTER_NEAREST) > 0 for mask in masks)
    return tracked, hand & silhouette, bone & silhouette


def test_a_frame_tells_that_an_instrument_stands_in_front() -> None:
    shares = []
    for tracked, hand, bone in swept():
        assert tracked.verdict.status is Status.OK
        assert np.count_nonzero(hand) > 500
        assert tracked.foreground.is_in_front[hand].mean() > 0.9
        shares.append(tracked.foreground.is_in_front[bone].mean())
    # Dark bone between hand and instrument, where little is matched, goes with them.
    assert np.mean(shares) < 0.045


@pytest.mark.release
def test_guesses_are_told_from_matches_and_the_fill_is_timed() -> None:
    tracked, _, bone = swept()[0]
    disparity_px, origin = tracked.foreground.depth
    assert {Origin.MATCHED, Origin.FILLED_INTERIOR} <= set(np.unique(origin))
    assert np.array_equal(np.isnan(disparity_px), origin == 0)
    assert (origin[bone] == Origin.MATCHED).mean() > 0.8
    assert tracked.timings.fill_ms > 0.0


def test_only_the_tracker_that_guides_tells_it() -> None:
    a = room()
    frame = a.frames[0]
    state = TrackState.at_rest(a.truth(frame), frame.captured_ns)
    for method in ("bimcc", "icp"):
        settings = TrackerSettings(method, follows_refused=True)
        tracker = make_tracker(a.rig, a.tracker.model.bone, settings)
        tracked, _ = tracker.track(frame, state, GOAL)
        assert (tracked.foreground is None) is (method == "icp")
    assert a.tracker.assess(frame, a.truth(frame), GOAL).foreground is None
