"""`navapp prior`: choices on a picture become a file, and are tried at once."""

import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from navapp.cli.main import run
from navapp.control.prior_files import read_prior
from navapp.geometry.rig_files import write_rig
from navapp.preop import write_plan
from navapp.values import Landmark, Plan, SurgicalContent
from tests.tracking.rooms import GOAL, room
from tests.tracking.test_picked_landmarks import picked

BOX = "0,0,1280,720"


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    """A pair of the room's pictures, its rig and a plan with three landmarks, as options."""
    folder, a = tmp_path_factory.mktemp("prior"), room()
    (folder / "pairs").mkdir()
    for name, picture in (("left", a.frames[0].left), ("right", a.frames[0].right)):
        cv2.imwrite(str(folder / "pairs" / f"{name}_0000.png"), picture)
    write_rig(folder / "rig.yml", a.rig)
    marks = {f"femur/{pick.name}": Landmark(pick.model_mm, None, "contents") for pick in picked(3)}
    content = SurgicalContent(landmarks=marks)
    write_plan(folder / "plan", Plan({"femur": a.tracker.model.bone}, content=content))
    words = ["pairs", "--plan", "plan", "--rig", "rig.yml"]
    return [word if word.startswith("--") else str(folder / word) for word in words]


def make(files: list[str], out: Path, *more: str) -> int:
    return run(["--quiet", "prior", *files, "--out", str(out), *more])


def points_of(error_px: float) -> list[str]:
    return [f"femur/{one.name}={one.left_px[0]},{one.left_px[1]}" for one in picked(3, error_px)]


@pytest.mark.release
def test_three_landmarks_make_a_prior_that_finds_the_bone(files, tmp_path) -> None:
    out, told = tmp_path / "prior.json", tmp_path / "told.json"
    assert make(files, out, "--points", *points_of(4.0), "--json", str(told)) == 0
    result = json.loads(told.read_text())
    assert (result["command"], result["status"], result["reasons"]) == ("prior", "OK", [])
    assert 0.0 < result["predicted_tre_mm"] < 0.5
    prior = read_prior(out)
    a = room()
    frame = a.frames[0]
    best = a.tracker.register(frame, prior, GOAL)[0]
    assert a.error_mm(best.left_from_bone, frame) < 0.3
    # What is there is kept.
    before = out.read_bytes()
    assert make(files, out, "--box", BOX) == 3
    assert out.read_bytes() == before


@pytest.mark.release
def test_a_box_where_no_bone_is_makes_a_file_and_says_so(files, tmp_path, capsys) -> None:
    out = tmp_path / "prior.json"
    assert make(files, out, "--box", "5,5,90,90") == 4
    said = capsys.readouterr().err
    assert "is written, but no pose is OK" in said
    assert read_prior(out).box == (5, 5, 90, 90)


@pytest.mark.release
def test_a_box_makes_a_prior_that_finds_the_bone(files, tmp_path) -> None:
    out = tmp_path / "prior.json"
    out.write_text("old")
    a = room()
    pixels = a.rig.left.project(a.truth(a.frames[0]).apply(bare_mm()))
    (x, y), (width, height) = pixels.min(axis=0), np.ptp(pixels, axis=0)
    box = f"{x - 6:.0f},{y + 6:.0f},{width + 6:.0f},{height - 6:.0f}"
    assert make(files, out, "--box", box, "--replace") == 0
    assert read_prior(out).box is not None


def bare_mm() -> np.ndarray:
    a = room()
    mesh = a.tracker.model.bone.mesh
    seen = mesh.vertices_mm[mesh.visible_vertices(a.truth(a.frames[0]))]
    return seen[seen[:, 2] < mesh.vertices_mm[:, 2].min() + 60.0]


@pytest.mark.release
def test_the_camera_gives_a_pair_as_a_recording_does(files, tmp_path, capsys) -> None:
    out, config = tmp_path / "prior.json", tmp_path / "c.toml"
    rest = ["--box", "5,5,90,90", "--out", str(out)]
    assert run(["--quiet", "prior", "-", *files[1:], *rest]) == 4
    assert read_prior(out).box == (5, 5, 90, 90)
    config.write_text("[camera.simulated]\nscale = 0.5\n")
    out.unlink()
    assert run(["--quiet", "--config", str(config), "prior", "-", *files[1:], *rest]) == 3
    assert "640x360" in capsys.readouterr().err
    assert not out.exists()


@pytest.mark.parametrize(
    ("more", "code", "words"),
    [
        ([], 2, "nothing tells where the bone is"),
        (["--box", "1,2,3"], 2, "takes 4 numbers"),
        (["--box", "1,2,x,4"], 2, "takes 4 numbers"),
        (["--box", "2000,5,10,10"], 2, "no box in a picture of 1280x720"),
        (["--box", "5,5,0,10"], 2, "no box in a picture of 1280x720"),
        (["--points", "femur/0=1,2", "femur/1=3,4"], 2, "2 points do not tell a pose"),
        (["--points", "femur/0=1,2", "femur/0=3,4", "femur/1=3,4"], 2, "each landmark once"),
        (["--points", "femur/nose=1,2"], 2, "choose of femur/0, femur/1, femur/2"),
        (["--points", "femur/0=9000,2"], 2, "is not in a picture of 1280x720"),
        (["--points", "femur/0=1,2", "--box", BOX], 2, "are two starts"),
        (["--points", "femur/0"], 2, "takes NAME=U,V, not 'femur/0'"),
        (["--points", "femur/0=1,2", "femur/1=3,4", "femur/2=90,4"], 2, "femur/0 and femur/1 are"),
        (["--box", BOX, "--bone", "tibia"], 2, "no model of the tibia"),
        (["--box", BOX, "--json", "/nowhere/x.json"], 3, "does not exist"),
    ],
)
def test_what_cannot_be_meant_is_refused_and_writes_nothing(
    files, tmp_path, capsys, more, code, words
) -> None:
    out = tmp_path / "prior.json"
    assert make(files, out, *more) == code
    assert words in capsys.readouterr().err
    assert not out.exists()


def test_picks_are_kept_in_the_file(tmp_path) -> None:
    path = tmp_path / "p.json"
    content = {"picks": [{"name": "a", "bone": "femur", "left_px": [1, 2], "model_mm": [3, 4, 5]}]}
    path.write_text(json.dumps(content))
    (pick,) = read_prior(path).picks
    assert (pick.name, pick.bone, pick.left_px) == ("a", "femur", (1.0, 2.0))
    np.testing.assert_array_equal(pick.model_mm, [3.0, 4.0, 5.0])
