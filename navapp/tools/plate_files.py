"""A plate's description in a JSON file: keys in docs/tools.md."""

import json
from pathlib import Path
from typing import Any

from navapp.errors import InputError
from navapp.tools.plate import Plate

_NEEDED = ("squares_x", "squares_y", "square_mm", "marker_mm", "dictionary")
_OPTIONAL = ("first_id", "faces", "fold_deg")
_MOST_SQUARES, _MOST_FACES, _MOST_MM = 8, 6, 200.0
_LEAST_WHITE = 0.5  # cells of white that a detector needs around a marker


def read_plate(path: str | Path) -> Plate:
    """Read a plate's description.

    Raises:
        InputError: missing, damaged, or no possible plate.
    """
    path = Path(path)
    try:
        return parse_plate(json.loads(path.read_text(encoding="utf-8")))
    except FileNotFoundError:
        problem = "does not exist"
    except (OSError, ValueError) as error:
        problem = f"describes no plate: {error}"
    raise InputError(
        f"plate file {path} {problem}",
        subject=str(path),
        remedy='write one such as {"type": "plate", "squares_x": 2, "squares_y": 2, '
        '"square_mm": 20.0, "marker_mm": 16.0, "dictionary": "DICT_4X4_100"}',
    )


def parse_plate(content: Any) -> Plate:
    """A plate from the keys of its file.

    Raises:
        ValueError: a key that is missing, unknown or impossible; the text names it.
    """
    if not isinstance(content, dict):
        raise ValueError("it is not one JSON object")
    if content.get("type") != "plate":
        raise ValueError(f'type must be "plate", not {content.get("type")!r}')
    if missing := [key for key in _NEEDED if key not in content]:
        raise ValueError(f"it lacks {', '.join(missing)}")
    if unknown := sorted(set(content) - {"type", *_NEEDED, *_OPTIONAL}):
        raise ValueError(f"a plate has no {', '.join(unknown)}")
    plate = Plate(
        _dictionary(content["dictionary"]),
        _count(content, "first_id", 0, 10000),
        _count(content, "squares_x", 1, _MOST_SQUARES),
        _count(content, "squares_y", 1, _MOST_SQUARES),
        _number(content, "square_mm", 0.0, _MOST_MM),
        _number(content, "marker_mm", 0.0, _MOST_MM),
        _count(content, "faces", 1, _MOST_FACES),
        _number(content, "fold_deg", -120.0, 120.0),
    )
    if plate.margin_mm < _LEAST_WHITE * plate.marker_mm / plate.n_cells:
        least_mm = plate.marker_mm * (1.0 + 2.0 * _LEAST_WHITE / plate.n_cells)
        raise ValueError(f"square_mm must be {least_mm:.1f} at least: a marker needs white around")
    if plate.faces > 1 and "fold_deg" not in content:
        raise ValueError("several faces need fold_deg")
    n_known = len(plate.opencv_dictionary.bytesList)
    if plate.ids.stop > n_known:
        raise ValueError(
            f"it needs markers up to {plate.ids.stop - 1}, but {plate.dictionary} ends at "
            f"{n_known - 1}"
        )
    return plate


def plate_keys(plate: Plate) -> dict[str, Any]:
    """The keys of a plate's file, so that `parse_plate` gives the plate again."""
    return {
        "type": "plate",
        "squares_x": plate.columns,
        "squares_y": plate.rows,
        "square_mm": plate.square_mm,
        "marker_mm": plate.marker_mm,
        "dictionary": plate.dictionary,
        "first_id": plate.first_id,
        "faces": plate.faces,
        "fold_deg": plate.fold_deg,
    }


def _dictionary(value: Any) -> str:
    import cv2

    is_known = isinstance(value, str) and value.startswith("DICT_")
    if not is_known or not isinstance(getattr(cv2.aruco, value, None), int):
        raise ValueError(
            f"dictionary {value!r} is none of OpenCV's (DICT_4X4_100, DICT_APRILTAG_36h11, ...)"
        )
    return str(value)


def _count(content: dict[str, Any], key: str, fewest: int, most: int) -> int:
    value = content.get(key, fewest)
    if not isinstance(value, int) or isinstance(value, bool) or not fewest <= value <= most:
        raise ValueError(f"{key} must be a whole number from {fewest} to {most}, not {value!r}")
    return value


def _number(content: dict[str, Any], key: str, low: float, high: float) -> float:
    value = content.get(key, 0.0)
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    is_possible = is_number and low <= value <= high and (value != 0.0 or low < 0.0)
    if not is_possible:
        raise ValueError(f"{key} must be a number from {low:g} to {high:g}, not {value!r}")
    return float(value)
