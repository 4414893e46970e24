"""The first registration, through the tracker."""

from functools import lru_cache

import numpy as np
import pytest

from navapp.geometry.directions import ViewCone
from navapp.preop import build_aspects
from navapp.tracking.bimcc_tracker import BimccTracker
from navapp.tracking.scoring import FitScorer
from navapp.values import Prior, Status
from tests.many import few_of
from tests.tracking.rooms import GOAL, Room, cone, room


@lru_cache(maxsize=1)
def tracker_with_aspects() -> BimccTracker:
    a = room()
    bone = a.tracker.model.bone
    axis, half_angle_deg = cone()
    return BimccTracker(a.rig, bone, aspects=build_aspects(bone, axis, half_angle_deg))


def drawn_box(a: Room) -> tuple[int, int, int, int]:
    """Roughly what is seen of the bone, in the left picture."""
    truth = a.truth(a.frames[0])
    mesh = a.tracker.model.bone.mesh
    seen = mesh.vertices_mm[mesh.visible_vertices(truth)]
    bare = seen[seen[:, 2] < mesh.vertices_mm[:, 2].min() + 60.0]
    pixels = a.rig.left.project(truth.apply(bare))
    x, y = pixels.min(axis=0) - np.array([12.0, -8.0])
    width, height = np.ptp(pixels, axis=0) + np.array([15.0, -20.0])
    return int(x), int(y), int(width), int(height)


def test_the_first_registration_finds_the_bone_from_the_rough_prior() -> None:
    a = room()
    frame, told = a.frames[0], []
    found = a.tracker.register(frame, a.prior, GOAL, told.append)
    assert a.error_mm(a.prior.left_from_bone["femur"], frame) > 5.0
    assert a.error_mm(found[0].left_from_bone, frame) < 1.2
    assert found[0].verdict.status is Status.OK
    assert told == sorted(told)
    assert told[-1] == 1.0


def test_a_registration_can_be_stopped() -> None:
    a = room()

    class StoppedError(Exception):
        pass

    def stop(share: float) -> None:
        if share > 0.1:
            raise StoppedError

    with pytest.raises(StoppedError):
        a.tracker.register(a.frames[0], a.prior, GOAL, stop)


def test_without_a_start_for_this_bone_there_is_no_candidate() -> None:
    a = room()
    assert a.tracker.register(a.frames[0], Prior(), GOAL) == []


@pytest.mark.slow
@pytest.mark.parametrize("is_in_box", few_of([False, True]))
def test_the_first_registration_finds_the_bone_without_a_pose(is_in_box: bool) -> None:
    a = room()
    axis, half_angle_deg = cone()
    frame, told = a.frames[0], []
    prior = Prior(
        {}, {"femur": ViewCone(axis, half_angle_deg)}, drawn_box(a) if is_in_box else None
    )
    found = tracker_with_aspects().register(frame, prior, GOAL, told.append)
    assert a.error_mm(found[0].left_from_bone, frame) < 1.0
    assert found[0].verdict.status is Status.OK
    assert found[0].left_from_bone.name == "left_from_femur"
    assert told == sorted(told)
    assert told[-1] == 1.0


@pytest.mark.release
@pytest.mark.slow
def test_a_box_alone_will_do_on_grey_pictures_and_without_aspects() -> None:
    a = room(is_grey=True, n_frames=2)
    frame = a.frames[0]
    prior = Prior(box=drawn_box(a))
    found = a.tracker.register(frame, prior, GOAL)
    assert a.error_mm(found[0].left_from_bone, frame) < 1.0


@pytest.mark.parametrize("box", [(5000, 5000, 100, 100), (0, 0, 150, 150)])
def test_a_box_beside_the_bone_gives_no_ok(box: tuple[int, int, int, int]) -> None:
    a = room()
    frame = a.frames[0]
    axis, half_angle_deg = cone()
    prior = Prior({}, {"femur": ViewCone(axis, half_angle_deg)}, box)
    found = tracker_with_aspects().register(frame, prior, GOAL)
    assert found
    assert all(one.verdict.status is not Status.OK for one in found)


@pytest.mark.release
def test_where_no_start_leads_to_a_pose_a_buried_bone_is_looked_for(monkeypatch) -> None:
    monkeypatch.setattr(FitScorer, "find_poses", lambda *_: [])
    a = room()
    (found,) = a.tracker.register(a.frames[0], a.prior, GOAL)
    assert a.error_mm(found.left_from_bone, a.frames[0]) < 1.2
