"""The chart of an ablation."""

import re

from navapp.evaluation.ablation.chart import draw_variants
from navapp.evaluation.ablation.rows import ALL, make_variant_rows
from navapp.evaluation.methods import VARIANTS
from navapp.evaluation.paper.cases import Case
from tests.evaluation.ablation.scored_variants import done_by_variants
from tests.evaluation.scored import followed, score

LOST = score(None, "LOST", bound_mm=None)


def words_of(*frames) -> list[str]:
    done = done_by_variants([Case("man", "opening", "overlay")], followed(*frames))
    rows = [row for row in make_variant_rows(done, done) if row.stage == ALL]
    return re.findall(r"<text[^>]*>([^<]+)</text>", draw_variants(rows))


def test_all_variants_are_named_from_the_top() -> None:
    words = words_of(score(0.1), score(2.0, "DEGRADED"))
    assert [word for word in words if word in VARIANTS] == list(VARIANTS)
    assert {"OK, mean", "OK, worst", "all, mean", "OK", "OK and wrong"} <= set(words)


def test_errors_that_no_frame_has_are_not_in_the_legend() -> None:
    words = words_of(score(2.0, "DEGRADED"))
    assert "all, mean" in words
    assert "OK, mean" not in words
    assert "all, mean" not in words_of(LOST)
