"""A plate's file: read back as it was, and refused with words that name the key."""

import json
from pathlib import Path
from typing import Any

import pytest

from navapp.errors import InputError
from navapp.tools.plate import Plate
from navapp.tools.plate_files import parse_plate, plate_keys, read_plate

KEYS: dict[str, Any] = {
    "type": "plate", "squares_x": 3, "squares_y": 2, "square_mm": 20.0, "marker_mm": 16.0,
    "dictionary": "DICT_4X4_100", "first_id": 7, "faces": 2, "fold_deg": 45.0,
}  # fmt: skip


@pytest.mark.parametrize(
    "plate",
    [
        Plate(),
        Plate("DICT_5X5_50", 3, 3, 1, 18.0, 12.5, 1, 0.0),
        Plate(first_id=20, faces=3, fold_deg=-50.0),
    ],
)
def test_a_plate_comes_back_from_its_file(plate: Plate, tmp_path: Path) -> None:
    path = tmp_path / "plate.json"
    path.write_text(json.dumps(plate_keys(plate)))
    assert read_plate(path) == plate


def test_every_key_goes_to_its_place() -> None:
    assert parse_plate(KEYS) == Plate("DICT_4X4_100", 7, 3, 2, 20.0, 16.0, 2, 45.0)


def test_what_is_optional_may_be_left_out() -> None:
    needed = {key: KEYS[key] for key in KEYS if key not in ("first_id", "faces", "fold_deg")}
    assert parse_plate(needed) == Plate("DICT_4X4_100", 0, 3, 2, 20.0, 16.0, 1, 0.0)


@pytest.mark.parametrize("key", ["squares_x", "squares_y", "square_mm", "marker_mm", "dictionary"])
def test_a_missing_key_is_named(key: str) -> None:
    with pytest.raises(ValueError, match=f"lacks {key}$"):
        parse_plate({name: value for name, value in KEYS.items() if name != key})


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("type", "charuco", 'type must be "plate", not \'charuco\''),
        ("colour", "red", "a plate has no colour"),
        ("squares_x", 0, "squares_x must be a whole number from 1 to 8, not 0"),
        ("squares_x", 9, "squares_x must be a whole number from 1 to 8, not 9"),
        ("squares_x", 2.0, "squares_x must be a whole number"),
        ("squares_y", True, "squares_y must be a whole number"),
        ("squares_y", "2", "squares_y must be a whole number"),
        ("first_id", -1, "first_id must be a whole number from 0"),
        ("faces", 7, "faces must be a whole number from 1 to 6"),
        ("square_mm", 0.0, "square_mm must be a number"),
        ("square_mm", 201.0, "square_mm must be a number from 0 to 200, not 201.0"),
        ("square_mm", float("nan"), "square_mm must be a number"),
        ("marker_mm", -1.0, "marker_mm must be a number"),
        ("marker_mm", "16", "marker_mm must be a number"),
        ("marker_mm", True, "marker_mm must be a number"),
        ("fold_deg", 121.0, "fold_deg must be a number from -120 to 120"),
        ("dictionary", "DICT_9X9", "dictionary 'DICT_9X9' is none of OpenCV's"),
        ("dictionary", "CORNER_REFINE_SUBPIX", "is none of OpenCV's"),
        ("dictionary", 3, "dictionary 3 is none of OpenCV's"),
        ("marker_mm", 17.5, "square_mm must be 20.4 at least: a marker needs white around"),
        ("first_id", 90, "needs markers up to 101, but DICT_4X4_100 ends at 99"),
    ],
)  # fmt: skip
def test_what_no_plate_has_is_refused_by_name(key: str, value: object, words: str) -> None:
    with pytest.raises(ValueError, match=r"plate|must|needs|none") as refused:
        parse_plate({**KEYS, key: value})
    assert words in str(refused.value)


def test_the_last_markers_of_a_dictionary_can_be_used() -> None:
    assert parse_plate({**KEYS, "first_id": 88}).ids.stop == 100


def test_several_faces_must_say_how_they_are_folded() -> None:
    with pytest.raises(ValueError, match="several faces need fold_deg"):
        parse_plate({key: value for key, value in KEYS.items() if key != "fold_deg"})
    assert parse_plate({**KEYS, "fold_deg": 0.0}).faces == 2


@pytest.mark.parametrize(
    "content",
    [b"", b"[1, 2]", b'{"type": "plate"', b"\xff\xfe", b'{"type": "plate", "squares_x": 2}'],
    ids=["empty", "a list", "cut off", "no text", "lacks keys"],
)
def test_a_damaged_file_is_refused_with_an_example(content: bytes, tmp_path: Path) -> None:
    path = tmp_path / "plate.json"
    path.write_bytes(content)
    with pytest.raises(InputError, match="describes no plate") as refused:
        read_plate(path)
    assert refused.value.exit_code == 3
    assert refused.value.subject == str(path)
    assert '"type": "plate"' in refused.value.remedy


def test_a_missing_file_is_said_to_be_missing(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="does not exist"):
        read_plate(tmp_path / "none.json")
    with pytest.raises(InputError, match="describes no plate"):
        read_plate(tmp_path)
