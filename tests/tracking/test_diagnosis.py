"""What is wrong for good, told by name when the bone is not found."""

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from drivers.frames import StereoFrame
from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.transform import RigidTransform, rotation_from_vector
from navapp.tracking import TrackState
from navapp.tracking.bimcc_tracker import BimccTracker
from navapp.tracking.diagnosis import mirror_measurement, mirror_pose
from navapp.tracking.surface_meter import Measurement
from navapp.values import BoneModel, Prior, Reason, Status, TrackedFrame
from sim_devices.anatomy import KneeSpec, make_knee
from tests.registration.shapes import GEOMETRY, TRUE, femur
from tests.tracking.rooms import GOAL, measured_map, room

MIRROR = np.array([-1.0, 1.0, 1.0])


def mirror_image(bone: BoneModel) -> BoneModel:
    """The other side's bone, in the same place."""
    centre_mm = bone.mesh.centroid_mm
    mirrored = (bone.mesh.vertices_mm - centre_mm) * MIRROR + centre_mm
    return BoneModel("femur", TriangleMesh(mirrored, bone.mesh.faces[:, ::-1]), bone.side)


def other_person() -> BoneModel:
    own = room().tracker.model.bone
    mesh = make_knee(KneeSpec(1005, own.side)).bones["femur"]
    shift = own.mesh.centroid_mm - mesh.centroid_mm
    return BoneModel("femur", TriangleMesh(mesh.vertices_mm + shift, mesh.faces), own.side)


@lru_cache(maxsize=4)
def tracker_of(plan: str) -> BimccTracker:
    a = room()
    own = a.tracker.model.bone
    bones = {"own": own, "other side": mirror_image(own), "other person": other_person()}
    return BimccTracker(a.rig, bones[plan])


def registered(plan: str = "own", *, is_swapped: bool = False, prior: Prior | None = None):
    a = room()
    pictures = swap(a.frames[0]) if is_swapped else a.frames[0]
    return tracker_of(plan).register(pictures, prior or a.prior, GOAL)


def swap(frame: StereoFrame) -> StereoFrame:
    return replace(frame, left=frame.right, right=frame.left)


def tracked(state: TrackState, *, is_swapped: bool) -> tuple[TrackedFrame, TrackState]:
    frame = room().frames[0]
    return room().tracker.track(swap(frame) if is_swapped else frame, state, GOAL)


def test_a_mirrored_camera_sees_the_mirrored_bone() -> None:
    own, pose = femur(), TRUE
    seen = pose.apply(mirror_image(own).mesh.vertices_mm)
    mirrored = mirror_pose(pose, own.mesh.centroid_mm).apply(own.mesh.vertices_mm)
    np.testing.assert_allclose(mirrored, seen * MIRROR, atol=1e-9)


def test_what_the_mirrored_camera_measures_is_the_mirror_image() -> None:
    turned = TRUE.move((15.0, 5.0, 0.0, 0.0, 0.0, 0.0), np.zeros(3))
    found = measured_map(femur(), turned)
    measured = Measurement(found, lambda: found.reproject(GEOMETRY), 0.5, 11.0)
    mirrored = mirror_measurement(measured, GEOMETRY)
    assert mirrored.disparity.disparity_px.shape == found.disparity_px.shape
    given, expected = (
        part.points_mm[np.lexsort(part.points_mm.round(3).T)]
        for part in (measured.cloud, mirrored.cloud)
    )
    assert len(given) == len(expected)
    half_a_pixel_mm = 0.5 * given[:, 2].max() / GEOMETRY.focal_px
    np.testing.assert_allclose(
        (given * MIRROR).mean(axis=0), expected.mean(axis=0), atol=half_a_pixel_mm
    )
    twice = mirror_measurement(mirrored, GEOMETRY)
    np.testing.assert_array_equal(twice.cloud.points_mm, measured.cloud.points_mm)


@pytest.mark.release
def test_swapped_pictures_are_called_so_at_the_first_registration() -> None:
    found = registered(is_swapped=True)
    assert all(one.verdict.status is not Status.OK for one in found)
    assert all(one.verdict.reasons[0] is Reason.PICTURES_SWAPPED for one in found)
    assert registered()[0].verdict.cause is None


def test_swapped_pictures_are_called_so_without_a_pose_to_start_from() -> None:
    found = registered(is_swapped=True, prior=Prior(box=(500, 200, 300, 300)))
    assert found[0].verdict.reasons[0] is Reason.PICTURES_SWAPPED


def test_a_lost_frame_says_that_the_pictures_are_swapped_until_they_are_not() -> None:
    a = room()
    state = TrackState.at_rest(a.truth(a.frames[0]), 0)
    for _ in range(2):
        found, state = tracked(state, is_swapped=True)
        assert found.verdict.status is Status.LOST
        assert found.verdict.reasons[0] is Reason.PICTURES_SWAPPED
    found, state = tracked(state, is_swapped=False)
    assert found.verdict.status is Status.OK
    assert state.cause is None


def test_lights_out_is_not_called_swapped() -> None:
    a = room()
    frame = a.frames[0]
    dark = replace(frame, right=np.zeros_like(frame.left))
    state = TrackState.at_rest(a.truth(frame), 0)
    found, _ = a.tracker.track(dark, state, GOAL)
    assert found.verdict.status is Status.LOST
    assert found.verdict.cause is None


@pytest.mark.release
@pytest.mark.slow
def test_the_other_knees_plan_is_called_so_and_stays_so() -> None:
    found = registered("other side")
    assert found
    assert all(one.verdict.status is not Status.OK for one in found)
    assert all(one.verdict.reasons[0] is Reason.OTHER_SIDE for one in found)
    frame = room().frames[0]
    state = TrackState.at_rest(room().truth(frame), 0, found[0].verdict.cause)
    after, state = tracker_of("other side").track(frame, state, GOAL)
    assert after.verdict.status is not Status.OK
    assert after.verdict.reasons[0] is state.cause is Reason.OTHER_SIDE


@pytest.mark.slow
@pytest.mark.release
def test_another_persons_bone_of_the_same_side_is_not_called_the_other_side() -> None:
    found = registered("other person")
    assert all(one.verdict.status is not Status.OK for one in found)
    assert found[0].verdict.reasons[0] is Reason.SURFACE_MISFIT
    assert all(one.verdict.cause is None for one in found)


def test_a_pose_is_mirrored_for_bones_that_lie_off_their_origin() -> None:
    pose = RigidTransform.from_parts(
        "left_rect", "femur", rotation_from_vector((0.3, -0.2, 0.5)), (5.0, -8.0, 420.0)
    )
    centre_mm = np.array([40.0, -3.0, 12.0])
    once = mirror_pose(pose, centre_mm)
    np.testing.assert_allclose(once.apply(centre_mm), pose.apply(centre_mm) * MIRROR, atol=1e-9)
    np.testing.assert_allclose(mirror_pose(once, centre_mm).matrix, pose.matrix, atol=1e-9)
