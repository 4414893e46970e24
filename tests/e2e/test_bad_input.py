"""Bad input: one clear sentence, the right exit code, nothing half-written."""

import json
import os
from dataclasses import replace
from datetime import date
from pathlib import Path

import cv2
import numpy as np
import pytest

from navapp.cli.main import run
from navapp.geometry import RigQuality, StereoRig, write_rig
from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.ply import write_ply
from navapp.preop import write_plan
from navapp.values import Plan
from sim_devices.rigs import make_default_rig
from tests.bones import femur_model
from tests.devices.package_cameras import Entry, announce
from tests.sim_devices.plain_world import plain_rig


@pytest.fixture(scope="module")
def plan(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("plans") / "plan"
    write_plan(folder, Plan({"femur": femur_model()}))
    return folder


@pytest.fixture
def rig(tmp_path: Path) -> Path:
    write_rig(tmp_path / "rig.yml", make_default_rig(320, 180))
    return tmp_path / "rig.yml"


@pytest.fixture
def prior(tmp_path: Path) -> Path:
    pose = np.eye(4)
    pose[2, 3] = 450.0
    path = tmp_path / "prior.json"
    path.write_text(json.dumps({"camera_from_model": pose.tolist()}), encoding="utf-8")
    return path


@pytest.fixture
def pairs(tmp_path: Path) -> Path:
    folder = tmp_path / "pairs"
    folder.mkdir()
    noise = np.random.default_rng(1).integers(0, 255, (180, 320, 3), dtype=np.uint8)
    for number in range(4):
        for side in ("left", "right"):
            cv2.imwrite(str(folder / f"{side}_{number:04d}.jpg"), noise)
    return folder


def refused(
    arguments: list[str], capsys: pytest.CaptureFixture[str], code: int, *words: str
) -> None:
    """The command ends with that code and one sentence that holds the words."""
    capsys.readouterr()
    assert run(["--quiet", *arguments]) == code
    lines = capsys.readouterr().err.strip().splitlines()
    assert len(lines) == 1, lines
    assert lines[0].startswith("navapp: error: ")
    for word in words:
        assert word in lines[0]


def replay(pairs: Path, rig: Path, plan: Path, prior: Path) -> list[str]:
    return [
        "replay", str(pairs), "--rig", str(rig), "--plan", str(plan), "--prior", str(prior),
    ]  # fmt: skip


def test_a_missing_rig(pairs, plan, prior, tmp_path, capsys) -> None:
    missing = tmp_path / "none.yml"
    refused(replay(pairs, missing, plan, prior), capsys, 3, "none.yml", "does not exist")


def test_a_damaged_rig(pairs, rig, plan, prior, capsys) -> None:
    rig.write_bytes(rig.read_bytes()[:300])
    refused(replay(pairs, rig, plan, prior), capsys, 3, "rig.yml")


def test_a_rig_of_another_size(pairs, rig, plan, prior, tmp_path, capsys) -> None:
    write_rig(rig, make_default_rig(640, 360))
    out = tmp_path / "o.json"
    arguments = [*replay(pairs, rig, plan, prior), "--json", str(out), "--overlay", str(out) + "d"]
    refused(arguments, capsys, 3, "320x180", "640x360")
    assert not out.exists()
    assert not Path(str(out) + "d").exists()


def test_a_rig_that_was_not_accepted(pairs, rig, plan, prior, capsys) -> None:
    good = make_default_rig(320, 180)
    bad = StereoRig(
        good.left, good.right, good.right_from_left, quality=RigQuality(False, ("too few views",))
    )
    write_rig(rig, bad)
    refused(replay(pairs, rig, plan, prior), capsys, 3, "too few views", "--allow-unaccepted")


def expire(rig: Path, width: int, height: int) -> None:
    over = RigQuality(True, made_on=date(2020, 1, 1), expires_on=date(2020, 6, 29))
    write_rig(rig, replace(plain_rig(width, height), quality=over, name="bench"))


def test_an_expired_rig_starts_no_session(rig, plan, prior, tmp_path, monkeypatch, capsys) -> None:
    entry = Entry()
    announce(monkeypatch, [entry])
    expire(rig, 64, 48)
    settings = tmp_path / "navapp.toml"
    settings.write_text('[camera]\nbackend = "acme"\n', encoding="utf-8")
    arguments = ["--config", str(settings), "run", "--headless", "--rig", str(rig)]
    arguments += ["--plan", str(plan), "--prior", str(prior), "--allow-unaccepted"]
    refused(arguments, capsys, 3, "rig bench expired on 2020-06-29", "calibrate again")


def test_what_was_recorded_with_a_rig_may_be_replayed_after_its_time(
    pairs, rig, plan, prior, capsys
) -> None:
    expire(rig, 320, 180)
    refused(replay(pairs, rig, plan, prior), capsys, 4, "no frame was OK")


def test_unequal_counts(pairs, rig, plan, prior, capsys) -> None:
    (pairs / "right_0003.jpg").unlink()
    refused(replay(pairs, rig, plan, prior), capsys, 3, "3")


def test_a_corrupt_picture_in_the_middle(pairs, rig, plan, prior, tmp_path, capsys) -> None:
    picture = pairs / "left_0002.jpg"
    picture.write_bytes(picture.read_bytes()[:2000])
    out = tmp_path / "o.json"
    arguments = [*replay(pairs, rig, plan, prior), "--json", str(out)]
    refused(arguments, capsys, 3, "left_0002.jpg")
    assert not out.exists()


def test_a_missing_sequence(rig, plan, prior, tmp_path, capsys) -> None:
    refused(replay(tmp_path / "nowhere", rig, plan, prior), capsys, 3, "nowhere")


def test_an_empty_plan(pairs, rig, prior, tmp_path, capsys) -> None:
    (tmp_path / "empty").mkdir()
    refused(replay(pairs, rig, tmp_path / "empty", prior), capsys, 3, "empty", "navapp plan")


def test_a_plan_that_was_cut_short(pairs, rig, plan, prior, tmp_path, capsys) -> None:
    import shutil

    copy = tmp_path / "copy"
    shutil.copytree(plan, copy)
    (copy / "femur.ply").write_bytes((plan / "femur.ply").read_bytes()[:-100])
    refused(replay(pairs, rig, copy, prior), capsys, 3, "copy", "femur.ply")


def test_a_damaged_prior(pairs, rig, plan, prior, capsys) -> None:
    prior.write_text('{"camera_from_model": [[1, 0], [0, 1]]}', encoding="utf-8")
    refused(replay(pairs, rig, plan, prior), capsys, 3, "prior.json")


def test_an_unknown_key_in_the_configuration(tmp_path, capsys) -> None:
    path = tmp_path / "c.toml"
    path.write_text("[camera.simulated]\nsacle = 0.5\n", encoding="utf-8")
    refused(
        ["--config", str(path), "run", "--headless", "--frames", "2"],
        capsys, 2, "camera.simulated.sacle", "scale",
    )  # fmt: skip


def test_a_misspelt_fault_in_the_configuration(tmp_path, capsys) -> None:
    path = tmp_path / "c.toml"
    path.write_text(
        '[camera.simulated]\nfaults = [{ kind = "melt", start_s = 0, duration_s = 1 }]\n',
        encoding="utf-8",
    )
    refused(["--config", str(path), "config", "show"], capsys, 2, "faults.0.kind", "unplug")


def test_more_cartilage_than_the_simulator_has(tmp_path, capsys) -> None:
    path = tmp_path / "c.toml"
    path.write_text("[camera.simulated]\ncartilage_mm = 2.7\n", encoding="utf-8")
    refused(
        ["--config", str(path), "run", "--headless", "--frames", "2"],
        capsys, 2, "camera.simulated.cartilage_mm", "2.6",
    )  # fmt: skip


def test_a_missing_configuration(tmp_path, capsys) -> None:
    refused(
        ["--config", str(tmp_path / "c.toml"), "config", "show"], capsys, 2, "c.toml", "config init"
    )


def test_no_plan_at_all(pairs, rig, prior, capsys) -> None:
    refused(["replay", str(pairs), "--rig", str(rig), "--prior", str(prior)], capsys, 2, "--plan")


def test_no_rig_at_all(pairs, plan, prior, capsys) -> None:
    arguments = ["replay", str(pairs), "--plan", str(plan), "--prior", str(prior)]
    refused(arguments, capsys, 2, "--rig")


def test_a_bone_that_the_plan_does_not_have(pairs, rig, plan, prior, capsys) -> None:
    refused([*replay(pairs, rig, plan, prior), "--bone", "tibia"], capsys, 2, "tibia", "femur")


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--also", "tibia"], ("no bone 'tibia'", "femur")),
        (["--also", "femur"], ("the femur is followed anyway", "--also")),
    ],
)
def test_a_bone_beside_that_cannot_be_followed(
    pairs, rig, plan, prior, capsys, options, words
) -> None:
    refused([*replay(pairs, rig, plan, prior), *options], capsys, 2, *words)


def test_a_bone_beside_of_which_nothing_is_known(pairs, rig, prior, tmp_path, capsys) -> None:
    """A tibia is found from the femur; a patella is not."""
    bones = {name: replace(femur_model(), name=name) for name in ("femur", "patella")}
    write_plan(tmp_path / "two", Plan(bones))
    arguments = [*replay(pairs, rig, tmp_path / "two", prior), "--also", "patella"]
    refused(arguments, capsys, 3, "where the patella is", "camera_from_model_patella")


@pytest.mark.parametrize(("option", "word"), [("--frames", "0 frames"), ("--fps", "a rate of 0")])
def test_a_replay_of_nothing(pairs, rig, plan, prior, capsys, option, word) -> None:
    refused([*replay(pairs, rig, plan, prior), option, "0"], capsys, 2, word)


def test_pingpong_without_an_end(pairs, rig, plan, prior, capsys) -> None:
    arguments = [*replay(pairs, rig, plan, prior), "--order", "pingpong"]
    refused(arguments, capsys, 2, "--frames")


def test_json_into_a_folder_that_does_not_exist(pairs, rig, plan, prior, tmp_path, capsys) -> None:
    arguments = [*replay(pairs, rig, plan, prior), "--json", str(tmp_path / "no" / "o.json")]
    refused(arguments, capsys, 3, "o.json")


def test_a_surface_that_is_no_surface(tmp_path, capsys) -> None:
    path = tmp_path / "f.ply"
    path.write_bytes(b"ply\nformat ascii 1.0\n")
    out = tmp_path / "plan"
    refused(["plan", "--surface", f"femur={path}", "--out", str(out)], capsys, 3, "f.ply")
    assert not out.exists()
    assert [entry.name for entry in tmp_path.iterdir()] == ["f.ply"]


def test_a_surface_in_metres(tmp_path, capsys) -> None:
    mesh = femur_model().mesh
    write_ply(tmp_path / "f.ply", TriangleMesh(mesh.vertices_mm / 1000.0, mesh.faces))
    arguments = ["plan", "--surface", f"femur={tmp_path / 'f.ply'}", "--out", str(tmp_path / "p")]
    refused(arguments, capsys, 3, "1000")


def test_a_plan_over_something_else(tmp_path, capsys) -> None:
    write_ply(tmp_path / "f.ply", femur_model().mesh)
    precious = tmp_path / "precious"
    precious.mkdir()
    (precious / "thesis.txt").write_text("years of work", encoding="utf-8")
    arguments = ["plan", "--surface", f"femur={tmp_path / 'f.ply'}", "--out", str(precious)]
    refused(arguments, capsys, 3, "precious")
    assert (precious / "thesis.txt").read_text(encoding="utf-8") == "years of work"


def test_wrong_usage_is_exit_code_2(capsys) -> None:
    assert run(["run", "--no-such-option"]) == 2
    assert run([]) == 2
    assert run(["run", "--frames", "0"]) == 2
    assert run(["run", "--headless", "--stage", "sewing"]) == 2


def test_a_word_that_is_nearly_a_verb_is_told(capsys) -> None:
    assert run(["replya", "x"]) == 2
    assert "did you mean 'replay'?" in capsys.readouterr().err
    assert run(["zzz"]) == 2
    assert "did you mean" not in capsys.readouterr().err


@pytest.mark.parametrize(
    "verb", ["run", "replay", "plan", "prior", "stereo", "register", "devices", "doctor", "config"]
)
def test_every_verb_has_help_with_an_example(verb: str, capsys) -> None:
    assert run([verb, "--help"]) == 0
    assert "example" in capsys.readouterr().out


def test_no_color_reaches_the_screen_by_its_usual_name(monkeypatch, capsys) -> None:
    monkeypatch.setenv("NO_COLOR", "")
    assert run(["--no-color", "config", "show"]) == 0
    assert os.environ["NO_COLOR"] == "1"


def test_the_configurations_path_is_null_without_a_file(tmp_path, monkeypatch, capsys) -> None:
    monkeypatch.chdir(tmp_path)
    assert run(["config", "show", "--json", "-"]) == 0
    assert json.loads(capsys.readouterr().out)["path"] is None
    assert run(["config", "init", "--json", "-"]) == 0
    assert json.loads(capsys.readouterr().out)["path"] == "navapp.toml"


def test_a_rig_with_its_cameras_swapped(pairs, rig, plan, prior, tmp_path, capsys) -> None:
    good = make_default_rig(320, 180)
    swapped = StereoRig(
        good.right,
        good.left,
        good.right_from_left.inverse().rename("right", "left"),
        name="swapped",
    )
    write_rig(rig, swapped)
    refused(replay(pairs, rig, plan, prior), capsys, 3, "swapped", "right of the left")


def test_a_corrupt_picture_leaves_no_half_of_an_overlay(pairs, rig, plan, prior, tmp_path, capsys):
    picture = pairs / "right_0002.jpg"
    picture.write_bytes(picture.read_bytes()[:2000])
    before = set(tmp_path.iterdir())
    arguments = [*replay(pairs, rig, plan, prior), "--overlay", str(tmp_path / "o")]
    refused(arguments, capsys, 3, "right_0002.jpg")
    assert set(tmp_path.iterdir()) == before


def test_an_overlay_that_cannot_be_a_folder(pairs, rig, plan, prior, tmp_path, capsys) -> None:
    (tmp_path / "file").write_text("", encoding="utf-8")
    for target in ("file", "file/inside"):
        arguments = [*replay(pairs, rig, plan, prior), "--overlay", str(tmp_path / target)]
        refused(arguments, capsys, 3, target)


def test_json_into_a_folder_instead_of_a_file(pairs, rig, plan, prior, tmp_path, capsys) -> None:
    arguments = [*replay(pairs, rig, plan, prior), "--json", str(tmp_path)]
    refused(arguments, capsys, 3, str(tmp_path))


def test_no_start_pose(pairs, rig, plan, prior, capsys) -> None:
    arguments = ["replay", str(pairs), "--rig", str(rig), "--plan", str(plan)]
    refused(arguments, capsys, 3, "femur", "--prior")
    prior.write_text(json.dumps({}), encoding="utf-8")
    refused([*arguments, "--prior", str(prior)], capsys, 3, "camera_from_model")


@pytest.mark.parametrize(
    ("script", "word"),
    [
        ('[[step]]\ndo = "stage"\nstage = 2\n', "stage"),
        ('[[step]]\ndo = "register"\nat_frame = "x"\n', "at_frame"),
        ('[[step]]\ndo = "sew"\n', "do"),
        ('[[step]]\ndo = "register"\nat_fram = 3\n', "at_frame"),
        ('[[step]]\ndo = "stage"\nstage = "sewing"\n', "sewing"),
        ("step = 5\n", "step"),
        ("[[step]\n", "TOML"),
        ("", "step"),
    ],
)
def test_an_operators_script_that_is_none(script, word, tmp_path, capsys) -> None:
    path = tmp_path / "script.toml"
    path.write_text(script, encoding="utf-8")
    refused(["run", "--headless", "--operator", str(path)], capsys, 2, word)


def test_another_camera_than_the_rigs(tmp_path, capsys) -> None:
    path = tmp_path / "c.toml"
    path.write_text(
        "[camera.simulated]\nscale = 0.25\n"
        'faults = [{ kind = "wrong_serial", start_s = 0.0, duration_s = 100.0 }]\n',
        encoding="utf-8",
    )
    arguments = ["--config", str(path), "run", "--headless", "--frames", "3"]
    refused(arguments, capsys, 5, "serial", "SIM-L")


def test_a_camera_that_stays_away_ends_the_session(tmp_path, capsys) -> None:
    path, out, script = (tmp_path / name for name in ("c.toml", "o.json", "idle.toml"))
    script.write_text('[[step]]\ndo = "show"\n', encoding="utf-8")
    path.write_text(
        "[camera.simulated]\nscale = 0.25\n"
        'faults = [{ kind = "unplug", start_s = 0.3, duration_s = 1000.0 }]\n',
        encoding="utf-8",
    )
    arguments = ["--config", str(path), "run", "--headless", "--frames", "40", "--json", str(out)]
    refused([*arguments, "--operator", str(script)], capsys, 5, "camera")
    assert 1 < len(json.loads(out.read_text(encoding="utf-8"))["frames"]) < 10
