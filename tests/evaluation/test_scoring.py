"""Answers are scored against the truth that the method was not given."""

import numpy as np
import pytest

from navapp.config import Configuration
from navapp.control.stages import STAGES
from navapp.evaluation.following import Answers, FrameAnswer
from navapp.evaluation.scores import SequenceScore
from navapp.evaluation.scoring import score_answers
from navapp.evaluation.sequence import KnownSequence
from navapp.geometry.transform import RigidTransform
from navapp.values import Prior
from tests.control.fakes import PERIOD_NS, a_frame, a_plan, a_pose, a_rig, answer

N = 9


def scored(truth, pose: RigidTransform) -> SequenceScore:
    """The scores of a method that says the same pose in every frame."""
    frames = [a_frame(10**9 + number * PERIOD_NS, number) for number in range(N)]
    plan = a_plan()
    sequence = KnownSequence(
        frames, truth, Configuration(), a_rig(), plan, Prior({"femur": a_pose()}), STAGES[0]
    )
    told = answer()
    said = FrameAnswer(pose, told.estimate, told.verdict, 20.0, is_search=False)
    answers = Answers((said,) * N, 1.5, 2, plan.bones["femur"].mesh)
    return score_answers(sequence, answers, has_budget=True)


def test_the_frame_that_is_registered_in_does_not_count() -> None:
    followed = scored([a_pose()] * N, a_pose())
    assert [frame.index for frame in followed.frames] == list(range(1, N))
    assert (followed.registration_s, followed.n_registrations) == (1.5, 2)
    assert {(one.status, one.is_search, one.total_ms) for one in followed.frames} == {
        ("OK", False, 20.0)
    }
    assert {one.budget for one in followed.frames} == {None}, "nobody knows this sensor's noise"


def test_errors_are_those_of_each_frame() -> None:
    # The truth moves by 1 mm a frame, and the answer does not.
    truth = [a_pose(x_mm=float(number)) for number in range(N)]
    frames = scored(truth, a_pose()).frames
    assert [frame.tre_mm for frame in frames] == pytest.approx(range(1, N))
    assert [frame.displacement_mm for frame in frames] == pytest.approx(range(1, N), abs=1e-6)
    assert [frame.bound_mm for frame in frames] == [0.8] * (N - 1)
    assert [frame.rms_ratio for frame in frames] == [1.0] * (N - 1)
    for frame in frames:
        assert list(frame.claimed_mm) == sorted(set(frame.claimed_mm))
        # At least the quantiles of the shift alone: 0.1 mm along each of three axes.
        assert all(np.array(frame.claimed_mm) > 0.1 * np.array([1.53, 2.15, 2.79, 3.36]))


def test_a_frame_without_truth_has_no_error() -> None:
    truth = [a_pose(), None, *[a_pose()] * (N - 2)]
    first, second, *_ = scored(truth, a_pose()).frames
    assert (first.tre_mm, first.displacement_mm, first.outline_mm) == (None, None, None)
    assert first.is_ok
    assert second.tre_mm == pytest.approx(0.0)
