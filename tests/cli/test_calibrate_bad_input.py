"""What `navapp calibrate stereo` cannot work on: one sentence, its code, nothing half-written."""

import json
import shutil
from collections.abc import Callable
from pathlib import Path

import cv2
import pytest

from tests.calibration.photographed import KEYS
from tests.e2e.test_bad_input import refused

Refuse = Callable[..., None]


@pytest.fixture
def pairs(good_pairs: Path, tmp_path: Path) -> Path:
    """Four pairs of our own."""
    folder = tmp_path / "pairs"
    folder.mkdir()
    for number in range(4):
        for side in ("left", "right"):
            shutil.copy(good_pairs / f"{side}_{number:04d}.png", folder)
    return folder


@pytest.fixture
def refuse(board_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> Refuse:
    """The command must end with that code and words, and leave every folder as it was."""

    def run_it(folder: Path, code: int, *words: str, more: tuple[str, ...] = (), board=None):
        files = {"--out": "rig.yml", "--json": "told.json", "--report": "r.html"}
        named = [part for key, file in files.items() for part in (key, str(tmp_path / file))]
        before = sorted(tmp_path.rglob("*"))
        arguments = ["calibrate", "stereo", str(folder), "--board", str(board or board_file)]
        # Even by force: what was not solved cannot be written. A later --out counts.
        refused([*arguments, "--force", *named, *more], capsys, code, *words)
        assert sorted(tmp_path.rglob("*")) == before

    return run_it


def resize(path: Path, width: int, height: int) -> None:
    cv2.imwrite(str(path), cv2.resize(cv2.imread(str(path), cv2.IMREAD_GRAYSCALE), (width, height)))


def other_board(tmp_path: Path, content: object) -> Path:
    path = tmp_path / "other.json"
    path.write_text(content if isinstance(content, str) else json.dumps(content), encoding="utf-8")
    return path


def test_no_folder(refuse, tmp_path) -> None:
    refuse(tmp_path / "nowhere", 3, "nowhere does not exist", "left_0000.png")


def test_no_images(refuse, pairs) -> None:
    for path in pairs.iterdir():
        path.unlink()
    (pairs / "notes.txt").write_text("taken on Monday", encoding="utf-8")
    refuse(pairs, 3, "pairs holds no stereo pairs", "left_0000.png")


def test_unequal_counts(refuse, pairs) -> None:
    (pairs / "right_0003.png").unlink()
    refuse(pairs, 3, "without a partner: left 3")


@pytest.mark.parametrize("picture", ["right_0000.png", "left_0002.png"])
def test_mixed_sizes(refuse, pairs, picture) -> None:
    resize(pairs / picture, 480, 270)
    refuse(pairs, 3, f"{picture} is 480x270, those before are 640x360")


@pytest.mark.parametrize("n_bytes", [0, 4000])
def test_a_picture_that_was_cut_short(refuse, pairs, n_bytes) -> None:
    path = pairs / "left_0002.png"
    path.write_bytes(path.read_bytes()[:n_bytes])
    refuse(pairs, 3, "left_0002.png is", "remove this pair")


def test_a_picture_that_is_none(refuse, pairs) -> None:
    (pairs / "right_0001.png").write_text("not at all", encoding="utf-8")
    refuse(pairs, 3, "right_0001.png is damaged, truncated or no picture")


def test_no_board_in_any_picture(refuse, pairs) -> None:
    for path in pairs.iterdir():
        cv2.imwrite(str(path), 0 * cv2.imread(str(path), cv2.IMREAD_GRAYSCALE))
    refuse(pairs, 4, "seen in 0 usable pairs, 4 are needed", "compare it with its file")


@pytest.mark.parametrize(
    "changes",
    [
        {"squares_x": 9},
        {"squares_x": 7},
        {"squares_x": 6, "squares_y": 8},
        {"legacy_pattern": True},
    ],
)
def test_a_board_of_another_size_than_described(refuse, pairs, tmp_path, changes) -> None:
    board = other_board(tmp_path, KEYS | changes)
    refuse(pairs, 4, "seen in 0 usable pairs", "compare it with its file", board=board)


def test_too_few_pairs_to_solve_anything(refuse, pairs) -> None:
    for side in ("left", "right"):
        (pairs / f"{side}_0000.png").unlink()
    refuse(pairs, 4, "seen in 3 usable pairs, 4 are needed")


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("{", "not readable as JSON"),
        ("[]", "not one JSON object"),
        ({}, "type must be one of charuco"),
        (KEYS | {"square_mm": -1.0}, "square_mm must be a positive length"),
        (KEYS | {"squares_z": 3}, "a charuco has no squares_z"),
    ],
)
def test_a_board_that_is_none(refuse, pairs, tmp_path, content, words) -> None:
    refuse(pairs, 3, "other.json", words, board=other_board(tmp_path, content))


def test_no_board_file(refuse, pairs, tmp_path) -> None:
    refuse(pairs, 3, "none.json does not exist", board=tmp_path / "none.json")


@pytest.mark.parametrize("length", ["0", "-80", "nan", "inf"])
def test_a_known_distance_that_is_none(refuse, pairs, length) -> None:
    refuse(pairs, 2, "must be a length", more=("--known-distance-mm", length))


@pytest.mark.parametrize("option", ["--out", "--json", "--report"])
def test_no_place_for_a_file(refuse, pairs, tmp_path, option) -> None:
    """Said before the work begins."""
    refuse(pairs, 3, "none", "does not exist", more=(option, str(tmp_path / "none" / "x")))
    refuse(pairs, 3, "pairs cannot be written", more=(option, str(pairs)))


def test_pairs_set_aside_of_another_size(refuse, pairs, tmp_path) -> None:
    aside = shutil.copytree(pairs, tmp_path / "aside")
    for path in aside.iterdir():
        resize(path, 480, 270)
    refuse(pairs, 3, "aside are 480x270", "640x360", more=("--holdout", str(aside)))


def test_pairs_set_aside_without_the_board(refuse, pairs, tmp_path) -> None:
    aside = shutil.copytree(pairs, tmp_path / "aside")
    for path in aside.iterdir():
        cv2.imwrite(str(path), 0 * cv2.imread(str(path), cv2.IMREAD_GRAYSCALE))
    refuse(pairs, 4, "no pair of", "aside", "shows the board", more=("--holdout", str(aside)))
