"""Rows of the tables against figures by hand."""

import json
from itertools import product

import numpy as np
import pytest

from navapp.evaluation.paper.cases import ALL_CASES
from navapp.evaluation.paper.rows import make_row
from tests.evaluation.scored import done, followed, score

CASE = ALL_CASES[0]
# Two OK frames, a refused one with a pose, and one without.
MIXED = followed(score(0.1), score(0.3), score(2.0, "DEGRADED"), score(None, "LOST"))


def test_ours_counts_ok_frames_and_the_others_all_that_have_a_pose() -> None:
    ours = make_row(CASE, "bimcc", done(MIXED), [])
    assert ours.tre_mm == pytest.approx(0.2)
    assert ours.overlay_mm == ours.counted.mean_outline_mm == pytest.approx(0.4)
    for method in ("icp", "paper"):
        row = make_row(CASE, method, done(MIXED), [])
        assert row.tre_mm == pytest.approx(0.8)
        assert row.overlay_mm == row.counted.mean_outline_mm == pytest.approx(1.6)
        assert row.to_json()["tre_refused_mm"] == pytest.approx(2.0)


def test_refused_frames_are_counted_with_or_without_a_pose() -> None:
    for method in ("icp", "bimcc"):
        row = make_row(CASE, method, done(MIXED, followed(score(0.1))), [])
        assert (row.figures.n_frames, row.figures.n_ok) == (5, 3)
        assert (row.to_json()["refused"], row.to_json()["ok_share"]) == (2, pytest.approx(0.6))
        assert row.seeds == (1, 2)


def test_tests_are_pooled_by_frames() -> None:
    row = make_row(CASE, "bimcc", done(followed(*[score(0.1)] * 3), followed(score(0.5))), [])
    assert row.tre_mm == pytest.approx(0.2)


def test_wrong_ones_and_coverage() -> None:
    frames = [score(0.4), score(0.9), score(1.1), score(0.2), score(3.0, "LOST")]
    row = make_row(CASE, "bimcc", done(followed(*frames)), [])
    assert row.to_json()["wrong_and_ok"] == 1
    assert row.to_json()["bound_coverage"] == pytest.approx(0.5)


def test_the_interval_draws_knees_not_frames() -> None:
    # Of two knees, a quarter of all draws is twice the first, a quarter twice the second.
    two = done(followed(*[score(0.1)] * 40), followed(*[score(0.3)] * 40))
    assert make_row(CASE, "bimcc", two, []).tre_ci95 == pytest.approx((0.1, 0.3))
    row = make_row(CASE, "bimcc", two, [])
    assert row.overlay_ci95 == pytest.approx((0.2, 0.6))


def test_the_interval_against_all_draws() -> None:
    values = [(0.1, 2), (0.2, 5), (0.4, 1), (0.7, 4)]  # error, frames
    row = make_row(CASE, "bimcc", done(*(followed(*[score(v)] * n) for v, n in values)), [])
    means = [
        sum(v * n for v, n in drawn) / sum(n for _, n in drawn)
        for drawn in product(values, repeat=4)
    ]
    assert row.tre_ci95 == pytest.approx(np.percentile(means, (2.5, 97.5)), abs=0.03)
    again = make_row(CASE, "bimcc", done(*(followed(*[score(v)] * n) for v, n in values)), [])
    assert again.tre_ci95 == row.tre_ci95


def test_one_knee_has_no_interval_and_one_without_a_frame_is_drawn_too() -> None:
    assert make_row(CASE, "bimcc", done(followed(score(0.1))), []).tre_ci95 is None
    lost = followed(score(None, "LOST"))
    assert make_row(CASE, "bimcc", done(followed(score(0.1)), lost), []).tre_ci95 is None
    three = done(followed(score(0.1)), followed(score(0.3)), lost)
    assert make_row(CASE, "bimcc", three, []).tre_ci95 == pytest.approx((0.1, 0.3))


def test_nothing_found_is_no_figure() -> None:
    lost = followed(score(None, "LOST", reasons=(), seen=None), registration_s=None)
    row = make_row(CASE, "bimcc", done(lost), done(lost))
    figures = row.figures
    assert (row.tre_mm, row.overlay_mm, row.tre_ci95, figures.bound_coverage) == (None,) * 4
    assert (row.fps, row.registration_s, figures.ok_share) == (None, None, 0.0)
    assert row.to_json()["latency_ms"] == {"p50": None, "p95": None}
    empty = make_row(CASE, "bimcc", done(followed()), [])
    assert (empty.figures.n_frames, empty.figures.ok_share, empty.tre_mm) == (0, 0.0, None)


def test_times_are_those_of_the_timed_tests_without_searches() -> None:
    timed = followed(
        score(0.1, total_ms=10.0),
        score(None, total_ms=30.0),  # a pose whose truth was not asked for
        score(0.1, total_ms=999.0, is_search=True),
        score(None, "LOST", reasons=(), seen=None, total_ms=1.0),  # nothing was looked for
        score(None, "LOST", total_ms=80.0),  # looked for in vain: that took its time
        registration_s=0.5,
    )
    row = make_row(CASE, "bimcc", done(MIXED), done(timed))
    assert row.fps == pytest.approx(1000.0 / 40.0)
    assert row.to_json()["latency_ms"] == {"p50": 30.0, "p95": pytest.approx(75.0)}
    assert row.registration_s == 0.5
    assert make_row(CASE, "bimcc", done(timed), []).fps is None


def test_a_row_goes_through_json() -> None:
    told = json.loads(json.dumps(make_row(CASE, "bimcc", done(MIXED), []).to_json()))
    assert (told["sample"], told["stage"], told["situation"]) == ("man", "opening", "registration")
    assert (told["frames"], told["refused"], told["tests"], told["seeds"]) == (4, 2, 1, [1])
    assert told["fps"] is None
