"""The tables of an ablation: what stands in a row, and what is said of the fill."""

from navapp.evaluation.ablation.rows import make_variant_rows
from navapp.evaluation.ablation.tables import make_ablation_tables
from navapp.evaluation.paper.cases import Case
from tests.evaluation.ablation.scored_variants import done_by_variants
from tests.evaluation.scored import followed, score

CASE = Case("man", "opening", "overlay")
WHOLE = followed(score(0.1), score(0.2))


def lines_of(timed=None, *, is_quick: bool = False, **others) -> list[str]:
    """Of one test; its times are those of another pass, if there is one."""
    done = done_by_variants([CASE], WHOLE, **others)
    rows = make_variant_rows(done, done if timed is None else timed)
    return make_ablation_tables(rows, ["how it was made"], is_quick=is_quick).splitlines()


def test_a_row_reads_as_the_figures_are() -> None:
    lines = lines_of(
        without_judge=followed(score(0.1), score(12.0)),
        without_second_look=followed(score(0.1), score(None, "LOST", bound_mm=None)),
    )
    for row in (
        "| `bimcc` | 100 % | 0.150 | 0.150 | 0.200 | 0 | 100 % | 100 % | 20 | 20 |",
        "| without judge | 100 % | 6.050 | 6.050 | 12 | 1 | 50 % | 50 % | 20 | 20 |",
        "| without second look | 50 % | 0.100 | 0.100 | 0.100 | 0 | 100 % | 50 % | 20 | 20 |",
    ):
        assert lines.count(row) == 1
        assert lines.count(f"{row} 1.00 |") == 1, "of all: with the time of a registration"
    assert lines.count("Tests: 1, frames: 2.") == 2
    assert "- how it was made" in lines


def test_a_variant_without_any_pose_has_dashes() -> None:
    lost = followed(score(None, "LOST", bound_mm=None), score(None, "LOST", bound_mm=None))
    lines = lines_of(timed=[], without_contour=lost)
    assert "| without contour | 0 % | - | - | - | 0 | - | 0 % | - | - |" in lines


def test_a_share_that_is_nearly_all_or_nearly_nothing_is_not_rounded_to_it() -> None:
    often = followed(*[score(0.1)] * 299, score(None, "LOST", bound_mm=None))
    seldom = followed(score(0.1), *[score(None, "LOST", bound_mm=None)] * 299)
    done = done_by_variants([CASE], often, without_contour=seldom)
    text = make_ablation_tables(make_variant_rows(done, []), [], is_quick=False)
    assert "| `bimcc` | > 99 % |" in text
    assert "| without contour | < 1 % |" in text


def test_the_fill_is_told_in_words() -> None:
    told = (
        "Without filled depth {} of 2 frames have the same verdict, errors and bound to the last "
        "bit."
    )
    times = (
        " The median frame took 20.0 ms with the fill, and 20.0 ms without it and the hiding of "
        "guides."
    )
    assert told.format(2) + times in lines_of()
    assert told.format(2) in lines_of(timed=[])
    assert told.format(1) + times in lines_of(without_filled_depth=followed(score(0.1), score(0.3)))


def test_a_quick_look_says_that_it_is_no_result() -> None:
    assert "no results" in "\n".join(lines_of(is_quick=True))
    assert "no results" not in "\n".join(lines_of())
