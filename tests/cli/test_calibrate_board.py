"""`navapp calibrate board` through the command line."""

import json
from pathlib import Path

import pytest

from navapp.cli.main import run

KEYS = {
    "type": "charuco", "squares_x": 11, "squares_y": 8, "square_mm": 15.0, "marker_mm": 11.0,
    "dictionary": "DICT_4X4_100",
}  # fmt: skip


def board_file(tmp_path: Path, **changes: object) -> Path:
    path = tmp_path / "board.json"
    path.write_text(json.dumps(KEYS | changes), encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("ending", "start"), [("pdf", b"%PDF"), ("svg", b"<?xml"), ("PDF", b"%PDF")]
)
def test_a_board_is_written(tmp_path, capsys, ending, start) -> None:
    out, told = tmp_path / f"b.{ending}", tmp_path / "told.json"
    arguments = ["calibrate", "board", "--board", str(board_file(tmp_path)), "--out", str(out)]
    assert run([*arguments, "--json", str(told)]) == 0
    assert out.read_bytes().startswith(start)
    content = json.loads(told.read_text(encoding="utf-8"))
    assert content["board"] == KEYS
    assert content["board_mm"] == [165.0, 120.0]
    assert (content["paper"], content["warnings"]) == ("A4", [])
    captured = capsys.readouterr()
    assert "fits on A4" in captured.out
    # At its first use on a machine matplotlib may say that it looks for fonts.
    assert "navapp: warning" not in captured.err


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"square_mm": 25.0}, "needs A3 paper"),
        ({"square_mm": 200.0}, "larger than A0"),
        ({"square_mm": 1.0, "marker_mm": 0.7}, "counted in squares"),
    ],
)
def test_what_a_person_must_know_before_printing_is_warned_of(tmp_path, capsys, changes, words):
    board, out = board_file(tmp_path, **changes), tmp_path / "b.svg"
    assert run(["calibrate", "board", "--board", str(board), "--out", str(out)]) == 0
    assert words in capsys.readouterr().err
    assert out.exists()


@pytest.mark.parametrize(
    ("out", "changes", "code", "words"),
    [
        ("b.png", {}, 2, "neither PDF nor SVG"),
        ("none/b.pdf", {}, 3, "does not exist"),
        ("b.pdf", {"marker_mm": 16.0}, 3, "marker_mm must be smaller"),
    ],
)
def test_what_cannot_be_printed_is_one_sentence(tmp_path, capsys, out, changes, code, words):
    board = board_file(tmp_path, **changes)
    assert run(["calibrate", "board", "--board", str(board), "--out", str(tmp_path / out)]) == code
    lines = capsys.readouterr().err.strip().splitlines()
    assert len(lines) == 1
    assert words in lines[0]
    assert [path.name for path in tmp_path.iterdir()] == ["board.json"]
