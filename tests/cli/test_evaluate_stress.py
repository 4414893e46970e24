"""`navapp evaluate --stress`: its options, and one axis from end to end."""

import json
import subprocess
import sys

import pytest

from drivers.child_python import make_child_environment
from navapp.cli.main import run
from navapp.evaluation import campaign
from navapp.evaluation.stress import results
from navapp.evaluation.stress.axes import AXES, FIRST_STRESS_SEED
from navapp.evaluation.stress.matrix import StressSettings


@pytest.fixture
def ran(monkeypatch) -> list[StressSettings]:
    """What would be run; nothing is."""
    kept = []
    summary = {"quick": False, "judged": {"ok": 0, "frames": 0, "wrong_and_ok": 0},
               "wrong_and_ok_on": []}  # fmt: skip
    monkeypatch.setattr(campaign, "run_campaign", lambda _, settings, *__: kept.append(settings))
    monkeypatch.setattr(results, "write_stress", lambda *_: {"summary": summary})
    return kept


def stress(out, *options: str) -> int:
    return run(["--quiet", "evaluate", "--stress", "--out", str(out), *options])


def test_by_default_all_axes_are_run_on_five_knees(ran, tmp_path) -> None:
    assert stress(tmp_path / "a") == 0
    assert stress(tmp_path / "b", "--quick") == 0
    assert ran == [
        StressSettings(tuple(AXES), 5, 20, FIRST_STRESS_SEED),
        StressSettings(tuple(AXES), 1, 3, FIRST_STRESS_SEED, is_quick=True),
    ]


def test_what_is_chosen_stands_in_the_order_of_the_table(ran, tmp_path) -> None:
    chosen = ["--axes", "blood", "light", "--tests", "2", "--frames", "4", "--seed", "7"]
    assert stress(tmp_path / "a", *chosen) == 0
    assert ran == [StressSettings(("light", "blood"), 2, 4, 7)]


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (["--quick", "--tests", "2"], "--quick is one knee"),
        (["--tests", "0"], "--tests must be from 1 to 100"),
        (["--tests", "101"], "--tests must be from 1 to 100"),
        (["--frames", "0"], "--frames must be at least 1"),
        (["--processes", "0"], "--processes must be at least 1"),
        (["--seed", "-1"], "--seed must not be negative"),
        (["--axes", "light", "moon"], "there is no axis 'moon': use turn-sideways, "),
        (["--methods", "icp"], "--methods cannot be used with --stress"),
        (["--stages", "opening"], "--stages cannot be used with --stress"),
        (["--recording", "pairs"], "--recording and --stress are two evaluations"),
    ],
)
def test_what_makes_no_sense_is_refused_in_one_sentence(
    ran, tmp_path, capsys, options, told
) -> None:
    assert stress(tmp_path / "a", *options) == 2
    error = capsys.readouterr().err
    assert told in error
    assert "Traceback" not in error
    assert ran == []
    assert not (tmp_path / "a").exists()


def test_axes_are_of_the_stress_matrix(tmp_path, capsys) -> None:
    assert run(["--quiet", "evaluate", "--axes", "light", "--out", str(tmp_path / "a")]) == 2
    assert "add --stress" in capsys.readouterr().err


@pytest.mark.release
@pytest.mark.slow
def test_a_surface_beside_its_targets_is_off_by_as_much_and_looks_well(tmp_path) -> None:
    out = tmp_path / "a"
    options = ["--stress", "--axes", "shift", "--quick", "--seed", "1", "--processes", "1"]
    done = subprocess.run(
        [sys.executable, "-m", "navapp", "evaluate", *options, "--out", str(out)],
        env=make_child_environment(), capture_output=True, text=True, timeout=110, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "a trial run, no results" in done.stdout + done.stderr
    content = json.loads((out / "stress.json").read_text())
    (axis,) = content["axes"]
    assert axis["found_by"] == "the check on the patient"
    for row in axis["levels"]:
        assert row["n_frames"] == 3
        assert row["tre_any_mm"] == pytest.approx(row["level"], abs=0.2)
    assert content["summary"]["judged"]["wrong_and_ok"] == 0, "no level but 0 can be seen"
    assert axis["levels"][-1]["n_wrong"] == axis["levels"][-1]["n_ok"] > 0
    for name in ("stress.md", "report.html", "frames.csv", "settings.json"):
        assert (out / name).stat().st_size > 0, name
