"""The view that fits two pictures best (the paper's equations 2 and 3)."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from navapp.preop import build_aspects
from navapp.registration.best_view import find_best_view
from navapp.registration.hypotheses import compute_poses, place_hypothesis
from navapp.tracking.surface_meter import NEAR_BOX, WIDE_VIEW
from tests.tracking.rooms import cone, room


@pytest.fixture(scope="module")
def scene():
    """A frame of the room, its tracker, and the edges of its bone."""
    a = room()
    frame, tracker = a.frames[0], a.tracker
    begun = tracker.begin(frame, a.truth(frame), WIDE_VIEW)
    box, _ = tracker.meter.find_region(begun.start, NEAR_BOX)
    return (
        replace(begun.pair, box=box),
        begun.start,
        tracker,
        build_aspects(tracker.model.bone, *cone()),
    )


def test_a_hypothesis_of_a_pose_is_that_pose(scene) -> None:
    _, true, tracker, aspects = scene
    here = place_hypothesis(aspects.directions, true, tracker.model.centre_mm)
    rotations, shifts = compute_poses(here)
    np.testing.assert_allclose(rotations[0], true.rotation, atol=1e-12)
    np.testing.assert_allclose(shifts[0], true.translation_mm, atol=1e-9)


def test_from_turned_poses_the_best_view_is_nearer_on_the_whole(scene) -> None:
    pair, true, tracker, aspects = scene
    centre_mm, hull_mm = true.apply(tracker.model.centre_mm), tracker.model.hull_mm
    # About each axis and about two at once, to both sides.
    axes = np.array([turn for turn in product((-1, 0, 1), repeat=3) if 0 < np.abs(turn).sum() < 3])
    before, after = [], []
    for turn in axes / np.linalg.norm(axes, axis=1, keepdims=True):
        start = true.move((0.0, 0.0, 0.0, *(0.14 * turn)), centre_mm)
        found = find_best_view(pair, tracker.model, aspects, start)
        before.append(true.mean_motion_mm(start, hull_mm))
        after.append(true.mean_motion_mm(found, hull_mm))
    assert np.mean(after) < 0.75 * np.mean(before)


def test_the_true_pose_is_its_own_best_view(scene) -> None:
    pair, true, tracker, aspects = scene
    found = find_best_view(pair, tracker.model, aspects, true)
    assert true.mean_motion_mm(found, tracker.model.hull_mm) < 1e-6
