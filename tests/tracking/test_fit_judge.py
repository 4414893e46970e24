from dataclasses import replace

import numpy as np
import pytest

from navapp.registration import estimate_at
from navapp.tracking import TrackState, fit_judge
from navapp.tracking.locator import STEREO_SETTINGS
from navapp.values import TrackedFrame
from tests.tracking.rooms import GOAL, Room, room


def tracked(a: Room) -> TrackedFrame:
    """Of the first frame, from its truth."""
    frame = a.frames[0]
    state = TrackState.at_rest(a.truth(frame), frame.captured_ns)
    return a.line.track(frame.left, frame.right, frame.captured_ns, state, GOAL)[0]


def _surface_alone(pair, fit, coarse_px, noise2):
    covariance = noise2 * fit.estimate.covariance
    return replace(fit, estimate=replace(fit.estimate, covariance=covariance))


def test_the_outline_enters_the_pose_that_is_handed_out(monkeypatch) -> None:
    a = room()
    frame = a.frames[0]
    with_it = tracked(a)
    monkeypatch.setattr(a.line._fit_judge._contours, "joined", _surface_alone)
    without = tracked(a)
    assert np.trace(with_it.estimate.covariance) < np.trace(without.estimate.covariance)
    assert with_it.verdict.predicted_tre_mm < without.verdict.predicted_tre_mm
    assert a.error_mm(with_it.left_from_bone, frame) < with_it.verdict.predicted_tre_mm


def test_the_covariance_turns_with_the_camera_frame() -> None:
    """Handed out in the left camera before rectification, which is a pure rotation."""
    a = room()
    frame = a.frames[0]
    line, truth = a.line, a.truth(frame)
    estimate = line.assess(frame.left, frame.right, truth, GOAL).estimate
    rectified_from_left = line._meter.geometry.rectified_from_left
    pair, _ = line._rectified_pair(frame.left, frame.right, line._rectified(truth))
    pose = rectified_from_left @ truth
    measured = line._meter.freely(pair, pose, line.settings.locator.tracking)
    inside = estimate_at(measured.scene, line.model, pose, STEREO_SETTINGS)
    turn = np.kron(np.eye(2), rectified_from_left.rotation)
    np.testing.assert_allclose(
        turn @ estimate.covariance @ turn.T, inside.covariance, rtol=1e-9, atol=1e-15
    )
    assert np.abs(estimate.covariance - inside.covariance).max() > 1e-6


@pytest.mark.parametrize(("hidden_share", "noise"), [(0.0, 0.65), (0.9, 1.0)])
def test_a_claim_is_believed_less_while_the_bone_lies_open(
    monkeypatch, hidden_share, noise
) -> None:
    a = room()
    judge = a.line._fit_judge
    monkeypatch.setattr(judge._contours, "joined", _surface_alone)
    agreement = judge._judge.agreement

    def hidden(*args, **more):
        return replace(agreement(*args, **more), hidden_share=hidden_share)

    monkeypatch.setattr(judge._judge, "agreement", hidden)
    told = tracked(a)
    monkeypatch.setattr(fit_judge, "noise_ratio2", lambda *, lies_open: 1.0)
    claimed = tracked(a)
    assert told.verdict.predicted_tre_mm == pytest.approx(
        noise * claimed.verdict.predicted_tre_mm, rel=1e-6
    )


def test_a_model_that_the_fit_moved_is_compared_where_it_came_to_rest(monkeypatch) -> None:
    a = room()
    contours, asked = a.line._fit_judge._contours, []
    joined = contours.joined
    monkeypatch.setattr(contours, "joined", lambda *more: replace(joined(*more), moved_mm=0.1))
    judge = a.line._fit_judge._judge
    agreement = judge.agreement
    monkeypatch.setattr(judge, "agreement", lambda *more: asked.append(more) or agreement(*more))
    tracked(a)
    # With the view in which it was matched, then without one.
    assert [len(one) for one in asked] == [5, 4]
