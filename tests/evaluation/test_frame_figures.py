"""Figures of some frames, by hand."""

import pytest

from navapp.evaluation.frame_figures import FrameFigures, find_mean, pool_frames
from tests.evaluation.scored import score


def test_figures_of_mixed_frames() -> None:
    figures = FrameFigures(
        (
            score(0.2),
            score(0.6),  # OK, beyond its bound of 0.5 mm, not by more than 1 mm off
            score(2.0),  # OK and wrong
            score(None),  # OK, and nobody knows where the bone was
            score(5.0, "DEGRADED"),
            score(None, "LOST"),
        )
    )
    assert (figures.n_frames, figures.n_ok, figures.ok_share) == (6, 4, pytest.approx(4 / 6))
    assert figures.ok.n_frames == 3, "with a known error"
    assert (figures.n_wrong, figures.bound_coverage) == (1, pytest.approx(1 / 3))
    assert (figures.ok.mean_mm, figures.ok.worst_mm) == (pytest.approx(2.8 / 3), 2.0)
    assert figures.ok.percentile_mm(50.0) == pytest.approx(0.6)
    assert figures.mean_mm == pytest.approx(7.8 / 4), "of every pose"
    assert (figures.refused.n_frames, figures.refused.mean_mm) == (2, 5.0)
    assert figures.ok.mean_displacement_mm == figures.ok.mean_outline_mm == pytest.approx(5.6 / 3)


def test_an_error_without_a_bound_is_not_within_it() -> None:
    figures = FrameFigures((score(0.1, bound_mm=None), score(3.0, bound_mm=None)))
    assert (figures.bound_coverage, figures.n_wrong) == (0.0, 1)


def test_no_frames_have_no_figures() -> None:
    figures = pool_frames([])
    assert (figures.n_frames, figures.ok_share, figures.n_wrong) == (0, 0.0, 0)
    assert figures.mean_mm is figures.worst_mm is figures.bound_coverage is None
    assert figures.percentile_mm(50.0) is figures.mean_displacement_mm is None


def test_tests_are_pooled_frame_by_frame() -> None:
    assert pool_frames([[score(0.1)], [score(0.2), score(0.6)]]).mean_mm == pytest.approx(0.3)
    assert find_mean([None, 1.0, 3.0]) == 2.0
    assert find_mean([None]) is None
