"""How much of the model a fit explains, and what that says of several."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from navapp.registration import ScoredPose, rank_fits, select_poses
from navapp.registration.multi_start import NEAR_SETTINGS
from navapp.tracking import scoring
from navapp.tracking.frame import Fit
from navapp.tracking.scoring import FitScorer
from navapp.tracking.surface_meter import NEAR_BOX, WIDE_VIEW
from navapp.values import Reason
from tests.registration.shapes import TRUE
from tests.tracking.rooms import room


def found_at_the_truth() -> Fit:
    a = room()
    frame, tracker = a.frames[0], a.tracker
    begun = tracker.begin(frame, a.truth(frame), WIDE_VIEW)
    fit = tracker.near.find_freely(begun, NEAR_BOX)
    assert fit is not None
    return fit


def turned(fit: Fit, turn_rad: float) -> Fit:
    pose = fit.pose.move((0, 0, 0, 0, 0, turn_rad), fit.pose.apply(room().tracker.model.centre_mm))
    return replace(fit, estimate=replace(fit.estimate, camera_from_bone=pose))


def test_a_small_bone_is_looked_for_with_a_narrow_kernel(monkeypatch) -> None:
    asked = []
    monkeypatch.setattr(scoring, "find_poses", lambda *given: asked.append(given[-1]) or [])
    tracker = room().tracker
    measured = SimpleNamespace(scene=None)
    tracker.scorer.find_poses(measured, [])
    assert asked.pop().widest_mm == NEAR_SETTINGS.widest_mm, "a femur is large"
    monkeypatch.setattr(tracker.model, "radius_mm", 18.0)
    tracker.scorer.find_poses(measured, [])
    assert asked.pop().widest_mm == pytest.approx(6.0)


def test_a_different_pose_that_explains_as_much_makes_the_best_a_guess() -> None:
    centre_mm, fit = room().tracker.model.centre_mm, found_at_the_truth()
    other = turned(fit, 0.4)
    best, second = rank_fits([other, fit], [0.5, 0.52], centre_mm)
    assert best.pose is fit.pose
    assert second is other
    assert Reason.AMBIGUOUS in best.estimate.reasons
    assert rank_fits([other, fit], [0.3, 0.52], centre_mm)[0] is fit
    assert rank_fits([fit, fit], [0.5, 0.52], centre_mm)[0] is fit


def test_the_right_pose_explains_most_and_a_wrong_one_is_not_there() -> None:
    scorer, fit = FitScorer(room().tracker.meter), found_at_the_truth()
    wrong = turned(fit, 0.4)
    assert scorer.is_there(fit)
    assert not scorer.is_there(wrong)
    assert scorer.score(fit) > 2.0 * scorer.score(wrong)
    assert scorer.rank([wrong, fit])[0] is fit


def test_a_pose_that_nothing_fixes_explains_nothing() -> None:
    scorer, fit = FitScorer(room().tracker.meter), found_at_the_truth()
    free = replace(fit.estimate, covariance=np.diag([np.inf] * 6))
    assert scorer.score(replace(fit, estimate=free)) == 0.0
    assert scorer.explain(fit.pose, fit.measured) == scorer.score(fit) > 0.0


@pytest.mark.parametrize(("most", "expected"), [(1, 1), (3, 2)])
def test_only_what_explains_enough_beside_the_best_is_refined(most: int, expected: int) -> None:
    found = [ScoredPose(TRUE, score) for score in (0.8, 0.5, 0.3)]
    assert len(select_poses(found, most)) == expected
    assert select_poses([], most) == []
