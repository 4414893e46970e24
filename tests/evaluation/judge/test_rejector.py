"""Rejection curves and ROC against figures by hand."""

import json

import numpy as np
import pytest

from navapp.evaluation.judge.rejector import SHARES, find_auc, judge_rejector, trace_roc
from tests.evaluation.scored import score


def at(share: float) -> int:
    return int(abs(SHARES - share).argmin())


def test_the_worst_by_a_score_are_rejected_first() -> None:
    errors = [0.1, 0.2, 0.3, 0.4]
    ratios = [1.0, 3.0, 2.0, 4.0]
    frames = [
        score(mm, bound_mm=2.0 * mm, seen=mm, rms_ratio=ratio)
        for mm, ratio in zip(errors, ratios, strict=True)
    ]
    by = judge_rejector(frames).by
    assert by["bound"].mean_mm[0] == pytest.approx(0.25)
    assert by["bound"].mean_mm[at(0.5)] == pytest.approx(0.15)
    assert by["bound"].mean_mm[at(0.75)] == pytest.approx(0.1)
    assert by["bound"].p95_mm[at(0.5)] == pytest.approx(np.percentile([0.1, 0.2], 95))
    # Means of one, two, three and four kept frames: 0.1, 0.15, 0.2, 0.25.
    assert by["bound"].area_mm == pytest.approx(0.175)
    # What is seen best is kept longest, and here it is the worst frame.
    assert by["coverage"].mean_mm[at(0.75)] == pytest.approx(0.4)
    assert by["coverage"].area_mm > by["rms"].area_mm > by["bound"].area_mm
    assert by["error"].area_mm == by["bound"].area_mm


def test_frames_without_a_score_go_first_and_those_without_a_pose_are_counted() -> None:
    frames = [
        score(0.1), score(5.0, "LOST", bound_mm=None), score(0.2, "DEGRADED", bound_mm=0.4),
        score(None, "LOST", bound_mm=None),
    ]  # fmt: skip
    found = judge_rejector(frames)
    assert (found.n_frames, found.n_without_pose) == (3, 1)
    assert found.by["bound"].mean_mm[at(0.4)] == pytest.approx(0.15)
    assert found.by["bound"].auc == 1.0
    assert judge_rejector([score(None, "LOST")]) is None


def test_the_operating_point_is_what_the_judge_refuses() -> None:
    frames = [
        *[score(0.1)] * 6, *[score(0.1, "DEGRADED")] * 2,
        *[score(3.0, "LOST", bound_mm=4.0)] * 3, score(3.0),
    ]  # fmt: skip
    point = judge_rejector(frames).point
    assert (point.n_wrong, point.n_right) == (4, 8)
    assert point.wrong_refused == pytest.approx(0.75)
    assert point.right_refused == pytest.approx(0.25)


def test_nothing_wrong_has_no_roc() -> None:
    found = judge_rejector([score(0.1), score(0.2, "DEGRADED")])
    assert found.by["bound"].auc is None
    assert found.point.wrong_refused is None
    assert found.point.right_refused == 0.5
    assert found.roc.shape == (0, 2)
    json.dumps(found.to_json(), allow_nan=False)


def test_the_area_below_the_roc_is_the_share_of_pairs_in_order() -> None:
    rng = np.random.default_rng(2)
    values = rng.integers(0, 8, 60).astype(float)  # with ties
    is_wrong = rng.random(60) < 0.3
    pairs = [
        1.0 if bad > good else 0.5 if bad == good else 0.0
        for bad in values[is_wrong]
        for good in values[~is_wrong]
    ]
    assert find_auc(values, is_wrong) == pytest.approx(np.mean(pairs))
    roc = trace_roc(values, is_wrong)
    assert np.trapezoid(roc[:, 1], roc[:, 0]) == pytest.approx(np.mean(pairs))
    assert roc[0].tolist() == [0.0, 0.0]
    assert roc[-1].tolist() == [1.0, 1.0]
    assert find_auc(np.array([3.0, 1.0, 2.0]), np.array([True, False, False])) == 1.0
