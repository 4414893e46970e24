"""`navapp calibrate capture` without a screen."""

import json

import numpy as np
import pytest

from calibration.rig.parameters import RigModel, pack
from calibration.rig.uncertainty import make_working_points_mm
from navapp.cli.main import run
from navapp.geometry import read_rig
from navapp.geometry.triangulation import triangulate_mm
from sim_devices.rigs import make_default_rig

BOARD = {
    "type": "charuco", "squares_x": 8, "squares_y": 6, "square_mm": 20.0,
    "marker_mm": 14.0, "dictionary": "DICT_4X4_100",
}  # fmt: skip


# Slow: a hand that follows comes to its place in fewer pictures.
SLOW = "[camera]\nrate_hz = 6.0\n"


@pytest.fixture
def board(tmp_path):
    path = tmp_path / "board.json"
    path.write_text(json.dumps(BOARD))
    return str(path)


def capture(board, out, *more, config=None):
    options = ["calibrate", "capture", "--board", board, "--out", str(out), *more]
    return run(["--quiet", *(["--config", str(config)] if config else []), *options])


def true_error_mm(found):
    """Median over the working volume, against the rig that the simulated camera has."""
    true = make_default_rig()
    model = RigModel(5, 0, true.width, true.height)
    points_mm = make_working_points_mm(model, pack(model, true), (350.0, 550.0))
    left = true.left.project(points_mm)
    right = true.right.project(true.right_from_left.apply(points_mm))
    off_mm = triangulate_mm(found, left, right) - points_mm
    return float(np.median(np.linalg.norm(off_mm, axis=1)))


@pytest.mark.release
@pytest.mark.slow
def test_a_hand_that_follows_every_wish_gives_an_accepted_rig(board, tmp_path):
    config, out, result = tmp_path / "navapp.toml", tmp_path / "out", tmp_path / "result.json"
    config.write_text(SLOW)
    code = capture(board, out, "--headless", "--pairs", "8", "--json", str(result), config=config)
    told = json.loads(result.read_text())
    assert code == 0, told["reasons"]
    assert told["command"] == "calibrate capture"
    assert told["pairs_kept"] == told["views_used"] == 8
    assert told["accepted"]
    assert told["baseline_mm"] == pytest.approx(80.0, abs=0.15)
    names = {path.name for path in out.iterdir()}
    assert {"board.json", "rig.yml", "report.html", "left_0007.png", "right_0007.png"} <= names
    assert true_error_mm(read_rig(out / "rig.yml")) < 0.15
    # The folder is one that `calibrate stereo` reads.
    again = tmp_path / "again.json"
    arguments = ["--out", str(tmp_path / "rig.yml"), "--json", str(again)]
    assert run(["--quiet", "calibrate", "stereo", str(out), "--board", board, *arguments]) == 0
    assert json.loads(again.read_text())["rms_px"] == pytest.approx(told["rms_px"], rel=1e-6)


def test_a_folder_with_pictures_is_refused(board, tmp_path, capsys):
    (tmp_path / "left_0000.png").write_bytes(b"x")
    assert capture(board, tmp_path, "--headless") == 3
    assert "already holds pictures" in capsys.readouterr().err


def test_without_a_screen_only_the_simulated_rig_captures(board, tmp_path, capsys):
    config = tmp_path / "navapp.toml"
    config.write_text('[camera]\nbackend = "acme"\n')
    assert capture(board, tmp_path / "out", "--headless", config=config) == 2
    assert "simulated rig" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_a_screen_needs_a_terminal(board, tmp_path, capsys):
    assert capture(board, tmp_path / "out") == 2
    assert "needs a terminal" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_a_camera_that_is_not_installed_is_refused(board, tmp_path, capsys):
    config = tmp_path / "navapp.toml"
    config.write_text('[camera]\nbackend = "acme"\n')
    assert capture(board, tmp_path / "out", config=config) == 2
    assert "no camera backend 'acme'" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("n_pairs", ["0", "3"])
def test_fewer_pairs_than_can_be_solved_are_refused(board, tmp_path, capsys, n_pairs):
    """They were waited for without end."""
    assert capture(board, tmp_path / "out", "--headless", "--pairs", n_pairs) == 2
    assert "--pairs must be at least 4" in capsys.readouterr().err


@pytest.mark.release
def test_a_camera_that_is_unplugged_for_a_while_costs_no_pair(board, tmp_path):
    config, result = tmp_path / "navapp.toml", tmp_path / "result.json"
    fault = '{kind = "unplug", start_s = 4.0, duration_s = 3.0}'
    config.write_text(f"{SLOW}[camera.simulated]\nfaults = [{fault}]\n")
    out = tmp_path / "out"
    arguments = ("--headless", "--pairs", "5", "--json", str(result))
    # That five pairs are too few to be accepted is not the question.
    assert capture(board, out, *arguments, config=config) == 4
    assert json.loads(result.read_text())["pairs_kept"] == 5
    assert len(list(out.glob("left_*.png"))) == len(list(out.glob("right_*.png"))) == 5


@pytest.mark.release
def test_a_camera_that_stays_away_ends_the_capture_and_keeps_its_pairs(board, tmp_path, capsys):
    config, out = tmp_path / "navapp.toml", tmp_path / "out"
    fault = '{kind = "unplug", start_s = 4.0, duration_s = inf}'
    config.write_text(f"{SLOW}[camera.simulated]\nfaults = [{fault}]\n")
    assert capture(board, out, "--headless", config=config) == 5
    told = capsys.readouterr().err
    assert "unplugged" in told
    n_kept = len(list(out.glob("left_*.png")))
    assert n_kept >= 1
    assert f"{n_kept} pairs are kept" in told
