"""`navapp evaluate`: its options, one case from end to end, and what it refuses."""

import argparse
import json
import subprocess
import sys
from pathlib import Path

import pytest

from drivers.child_python import make_child_environment
from navapp.cli import evaluate
from navapp.cli.main import _parser, run
from navapp.evaluation import campaign
from navapp.evaluation.methods import METHODS
from navapp.evaluation.paper import results
from navapp.evaluation.paper.cases import (
    ALL_CASES,
    FIRST_SEED,
    SAMPLES,
    SITUATIONS,
    STAGE_NAMES,
)
from navapp.evaluation.paper.settings import TableSettings

ONE_CASE = ["--samples", "man", "--stages", "opening", "--situations", "overlay"]
QUICK = [*ONE_CASE, "--methods", "bimcc", "--quick", "--seed", "1"]


def parser_of_evaluate() -> argparse.ArgumentParser:
    (verbs,) = (one for one in _parser()._actions if isinstance(one, argparse._SubParsersAction))
    return verbs.choices["evaluate"]


@pytest.mark.parametrize(
    ("option", "names"),
    [
        ("--samples", tuple(SAMPLES)),
        ("--stages", STAGE_NAMES),
        ("--situations", tuple(SITUATIONS)),
        ("--methods", METHODS),
    ],
)
def test_the_words_of_the_options_are_those_of_the_tables(option, names) -> None:
    (action,) = (one for one in parser_of_evaluate()._actions if option in one.option_strings)
    assert tuple(action.choices) == names
    assert len(names) == len(set(names))


@pytest.fixture
def ran(monkeypatch) -> list[TableSettings]:
    """What would be run; nothing is."""
    kept = []
    monkeypatch.setattr(campaign, "run_campaign", lambda _, settings, *__: kept.append(settings))
    return kept


def test_by_default_the_whole_of_the_tables_is_run(ran, tmp_path, monkeypatch) -> None:
    wrote = {"summary": {"quick": False, "judged": {}, "beside_the_paper": {"cases": 0}}}
    monkeypatch.setattr(results, "write_results", lambda *_: wrote)
    assert run(["--quiet", "evaluate", "--out", str(tmp_path / "a")]) == 0
    (settings,) = ran
    assert settings == TableSettings(ALL_CASES, METHODS, 5, 40, FIRST_SEED, False)
    assert run(["--quiet", "evaluate", "--quick", "--out", str(tmp_path / "b")]) == 0
    assert ran[1] == TableSettings(ALL_CASES, METHODS, 1, 5, FIRST_SEED, True)


def test_what_is_chosen_stands_in_the_order_of_the_tables(ran, tmp_path) -> None:
    chosen = ["--situations", "patient", "overlay", "--methods", "bimcc", "icp", "--samples",
              "adult", "--stages", "spacer", "drilling"]  # fmt: skip
    options = ["--tests", "2", "--frames", "3", "--seed", "0", "--out", str(tmp_path / "a")]
    assert run(["--quiet", "evaluate", *chosen, *options]) == 0
    (settings,) = ran
    assert [case.name for case in settings.cases] == [
        "adult-drilling-overlay", "adult-drilling-patient", "adult-spacer-overlay",
        "adult-spacer-patient",
    ]  # fmt: skip
    assert settings.methods == ("icp", "bimcc")
    assert (settings.n_tests, settings.n_frames, settings.first_seed) == (2, 3, 0)


@pytest.mark.parametrize(
    ("options", "code", "words"),
    [
        (["--tests", "0"], 2, "--tests must be from 1 to 100"),
        (["--tests", "101"], 2, "--tests must be from 1 to 100"),
        (["--frames", "0"], 2, "--frames must be at least 1"),
        (["--processes", "0"], 2, "--processes must be at least 1"),
        (["--seed", "-1"], 2, "--seed must not be negative"),
        (["--quick", "--frames", "9"], 2, "leave out --tests and --frames"),
        (["--quick", "--tests", "2"], 2, "leave out --tests and --frames"),
        (["--stages", "dinner"], 2, "invalid choice: 'dinner'"),
        (["--methods"], 2, "expected at least one argument"),
        (["--json", "/nowhere/x.json"], 3, "does not exist"),
    ],
)
def test_what_cannot_be_meant_is_refused_and_makes_nothing(
    ran, tmp_path, capsys, options, code, words
) -> None:
    out = tmp_path / "out"
    assert run(["--quiet", "evaluate", *options, "--out", str(out)]) == code
    said = capsys.readouterr().err
    assert words in said
    assert "Traceback" not in said
    assert ran == []
    assert not out.exists()


def test_a_folder_is_required_and_must_be_its_own(ran, tmp_path, capsys) -> None:
    assert run(["evaluate"]) == 2
    assert "--out" in capsys.readouterr().err
    (tmp_path / "thesis.txt").touch()
    assert run(["--quiet", "evaluate", "--out", str(tmp_path)]) == 2
    assert "holds something else: choose a new folder for --out" in capsys.readouterr().err
    assert run(["--quiet", "evaluate", "--out", str(tmp_path / "thesis.txt" / "a")]) == 3
    assert "cannot be written" in capsys.readouterr().err
    assert ran == []


def test_help_needs_none_of_what_computes() -> None:
    code = (
        "import sys; from navapp.cli.main import run; run(['evaluate', '--help']);"
        "assert not {'numba', 'cv2', 'scipy', 'multiprocessing.spawn'} & set(sys.modules)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], env=make_child_environment(), capture_output=True, text=True,
        timeout=60, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert f"of each test ({evaluate._FRAMES}; 90 at least" in " ".join(done.stdout.split())


@pytest.fixture(scope="module")
def quick(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, "subprocess.CompletedProcess"]:
    """A quick look at one case, and what it said; nobody writes into its folder."""
    out = tmp_path_factory.mktemp("quick") / "out"
    command = [sys.executable, "-m", "navapp", "evaluate", *QUICK, "--processes", "1"]
    done = subprocess.run(
        [*command, "--out", str(out), "--json", "-"], env=make_child_environment(),
        capture_output=True, text=True, timeout=110, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return out, done


@pytest.mark.slow
def test_a_quick_look_at_one_case_from_end_to_end(quick) -> None:
    out, done = quick
    content = json.loads(done.stdout)
    assert content == json.loads((out / "evaluate.json").read_text())
    assert content["command"] == "evaluate"
    assert content["units"]["length"] == "mm"
    (row,) = content["rows"]
    assert (row["sample"], row["stage"], row["situation"]) == ("man", "opening", "overlay")
    assert (row["method"], row["frames"], row["seeds"]) == ("bimcc", 5, [101])
    assert row["ok_share"] == 1.0
    assert 0.0 < row["tre_mm"] < 0.5
    assert 0.0 < row["overlay_error_mm"] < 0.5
    assert row["fps"] > 1.0
    assert row["registration_s"] > 0.0
    assert content["summary"]["quick"] is True
    assert "1 tests, 1 at a time" in done.stderr
    assert {path.name for path in out.iterdir()} == {
        "settings.json", "tests", "times", "pictures", "tables.md", "report.html", "frames.csv",
        "stages.svg", "errors.svg", "evaluate.json",
    }  # fmt: skip
    assert len((out / "frames.csv").read_text().splitlines()) == 6
    assert "data:image/jpeg" in (out / "report.html").read_text()


@pytest.mark.release
def test_the_same_again_runs_nothing_and_says_the_same(quick, capsys, monkeypatch) -> None:
    out, done = quick

    def refuse(*_, **__) -> None:
        raise AssertionError("a test is run again")

    monkeypatch.setattr(campaign, "run_test", refuse)
    assert run(["evaluate", *QUICK, "--out", str(out), "--json", "-"]) == 0
    assert json.loads(capsys.readouterr().out) == json.loads(done.stdout)
    assert run(["evaluate", *QUICK, "--out", str(out)]) == 0
    said = capsys.readouterr().out
    assert "a trial run, no results" in said
    assert "bimcc: 5 of 5 frames OK, 0 of them wrong" in said
    assert "the paper's own figures" not in said, "no results, no comparison"


def test_other_options_in_the_same_folder_are_refused(quick, capsys) -> None:
    out, _ = quick
    assert run(["--quiet", "evaluate", *QUICK[:-1], "2", "--out", str(out)]) == 2
    assert "holds another evaluation: give the same options" in capsys.readouterr().err
