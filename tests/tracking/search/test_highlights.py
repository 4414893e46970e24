"""A glossy bone is measured once more without highlights."""

from dataclasses import replace

import numpy as np
import pytest

from navapp.evaluation.paper.cases import Case, CaseTest
from navapp.evaluation.sequence import KnownSequence
from navapp.registration.verdict import Goal
from navapp.tracking import TrackState, make_tracker
from navapp.tracking.search.highlights import join_maps, measure_contradiction
from navapp.values import DisparityMap, Origin, Status, TrackedFrame


def a_map(disparity_px: list[float], sigma_px: float) -> DisparityMap:
    values = np.array([disparity_px], dtype=np.float32)
    origin = np.where(np.isfinite(values), Origin.MATCHED, 0).astype(np.uint8)
    return DisparityMap(values, np.full_like(values, sigma_px), origin, 3, 4)


def test_what_is_seen_without_highlights_counts_and_both_claim_less() -> None:
    grey, matte = a_map([10.0, 11.0, np.nan, np.nan], 0.1), a_map([10.2, np.nan, 12.0, np.nan], 0.2)
    joined = join_maps(grey, matte)
    assert np.allclose(joined.disparity_px, [[10.2, 11.0, 12.0, np.nan]], equal_nan=True)
    assert np.allclose(joined.sigma_px[0, :3], [1.5 * 0.2, 2.0 * 0.1, 1.5 * 0.2])
    assert (joined.origin > 0).tolist() == [[True, True, True, False]]
    assert (joined.x, joined.y) == (3, 4)


def test_maps_contradict_each_other_beyond_what_both_claim() -> None:
    claims = a_map([10.0] * 5, 0.3), a_map([9.6, 9.8, 10.0, 10.2, 10.4], 0.4)
    assert np.isclose(measure_contradiction(*claims), 1.4826 * 0.2 / 0.5)
    # An offset that all share is the pose's; what only one of them answers says nothing.
    assert measure_contradiction(a_map([10.0, 11.0], 0.3), a_map([10.5, 11.5], 0.3)) == 0.0
    assert measure_contradiction(a_map([10.0, np.nan], 0.3), a_map([np.nan, 11.0], 0.3)) == 0.0


@pytest.fixture(scope="module")
def patella() -> KnownSequence:
    """One whose highlights leave too little of it to be believed."""
    return CaseTest(Case("woman", "patella", "overlay"), 0, 2_000_001).render(1)


def look(sequence: KnownSequence, *, is_grey: bool) -> TrackedFrame:
    """What is said of a frame that is followed from the true pose."""
    frame, true = sequence.frames[0], sequence.truth[0]
    if is_grey:
        left, right = (np.ascontiguousarray(one[..., 1]) for one in (frame.left, frame.right))
        frame = replace(frame, left=left, right=right)
    tracker = make_tracker(sequence.rig, sequence.plan.bones["patella"])
    goal = Goal(sequence.plan.targets_of(sequence.stage.targets), sequence.stage.tolerance_mm)
    state = replace(TrackState.at_rest(true, frame.captured_ns), n_doubted=1)
    return tracker.track(frame, state, goal)[0]


@pytest.mark.slow
def test_a_bone_that_highlights_hide_is_believed_by_its_colours(patella: KnownSequence) -> None:
    grey, coloured = look(patella, is_grey=True), look(patella, is_grey=False)
    assert grey.verdict.status is Status.DEGRADED
    assert coloured.verdict.status is Status.OK
    assert coloured.verdict.coverage > grey.verdict.coverage + 0.1
    off = coloured.left_from_bone.mean_motion_mm(
        patella.truth[0], patella.plan.bones["patella"].mesh.vertices_mm
    )
    assert off < 0.3
