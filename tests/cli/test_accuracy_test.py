"""`navapp accuracy-test`: what it refuses, and a whole place on simulated devices."""

import csv
import json

import pytest

from navapp.cli.main import run


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--places", "6"], "--places must be from 1 to 5"),
        (["--divots", "plate.json"], "the simulated divot plate is built in"),
    ],
)
def test_wrong_options_are_refused(options, words, capsys) -> None:
    assert run(["accuracy-test", *options]) == 2
    assert words in capsys.readouterr().err


def test_a_folder_with_files_is_not_written_to(tmp_path, capsys) -> None:
    (tmp_path / "mine.txt").write_text("mine", encoding="utf-8")
    assert run(["accuracy-test", "--out", str(tmp_path)]) == 2
    assert "is not an empty folder" in capsys.readouterr().err
    assert [one.name for one in tmp_path.iterdir()] == ["mine.txt"]


def test_real_devices_need_a_plate_and_a_pointer(tmp_path, capsys) -> None:
    (tmp_path / "real.toml").write_text('[camera]\nbackend = "opencv"\n', encoding="utf-8")
    config = ["--config", str(tmp_path / "real.toml")]
    assert run([*config, "accuracy-test"]) == 2
    assert "--divots PLATE.json" in capsys.readouterr().err
    plate = tmp_path / "plate.json"
    plate.write_text('{"points_mm": [[0, 0, 0], [9, 0, 0], [0, 9, 0]]}', encoding="utf-8")
    assert run([*config, "accuracy-test", "--divots", str(plate)]) == 2
    assert "[tools] pointer" in capsys.readouterr().err


@pytest.mark.slow
@pytest.mark.release
def test_a_place_on_simulated_devices(tmp_path, capsys) -> None:
    out = tmp_path / "accuracy"
    assert run(["accuracy-test", "--places", "1", "--out", str(out)]) == 0
    content = json.loads((out / "accuracy.json").read_text(encoding="utf-8"))
    assert content["tasks_done"] == content["tasks"] == 26
    assert content["places"]["centre"]["distances"]["n"] == 190
    assert content["distances"]["rms_mm"] < 0.2
    # Against where the divots really were, with what is told of itself.
    assert content["against_truth"]["max_mm"] < 0.5
    with (out / "points.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 23 * 8 + 3 * 15
    assert max(float(row["bound_mm"]) for row in rows) > content["against_truth"]["mean_mm"]
    assert "190 distances" in capsys.readouterr().out
    assert (out / "report.html").exists()
