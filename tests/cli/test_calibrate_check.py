"""`navapp calibrate check` on picture files: a rig as it was, one that moved, and files damaged."""

import dataclasses
import json
import shutil
from collections.abc import Callable
from datetime import date
from pathlib import Path

import cv2
import numpy as np
import pytest

from navapp.cli.main import run
from navapp.geometry import RigQuality, StereoRig, write_rig
from navapp.geometry.transform import RigidTransform, rotation_from_vector
from tests.calibration.photographed import RIG
from tests.e2e.test_bad_input import refused

GOOD = RigQuality(True, expires_on=date(2999, 1, 1), figures={"holdout_rms_px": 0.02})


@pytest.fixture
def rig_file(tmp_path: Path) -> Path:
    write_rig(tmp_path / "rig.yml", dataclasses.replace(RIG, quality=GOOD))
    return tmp_path / "rig.yml"


@pytest.fixture
def pairs(good_pairs: Path, tmp_path: Path) -> Path:
    """What was photographed today."""
    folder = tmp_path / "today"
    folder.mkdir()
    for number in (1, 3, 5, 6):
        for side in ("left", "right"):
            shutil.copy(good_pairs / f"{side}_{number:04d}.png", folder)
    return folder


@pytest.fixture
def command(rig_file: Path, pairs: Path, board_file: Path) -> list[str]:
    return ["calibrate", "check", str(rig_file), str(pairs), "--board", str(board_file)]


def test_a_rig_as_it_was_passes(command, tmp_path, capsys) -> None:
    assert run([*command, "--json", str(tmp_path / "told.json")]) == 0
    told = json.loads((tmp_path / "told.json").read_text(encoding="utf-8"))
    assert (told["command"], told["accepted"], told["reasons"]) == ("calibrate check", True, [])
    assert told["views_used"] == 4
    assert told["rms_px"] < 0.05
    assert told["length_100_mm"]["mean"] == pytest.approx(100.0, abs=0.05)
    assert "a length of 100 mm on the board is measured as" in capsys.readouterr().out


def turned(angles_rad: tuple[float, float, float]) -> StereoRig:
    """The rig before its right camera turned about its own centre."""
    pose = RigidTransform.from_parts(
        "right", "right", rotation_from_vector(np.array(angles_rad)), np.zeros(3)
    )
    return dataclasses.replace(RIG, quality=GOOD, right_from_left=pose @ RIG.right_from_left)


@pytest.mark.parametrize(
    ("angles_rad", "words"),
    [
        # 0.5 px of 700.
        ((0.0, 0.0007, 0.0), "a length of 100 mm on the board is measured as"),
        ((0.0007, 0.0, 0.0), "the cameras have turned"),
    ],
    ids=["sideways", "up or down"],
)
def test_a_camera_that_has_turned_is_told(command, rig_file, capsys, angles_rad, words) -> None:
    write_rig(rig_file, turned(angles_rad))
    refused(command, capsys, 4, "does not pass", words, "calibrate again")


@pytest.mark.parametrize(
    ("quality", "words"),
    [
        (RigQuality(False, ("too few views",)), "its calibration was not accepted"),
        (dataclasses.replace(GOOD, expires_on=date(2020, 1, 1)), "it expired on 2020-01-01"),
    ],
)
def test_what_its_file_says_against_it_counts(command, rig_file, capsys, quality, words) -> None:
    write_rig(rig_file, dataclasses.replace(RIG, quality=quality))
    refused(command, capsys, 4, words)


def damage(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:400])


def edit(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    assert "2999-01-01" in text
    path.write_text(text.replace("2999-01-01", "3999-01-01"), encoding="utf-8")


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (damage, "rig.yml"),
        (edit, "rig.yml was changed after it was written"),
        (Path.unlink, "rig.yml does not exist"),
    ],
)
def test_a_rig_file_that_is_damaged_edited_or_gone(
    command, rig_file, tmp_path, capsys, change: Callable[[Path], None], words: str
) -> None:
    change(rig_file)
    out = tmp_path / "told.json"
    refused([*command, "--json", str(out)], capsys, 3, words)
    refused(["rig", "show", str(rig_file), "--json", str(out)], capsys, 3, words)
    converted = tmp_path / "other.xml"
    refused(["rig", "convert", str(rig_file), str(converted)], capsys, 3, words)
    assert not out.exists()
    assert not converted.exists()


def test_pictures_of_other_cameras(command, rig_file, capsys) -> None:
    write_rig(rig_file, RIG.scale(2.0))
    refused(command, capsys, 3, "the pictures are 640x360", "1280x720")


def test_pictures_without_the_board(command, pairs, tmp_path, capsys) -> None:
    for path in pairs.iterdir():
        cv2.imwrite(str(path), 0 * cv2.imread(str(path), cv2.IMREAD_GRAYSCALE))
    refused(command, capsys, 4, "not seen by both cameras")


def test_no_pictures(command, pairs, capsys) -> None:
    shutil.rmtree(pairs)
    refused(command, capsys, 3, "today does not exist")
