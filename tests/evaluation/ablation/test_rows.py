"""Rows of an ablation: pooled over samples, compared with the whole method frame by frame."""

import math

import pytest

from navapp.evaluation.ablation.rows import ALL, make_variant_rows
from navapp.evaluation.methods import OURS, VARIANTS
from navapp.evaluation.paper.cases import Case
from tests.evaluation.ablation.scored_variants import done_by_variants
from tests.evaluation.scored import followed, score

OPENING = [Case(sample, "opening", "overlay") for sample in ("man", "woman")]
PATELLA = Case("man", "patella", "instrument")
DOUBTED = score(3.0, "DEGRADED")
LOST = score(None, "LOST", bound_mm=None)


def rows_of(given, timed=()) -> dict[tuple[str, str], dict]:
    rows = make_variant_rows(given, timed)
    return {(row.stage, row.variant): row for row in rows}


def test_samples_are_pooled_stages_are_not_and_all_stand_first() -> None:
    given = done_by_variants([*OPENING, PATELLA], followed(score(0.1), score(0.2)))
    rows = make_variant_rows(given, [])
    assert [row.variant for row in rows] == list(VARIANTS) * 3
    assert [(row.stage, row.situation) for row in rows[:: len(VARIANTS)]] == [
        (ALL, ALL), ("opening", "overlay"), ("patella", "instrument"),
    ]  # fmt: skip
    assert [(row.n_tests, row.figures.n_frames) for row in rows[:: len(VARIANTS)]] == [
        (3, 6), (2, 4), (1, 2),
    ]  # fmt: skip


def test_ok_frames_and_all_poses_have_means_of_their_own() -> None:
    whole = followed(score(0.1), score(0.4), DOUBTED, LOST)
    row = rows_of(done_by_variants([PATELLA], whole))["patella", OURS]
    told = row.to_json()
    assert (told["n_ok"], told["ok_share"]) == (2, 0.5)
    assert told["tre_ok_mm"] == pytest.approx(0.25)
    assert told["tre_any_mm"] == pytest.approx(3.5 / 3.0)
    assert (told["worst_ok_mm"], told["n_wrong"], told["coverage"]) == (0.4, 0, 1.0)


def test_wrong_is_ok_over_a_millimetre_and_beyond_the_bound() -> None:
    believed = followed(
        score(0.1), score(1.2), score(1.2, bound_mm=1.5), score(0.7), score(3.0, "LOST")
    )
    row = rows_of(done_by_variants([PATELLA], followed(*[DOUBTED] * 5), without_judge=believed))[
        "patella", "without judge"
    ]
    assert (row.figures.n_ok, row.figures.n_wrong) == (4, 1)
    assert row.figures.bound_coverage == 0.5


def test_a_frame_that_differs_in_its_last_bit_or_in_a_reason_is_not_the_same() -> None:
    whole = followed(score(0.1), score(0.2), DOUBTED)
    other = followed(
        score(0.1, total_ms=99.0),
        score(math.nextafter(0.2, 1.0)),
        score(3.0, "DEGRADED", reasons=()),
    )
    rows = rows_of(done_by_variants([PATELLA], whole, without_contour=other))
    assert rows["patella", "without contour"].n_same == 1, "only the time differs"
    assert rows["patella", "without contour"].n_alike == 3
    assert rows["patella", OURS].n_same == rows["patella", "without judge"].n_same == 3


def test_alike_is_the_same_status_and_nearly_the_same_error() -> None:
    whole = followed(score(0.1), score(0.2), score(0.3), LOST, LOST, DOUBTED)
    other = followed(
        score(0.1009), score(0.2011), score(0.3, "LOST"), LOST, score(0.1, "LOST"), LOST
    )
    row = rows_of(done_by_variants([PATELLA], whole, without_contour=other))[
        "patella", "without contour"
    ]
    assert (row.n_alike, row.n_same) == (2, 1)


def test_times_are_of_frames_in_which_a_bone_was_followed_in_their_own_pass() -> None:
    timed = done_by_variants(
        [PATELLA],
        followed(
            score(0.1, total_ms=10.0), score(0.1, total_ms=20.0), score(0.1, total_ms=60.0),
            score(0.1, total_ms=5000.0, is_search=True),
            score(None, "LOST", reasons=(), seen=None, total_ms=1.0),
            registration_s=0.5,
        ),
    )  # fmt: skip
    given = done_by_variants([PATELLA], followed(score(0.1, total_ms=700.0)))
    row = rows_of(given, timed)["patella", OURS]
    assert (row.median_ms, row.mean_ms, row.registration_s) == (20.0, 30.0, 0.5)
    untimed = rows_of(given)["patella", OURS]
    assert (untimed.median_ms, untimed.mean_ms, untimed.registration_s) == (None, None, None)


def test_without_an_ok_frame_there_are_no_figures_of_ok_frames() -> None:
    row = rows_of(done_by_variants([PATELLA], followed(LOST)))["patella", OURS]
    told = row.to_json()
    names = ("tre_ok_mm", "tre_any_mm", "worst_ok_mm", "coverage")
    assert [told[name] for name in names] == [None] * 4
    assert told["n_frames"] == 1


def test_nothing_done_has_no_rows() -> None:
    assert make_variant_rows([], []) == []
