"""A model that does not fit is not believed by a second look at a bone that mirrors nothing."""

from dataclasses import replace

import numpy as np
import pytest

from navapp.geometry.mesh import TriangleMesh
from navapp.tracking import TrackState
from navapp.tracking.bimcc_tracker import BimccTracker
from navapp.values import Status
from tests.many import few_of
from tests.tracking.rooms import GOAL, room


def scale(mesh: TriangleMesh, size: float) -> TriangleMesh:
    centre_mm = mesh.centroid_mm
    return TriangleMesh(centre_mm + size * (mesh.vertices_mm - centre_mm), mesh.faces)


def fade(picture: np.ndarray, saturation: float) -> np.ndarray:
    """Less colourful, as bright."""
    grey = (picture @ np.array([0.114, 0.587, 0.299]))[..., None]
    return np.clip(np.rint(grey + saturation * (picture - grey)), 0, 255).astype(np.uint8)


@pytest.mark.parametrize("saturation", few_of([0.25, 1.0, 0.6, 0.35, 0.15]))
@pytest.mark.parametrize("size", few_of([1.015, 0.985]))
def test_a_model_of_another_size_stays_in_doubt(size: float, saturation: float) -> None:
    a = room()
    frame, bone = a.frames[1], a.tracker.model.bone
    tracker = BimccTracker(a.rig, replace(bone, mesh=scale(bone.mesh, size)))
    state = TrackState.at_rest(a.truth(frame), frame.captured_ns)
    left, right = (fade(one, saturation) for one in (frame.left, frame.right))
    tracked, _ = tracker.track(replace(frame, left=left, right=right), state, GOAL)
    assert a.error_mm(tracked.left_from_bone, frame) > 0.5
    assert tracked.verdict.status is not Status.OK
