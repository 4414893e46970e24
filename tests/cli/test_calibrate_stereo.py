"""`navapp calibrate stereo` on picture files: a good set, and sets that went wrong in one way each.

Every bad set is the good one with one thing done to its files, or photographed anew where the
board itself was held wrongly.
"""

import json
import shutil
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import pytest

from navapp.cli.main import run
from navapp.geometry import StereoRig, read_rig, write_rig
from tests.calibration.photographed import (
    BOARD,
    GOOD_VIEWS,
    KEYS,
    RIG,
    good_poses,
    held,
    photograph,
)
from tests.many import few_of

pytestmark = pytest.mark.usefixtures("empty_plots")

N_PAIRS = len(GOOD_VIEWS)


@dataclass(frozen=True)
class Ended:
    """The command's exit code, JSON, sentence on stderr, and rig file if there is one."""

    code: int
    told: dict
    sentence: str
    rig: StereoRig | None


@pytest.fixture
def solve(
    board_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> Callable[..., Ended]:
    def run_it(folder: Path, *more: str, board: Path = board_file) -> Ended:
        out, told = tmp_path / "rig.yml", tmp_path / "told.json"
        arguments = ["--board", str(board), "--out", str(out), "--json", str(told), *more]
        code = run(["--quiet", "calibrate", "stereo", str(folder), *arguments])
        lines = capsys.readouterr().err.splitlines()
        assert len(lines) == (0 if code == 0 else 1)
        rig = read_rig(out) if out.exists() else None
        return Ended(code, json.loads(told.read_text(encoding="utf-8")), "".join(lines), rig)

    return run_it


def name(side: str, number: int) -> str:
    return f"{side}_{number:04d}.png"


def copied(source: Path, folder: Path, numbers: Iterable[int] = range(N_PAIRS)) -> Path:
    folder.mkdir()
    for number in numbers:
        for side in ("left", "right"):
            shutil.copy(source / name(side, number), folder)
    return folder


def test_a_good_set_is_accepted_and_right(good_pairs, solve, tmp_path) -> None:
    ended = solve(good_pairs, "--known-distance-mm", "80", "--report", str(tmp_path / "r.html"))
    assert ended.code == 0, ended.sentence
    assert ended.rig is not None
    assert ended.told["accepted"]
    assert ended.told["reasons"] == []
    assert ended.told["views_used"] == N_PAIRS
    assert ended.told["rig_id"] == ended.rig.rig_id
    assert ended.rig.quality is not None
    assert ended.rig.quality.is_accepted
    # Three standard errors of what the pictures tell.
    sigma = ended.told["standard_errors"]
    assert ended.rig.baseline_mm == pytest.approx(80.0, abs=3.0 * sigma["translation_mm"][0])
    off_px = ended.rig.left.matrix[0, 0] - RIG.left.matrix[0, 0]
    assert abs(off_px) < 3.0 * sigma["focal_px"]
    assert "Accepted" in (tmp_path / "r.html").read_text(encoding="utf-8")


def too_few(good: Path, folder: Path) -> Path:
    return copied(good, folder, range(6))


def frontal(good: Path, folder: Path) -> Path:
    """Out to the picture's corners, where it is seen aslant, but parallel to it."""
    rng = np.random.default_rng(1)
    poses = [
        held((40.0 + 1.4 * (x - 40.0), 1.4 * y, z), (*rng.uniform(-2.0, 2.0, 2), turn[2]))
        for (x, y, z), turn in GOOD_VIEWS
    ]
    return photograph(folder, poses)


def in_the_middle(good: Path, folder: Path) -> Path:
    """Tilted as it should be, but always in the middle and far away."""
    poses = [
        held((40.0 + 0.05 * (x - 40.0), 0.1 * y, 550.0 + 0.5 * (z - 450.0)), turn)
        for (x, y, z), turn in GOOD_VIEWS
    ]
    return photograph(folder, poses)


def swapped(good: Path, folder: Path) -> Path:
    folder.mkdir()
    for number in range(N_PAIRS):
        shutil.copy(good / name("left", number), folder / name("right", number))
        shutil.copy(good / name("right", number), folder / name("left", number))
    return folder


def out_of_order(good: Path, folder: Path) -> Path:
    """The right camera was late once: its picture of pair 3 is that of pair 7."""
    copied(good, folder)
    shutil.copy(good / name("right", 7), folder / name("right", 3))
    return folder


def exchanged(good: Path, folder: Path) -> Path:
    out_of_order(good, folder)
    shutil.copy(good / name("right", 3), folder / name("right", 7))
    return folder


def moved(good: Path, folder: Path) -> Path:
    """3 mm to the side before the right picture of pair 5 was taken."""
    pose = good_poses()[5]
    pose = pose.move((3.0, 1.0, 0.0, 0.0, 0.0, 0.0), pose.apply(BOARD.points_mm.mean(axis=0)))
    late = photograph(folder.with_name("late"), [pose])
    copied(good, folder)
    shutil.copy(late / name("right", 0), folder / name("right", 5))
    return folder


BAD_SETS = {
    "too few": (too_few, "only 6 pairs"),
    "frontal": (frontal, "frontally"),
    "in the middle": (in_the_middle, "one part of the left picture"),
    "swapped": (swapped, "left and right pictures are swapped"),
    "out of order": (out_of_order, "pair 3: its right picture shows the board of pair 7"),
    "exchanged": (exchanged, "pair 7: its right picture shows the board of pair 3"),
    "moved": (moved, "pair 5: the board moved between the left and the right picture"),
}


@pytest.mark.parametrize("kind", few_of(BAD_SETS))
def test_a_bad_set_is_refused_for_its_own_reason(kind, good_pairs, solve, tmp_path) -> None:
    make, words = BAD_SETS[kind]
    ended = solve(make(good_pairs, tmp_path / "bad"))
    assert ended.code == 4
    assert ended.sentence.startswith("navapp: error: the rig is not accepted: ")
    assert words in ended.sentence
    assert not ended.told["accepted"]
    reasons = ended.told["reasons"]
    assert any(words in reason for reason in reasons)
    is_its_own = {"exchanged", "out of order"} if kind == "exchanged" else {kind}
    others = [text for other, (_, text) in BAD_SETS.items() if other not in is_its_own]
    assert [reason for reason in reasons for text in others if text in reason] == []
    assert ended.rig is None


@pytest.mark.release
def test_a_wrong_square_is_refused_by_a_known_distance(good_pairs, solve, tmp_path) -> None:
    board = tmp_path / "other.json"
    board.write_text(json.dumps(KEYS | {"square_mm": 20.0, "marker_mm": 14.0}), encoding="utf-8")
    ended = solve(good_pairs, "--known-distance-mm", "80", board=board)
    assert ended.code == 4
    assert "76.2" in ended.sentence
    assert "not as large as its file says" in ended.sentence
    assert [reason for reason in ended.told["reasons"] if "not as large" not in reason] == []
    assert ended.rig is None


@pytest.mark.release
def test_a_blurred_view_is_dropped_and_the_rest_accepted(good_pairs, solve, tmp_path) -> None:
    folder = copied(good_pairs, tmp_path / "bad")
    path = str(folder / name("left", 4))
    cv2.imwrite(path, cv2.GaussianBlur(cv2.imread(path, cv2.IMREAD_GRAYSCALE), (0, 0), 1.2))
    ended = solve(folder)
    assert ended.code == 0, ended.sentence
    assert ended.rig is not None
    (dropped,) = ended.told["views_dropped"]
    assert dropped["index"] == 4
    assert "left picture is blurred" in dropped["reason"]
    assert ended.told["views_used"] == N_PAIRS - 1
    assert ended.rig.baseline_mm == pytest.approx(80.0, abs=0.1)


def test_by_force_a_rig_is_written_that_says_no_of_itself(good_pairs, solve, tmp_path) -> None:
    report = tmp_path / "r.html"
    folder = too_few(good_pairs, tmp_path / "bad")
    ended = solve(folder, "--force", "--report", str(report))
    assert ended.code == 4
    assert "was written as not accepted" in ended.sentence
    assert ended.rig is not None
    quality = ended.rig.quality
    assert quality is not None
    assert not quality.is_accepted
    assert list(quality.reasons) == ended.told["reasons"]
    assert "only 6 pairs" in report.read_text(encoding="utf-8")


def test_a_rig_of_before_stays_when_the_new_one_is_refused(good_pairs, solve, tmp_path) -> None:
    write_rig(tmp_path / "rig.yml", RIG)
    ended = solve(copied(good_pairs, tmp_path / "bad", range(4)))
    assert ended.code == 4
    assert ended.rig is not None
    assert ended.rig.rig_id == RIG.rig_id


@pytest.mark.release
def test_a_picture_that_was_lost_halfway_is_no_crash(good_pairs, solve, tmp_path) -> None:
    """From pair 4 on every right picture is that of the next pair: hardly any two pairs agree."""
    folder = copied(good_pairs, tmp_path / "bad", range(N_PAIRS - 1))
    for number in range(4, N_PAIRS - 1):
        shutil.copy(good_pairs / name("right", number + 1), folder / name("right", number))
    ended = solve(folder, "--force", "--report", str(tmp_path / "r.html"))
    assert ended.code == 4
    assert ended.rig is not None
    assert ended.rig.quality is not None
    assert not ended.rig.quality.is_accepted
    assert any("fit badly" in reason for reason in ended.told["reasons"])
    assert not any("swapped" in reason for reason in ended.told["reasons"])
