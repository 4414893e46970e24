"""What is run for the paper's tables."""

import json
from dataclasses import replace

from navapp.evaluation.methods import METHODS, VARIANTS
from navapp.evaluation.paper.cases import FIRST_SEED, INSTRUMENT_S, SWEEP_FRAMES, Case, CaseTest
from navapp.evaluation.paper.settings import TableSettings

STILL, SWEPT = Case("man", "opening", "registration"), Case("man", "opening", "instrument")
SETTINGS = TableSettings((STILL, SWEPT), ("bimcc",), 1, 40, FIRST_SEED)


def test_settings_are_read_as_they_were_written() -> None:
    for one in (SETTINGS, replace(SETTINGS, methods=("icp", "bimcc"), is_quick=True, n_tests=3)):
        assert TableSettings.from_json(json.loads(json.dumps(one.to_json()))) == one


def test_an_instrument_passes_once_whatever_is_asked(monkeypatch) -> None:
    monkeypatch.setattr(CaseTest, "render", lambda test, n_frames: n_frames)
    still, swept = SETTINGS.tests
    # One frame more than are counted: the first is registered in.
    assert (SETTINGS.render(still), SETTINGS.render(swept)) == (41, 1 + SWEEP_FRAMES)
    assert replace(SETTINGS, n_frames=120).render(swept) == 121
    assert replace(SETTINGS, n_frames=5, is_quick=True).render(swept) == 6
    assert SETTINGS.render(swept, 2) == 3
    rate_hz = CaseTest(SWEPT, 0, 1).configure().camera.rate_hz
    assert SWEEP_FRAMES / rate_hz > INSTRUMENT_S[1]


def test_only_the_tables_show_details() -> None:
    assert replace(SETTINGS, methods=METHODS).has_details
    assert not replace(SETTINGS, methods=tuple(VARIANTS)).has_details
