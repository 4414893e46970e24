"""`navapp evaluate --ablation`: its options, and one case from end to end."""

import json
import subprocess
import sys

import pytest

from drivers.child_python import make_child_environment
from navapp.cli.main import run
from navapp.evaluation import campaign
from navapp.evaluation.ablation import results
from navapp.evaluation.methods import VARIANTS
from navapp.evaluation.paper.cases import ALL_CASES, FIRST_ABLATION_SEED
from navapp.evaluation.paper.settings import TableSettings


@pytest.fixture
def ran(monkeypatch) -> list[TableSettings]:
    """What would be run; nothing is."""
    kept = []
    wrote = {"summary": {"quick": False, "variants": []}}
    monkeypatch.setattr(campaign, "run_campaign", lambda _, settings, *__: kept.append(settings))
    monkeypatch.setattr(results, "write_ablation", lambda *_: wrote)
    return kept


def ablation(out, *options: str) -> int:
    return run(["--quiet", "evaluate", "--ablation", "--out", str(out), *options])


def test_by_default_two_men_of_each_stage_and_situation_are_run(ran, tmp_path) -> None:
    assert ablation(tmp_path / "a") == 0
    assert ablation(tmp_path / "b", "--quick") == 0
    men = tuple(case for case in ALL_CASES if case.sample == "man")
    assert len(men) == 5 * 4
    assert ran == [
        TableSettings(men, tuple(VARIANTS), 2, 40, FIRST_ABLATION_SEED),
        TableSettings(men, tuple(VARIANTS), 1, 5, FIRST_ABLATION_SEED, is_quick=True),
    ]


def test_what_is_chosen_stands_in_the_order_of_the_tables(ran, tmp_path) -> None:
    chosen = ["--samples", "adult", "man", "--stages", "spacer", "--situations", "overlay"]
    assert ablation(tmp_path / "a", *chosen, "--tests", "3", "--frames", "4", "--seed", "0") == 0
    (settings,) = ran
    assert [case.name for case in settings.cases] == ["man-spacer-overlay", "adult-spacer-overlay"]
    assert (settings.n_tests, settings.n_frames, settings.first_seed) == (3, 4, 0)


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (["--quick", "--tests", "2"], "--quick is one knee and 5 frames a case"),
        (["--tests", "0"], "--tests must be from 1 to 100"),
        (["--frames", "0"], "--frames must be at least 1"),
        (["--seed", "-1"], "--seed must not be negative"),
        (["--methods", "bimcc"], "--methods cannot be used with --ablation: leave one of them out"),
        (["--axes", "light"], "--axes cannot be used with --ablation"),
        (["--stress"], "--stress and --ablation are two evaluations: run one at a time"),
        (["--recording", "pairs"], "--recording and --ablation are two evaluations"),
    ],
)
def test_what_makes_no_sense_is_refused_in_one_sentence(
    ran, tmp_path, capsys, options, told
) -> None:
    assert ablation(tmp_path / "a", *options) == 2
    error = capsys.readouterr().err
    assert told in error
    assert "Traceback" not in error
    assert ran == []
    assert not (tmp_path / "a").exists()


@pytest.mark.release
@pytest.mark.slow
def test_a_quick_look_at_one_case_from_end_to_end(tmp_path, capsys, monkeypatch) -> None:
    out = tmp_path / "a"
    options = ["--ablation", "--stages", "opening", "--situations", "overlay", "--quick", "--seed",
               "1", "--processes", "1", "--out", str(out)]  # fmt: skip
    done = subprocess.run(
        [sys.executable, "-m", "navapp", "evaluate", *options], env=make_child_environment(),
        capture_output=True, text=True, timeout=170, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "a trial run, no results" in done.stdout
    assert "without contour: 5 of 5 frames OK" in done.stdout
    content = json.loads((out / "ablation.json").read_text())
    rows = {row["variant"]: row for row in content["rows"]}
    assert list(rows) == list(VARIANTS)
    assert rows["without filled depth"]["n_same"] == 5
    assert rows["without contour"]["n_same"] == 0
    assert all(0.0 < row["tre_ok_mm"] < 0.5 for row in rows.values())
    for name in ("ablation.md", "report.html", "frames.csv", "settings.json"):
        assert (out / name).stat().st_size > 0, name

    def refuse(*_, **__) -> None:
        raise AssertionError("a test is run again")

    monkeypatch.setattr(campaign, "run_test", refuse)
    assert run(["evaluate", *options, "--json", "-"]) == 0
    assert json.loads(capsys.readouterr().out)["rows"] == content["rows"]
    assert run(["--quiet", "evaluate", *options[1:]]) == 2
    assert "holds another evaluation" in capsys.readouterr().err
