"""`navapp evaluate --recording` and `navapp replay --truth` on a phantom, and what they refuse."""

import csv
import json
import shutil
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from navapp.cli import evaluate_recording
from navapp.cli.diagnostics import Diagnostics
from navapp.cli.main import run
from navapp.errors import ResultError
from navapp.geometry.ply import read_ply
from navapp.preop import build_aspects, write_plan
from navapp.values import BoneModel, Plan
from tests.few_sides import FEW_SIDES

pytestmark = pytest.mark.usefixtures("empty_plots")


@pytest.fixture(scope="module")
def plan(data, tmp_path_factory) -> Path:
    bone = BoneModel("femur", read_ply(data / "phantom_a" / "femur.ply")[0], "right")
    aspects = build_aspects(bone, settings=FEW_SIDES)
    folder: Path = tmp_path_factory.mktemp("phantom") / "plan"
    write_plan(folder, Plan({"femur": bone}, aspects={"femur": aspects}))
    return folder


@pytest.fixture
def recordings(data, tmp_path) -> Path:
    """The first pictures of two operations, each with its truth and its start."""
    folder = tmp_path / "recordings"
    for name, n_pairs in (("patient", 4), ("instrument", 3)):
        whole = data / "phantom_a" / name
        (folder / name).mkdir(parents=True)
        for n in range(n_pairs):
            for side in ("left", "right"):
                shutil.copy(whole / f"{side}_{n:04d}.jpg", folder / name)
        shutil.copy(whole / "prior.json", folder / name)
        truth = json.loads((whole / "truth.json").read_text("utf-8"))
        truth["frames"] = truth["frames"][:n_pairs]
        (folder / name / "truth.json").write_text(json.dumps(truth), "utf-8")
    shutil.copy(data / "phantom_a" / "rig.yml", folder)
    return folder


def evaluate(*words: object) -> int:
    return run(["--quiet", "evaluate", *(str(word) for word in words)])


def test_recordings_in_a_folder_are_a_row_each(plan, recordings, tmp_path) -> None:
    out = tmp_path / "out"
    words = ("--plan", plan, "--methods", "bimcc", "--out", out)
    assert evaluate("--recording", recordings, *words) == 0
    content = json.loads((out / "evaluate.json").read_text("utf-8"))
    assert [row["sample"] for row in content["rows"]] == [
        "recordings/instrument",
        "recordings/patient",
    ]
    for row, n_frames in zip(content["rows"], (2, 3), strict=True):
        assert (row["situation"], row["method"]) == ("recording", "bimcc")
        assert row["frames"] == row["frames_with_truth"] == n_frames
        assert row["ok_share"] == 1.0
        assert 0.0 < row["tre_mm"] < 0.3
        assert row["wrong_and_ok"] == 0
    told = content["summary"]["recordings"]["recordings/patient"]["truth"]
    assert (told["kind"], told["pictures"]) == ("poses", 4)


def test_touched_points_of_one_recording(plan, recordings, tmp_path) -> None:
    sequence = recordings / "patient"
    frames = json.loads((sequence / "truth.json").read_text("utf-8"))["frames"]
    divots = {"a": [20.0, -5.0, 10.0], "b": [-15.0, 0.0, 5.0]}
    touched = [
        {
            "index": 2,
            "name": name,
            "left_mm": (np.array(frames[2]["T_leftcam_from_ct"]["femur"]) @ [*place, 1.0])[
                :3
            ].tolist(),
        }
        for name, place in divots.items()
    ]
    truth = tmp_path / "touched.json"
    truth.write_text(json.dumps({"divots": divots, "touched": touched, "sd_mm": 0.1}), "utf-8")
    words = ("--plan", plan, "--rig", recordings / "rig.yml", "--methods", "bimcc")
    out = tmp_path / "out"
    assert evaluate("--recording", sequence, "--truth", truth, *words, "--out", out) == 0
    rows = list(csv.DictReader((out / "frames.csv").read_text("utf-8").splitlines()))
    assert [bool(row["tre_mm"]) for row in rows] == [False, True, False]
    assert 0.0 < float(rows[1]["tre_mm"]) < 0.4
    assert "2 points of the femur, touched 2 times" in (out / "tables.md").read_text("utf-8")


@pytest.mark.release
def test_a_motion_of_a_moment_does_not_determine_another_tracker(
    plan, recordings, tmp_path, capsys
) -> None:
    poses = [{"time_ns": n * 20_000_000, "matrix": np.eye(4).tolist()} for n in range(50)]
    truth = tmp_path / "tracker.json"
    truth.write_text(json.dumps({"poses": poses}), "utf-8")
    words = ("--plan", plan, "--rig", recordings / "rig.yml", "--methods", "bimcc")
    out = tmp_path / "out"
    sequence = recordings / "instrument"
    assert evaluate("--recording", sequence, "--truth", truth, *words, "--out", out) == 4
    (line,) = capsys.readouterr().err.strip().splitlines()
    assert "cannot be solved" in line
    assert not out.exists()


def test_a_replay_tells_the_error_of_every_frame(plan, recordings, tmp_path, capsys) -> None:
    sequence, poses = recordings / "patient", tmp_path / "poses.json"
    command = [
        "replay", sequence, "--rig", recordings / "rig.yml", "--plan", plan,
        "--prior", sequence / "prior.json", "--truth", sequence / "truth.json", "--json", poses,
    ]  # fmt: skip
    assert run([str(word) for word in command]) == 0
    content = json.loads(poses.read_text("utf-8"))
    errors = [frame["tre_mm"] for frame in content["frames"]]
    assert len(errors) == 4
    assert all(0.0 < error < 0.3 for error in errors)
    assert content["summary"]["tre_mm"]["max"] == pytest.approx(max(errors[1:]))
    told = capsys.readouterr()
    assert "TRE against the truth, while navigating: median" in told.out
    (line,) = (one for one in told.err.splitlines() if "frame 2 " in one)
    assert line.endswith(f"TRE of the femur {errors[2]:.3f} mm")


@pytest.mark.parametrize(
    ("words", "code", "told"),
    [
        (("--truth", "t.json"), 2, "--truth means nothing without --recording: add --recording"),
        (("--allow-unaccepted",), 2, "--allow-unaccepted means nothing without --recording"),
        (("--recording", "x", "--seed", "3"), 2, "--seed cannot be used with --recording"),
        (
            ("--recording", "x", "--stages", "opening"),
            2,
            "--stages cannot be used with --recording",
        ),
        (("--recording", "nowhere", "--truth", "t"), 3, "there is no recording nowhere"),
        (("--recording", "x"), 2, "nothing says where the bone was in x"),
        (("--recording", "x", "--truth", "t", "--fps", "0"), 2, "0 Hz"),
        (("--recording", "x", "--truth", "t"), 2, "no plan is given"),
        (("--recording", "x", "--truth", "t", "--plan", "p"), 2, "no rig is given"),
        (("--recording", "x", "--truth", "t.json", "--plan", "p", "--rig", "r"), 3, "truth t.json"),
    ],
)
def test_what_does_not_fit_is_refused(tmp_path, capsys, monkeypatch, words, code, told) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "x").mkdir()
    assert evaluate(*words, "--out", tmp_path / "out") == code
    (line,) = capsys.readouterr().err.strip().splitlines()
    assert told in line
    assert not (tmp_path / "out").exists()


def test_each_of_several_recordings_has_its_own_truth(tmp_path, capsys) -> None:
    for name in ("truth", "prior"):
        (tmp_path / "several" / "one").mkdir(parents=True, exist_ok=True)
        (tmp_path / "several" / "one" / f"{name}.json").write_text("{}")
    words = ("--recording", tmp_path / "several", "--truth", "t.json", "--out", tmp_path / "out")
    assert evaluate(*words) == 2
    assert "each with its own truth.json" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("content", "code", "told"),
    [
        ({"poses": [{"time_ns": 1, "matrix": np.eye(4).tolist()}]}, 2, "holds no poses of bones"),
        (
            {"frames": [{"index": 9, "camera_from_model": {"femur": np.eye(4).tolist()}}]},
            3,
            "speaks of picture 9",
        ),
    ],
)
def test_a_replay_refuses_a_truth_that_does_not_fit(
    plan, recordings, tmp_path, capsys, content, code, told
) -> None:
    sequence, truth = recordings / "patient", tmp_path / "truth.json"
    truth.write_text(json.dumps(content), "utf-8")
    command = [
        "replay", sequence, "--rig", recordings / "rig.yml", "--plan", plan,
        "--prior", sequence / "prior.json", "--truth", truth,
    ]  # fmt: skip
    assert run(["--quiet", *(str(word) for word in command)]) == code
    assert told in capsys.readouterr().err


def several(tmp_path, *names: str) -> Path:
    """A folder of recordings of which only the truth is there."""
    for name in names:
        (tmp_path / "several" / name).mkdir(parents=True)
        (tmp_path / "several" / name / "truth.json").write_text("{}")
    return tmp_path / "several"


def test_recordings_without_a_start_are_named(tmp_path, capsys) -> None:
    folder = several(tmp_path, "a", "b", "c")
    (folder / "b" / "prior.json").write_text("{}")
    (folder / "c" / "session.json").write_text("{}")
    options = SimpleNamespace(recording=str(folder), truth=None, prior=None)
    found = evaluate_recording._list_sequences(options, Diagnostics())
    assert [(one.name, one.prior_path) for one in found] == [
        ("several/b", str(folder / "b" / "prior.json")),
        ("several/c", None),  # a session brings its own
    ]
    told = capsys.readouterr().err
    assert f"{folder / 'a'} is left out: nothing says where the bone is (prior.json)" in told
    assert told.count("left out") == 1


def test_one_recording_that_fails_does_not_lose_the_others(monkeypatch, capsys) -> None:
    def study(given, methods, diagnostics):
        if given.study.name == "bad":
            raise ResultError("cannot be solved", remedy="move more")
        return given.study.name

    monkeypatch.setattr(evaluate_recording, "_study", study)
    good, bad = (SimpleNamespace(study=SimpleNamespace(name=name)) for name in ("good", "bad"))
    studied, failures = evaluate_recording._study_all([bad, good], ("bimcc",), Diagnostics())
    assert (studied, len(failures)) == (["good"], 1)
    assert "bad is left out: cannot be solved: move more" in capsys.readouterr().err
    for none in ([bad], [bad, bad]):
        with pytest.raises(ResultError, match="cannot be solved"):
            evaluate_recording._study_all(none, ("bimcc",), Diagnostics())


def test_every_truth_is_read_before_anything_is_followed(
    plan, recordings, tmp_path, monkeypatch, capsys
) -> None:
    folder = tmp_path / "copied"
    shutil.copytree(recordings, folder)
    (folder / "patient" / "truth.json").write_text("{")

    def refuse(*_: object) -> None:
        raise AssertionError("a recording is followed")

    monkeypatch.setattr(evaluate_recording, "_study", refuse)
    assert evaluate("--recording", folder, "--plan", plan, "--out", tmp_path / "out") == 3
    assert "patient/truth.json cannot be understood" in capsys.readouterr().err
