"""What an ablation runs: every part alone is left out, with seeds and frames of the tables."""

from dataclasses import replace
from typing import get_args

from navapp.evaluation.ablation import settings as settings_of_ablation
from navapp.evaluation.ablation.settings import (
    FIRST_ABLATION_SEED,
    VARIANTS,
    WHOLE,
    WITHOUT_FILL,
    AblationSettings,
)
from navapp.evaluation.paper.cases import ALL_CASES, SWEEP_FRAMES, Case
from navapp.evaluation.paper.settings import TableSettings
from navapp.tracking import Part

KNEES = TableSettings(
    (ALL_CASES[0], Case("man", "opening", "instrument")), ("bimcc",), 2, 20, FIRST_ABLATION_SEED
)
SETTINGS = AblationSettings(KNEES)


def test_the_whole_method_stands_first_and_every_part_is_left_out_once() -> None:
    assert next(iter(VARIANTS)) == WHOLE
    assert VARIANTS[WHOLE] == frozenset()
    assert VARIANTS[WITHOUT_FILL] == {"fill"}
    left_out = [part for parts in VARIANTS.values() for part in parts]
    assert sorted(left_out) == sorted(get_args(Part))


def test_a_variant_follows_without_its_parts(monkeypatch) -> None:
    def follow(sequence, method, leaves_out):
        return sequence, method, leaves_out

    monkeypatch.setattr(settings_of_ablation, "follow", follow)
    for name, parts in VARIANTS.items():
        assert SETTINGS.follow("pictures", name) == ("pictures", "bimcc", parts)


def test_tests_frames_and_times_are_those_of_the_tables() -> None:
    assert SETTINGS.tests == KNEES.tests
    assert len(SETTINGS.timed_tests) == 2
    still, _, swept, _ = SETTINGS.tests
    assert (SETTINGS.count_frames(still), SETTINGS.count_frames(swept)) == (20, SWEEP_FRAMES)
    assert AblationSettings(replace(KNEES, is_quick=True)).timed_tests == ()


def test_settings_tell_the_ablation_from_the_tables_and_its_variants_apart(monkeypatch) -> None:
    before = SETTINGS.to_json()
    assert before["methods"] == list(VARIANTS)
    assert before["ablation"]["without contour"] == ["contour"]
    assert before != KNEES.to_json()
    monkeypatch.setitem(VARIANTS, "without judge", frozenset())
    assert SETTINGS.to_json() != before
