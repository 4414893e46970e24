"""Calibration targets: geometry of each kind, and the JSON file that describes a printed one.

A target's frame: x along its columns, y along its rows, z away from who looks at it. Boards of
squares begin at the outer corner of the first square, circles at the first circle's centre.
"""

import json
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

import cv2
import numpy as np

from navapp.errors import InputError
from navapp.geometry.transform import FloatArray
from navapp.tools.plate import Plate
from navapp.tools.plate_files import read_plate

BoardKind = Literal["charuco", "chessboard", "circles", "circles_asymmetric"]

_SQUARES = ("squares_x", "squares_y", "square_mm")
_KEYS: dict[BoardKind, tuple[str, ...]] = {
    "charuco": (*_SQUARES, "marker_mm", "dictionary"),
    "chessboard": _SQUARES,
    "circles": ("circles_x", "circles_y", "spacing_mm"),
    "circles_asymmetric": ("circles_x", "circles_y", "spacing_mm"),
}
_OPTIONAL: dict[BoardKind, tuple[str, ...]] = {
    "charuco": ("legacy_pattern",),
    "chessboard": (),
    "circles": ("diameter_mm",),
    "circles_asymmetric": ("diameter_mm",),
}
_FEWEST_SQUARES, _FEWEST_CIRCLES = 3, 2


@dataclass(frozen=True)
class Board:
    """A flat calibration target."""

    kind: BoardKind  # of the target
    # columns, rows: squares of a board of squares (inner corners + 1), circles of the others.
    columns: int
    rows: int
    # side of a square; distance of neighbouring circles in a row; of an asymmetric grid half of
    # that, which is also the distance of its rows.
    spacing_mm: float
    mark_mm: float = 0.0  # side of a marker, diameter of a circle; 0 on a chessboard
    dictionary: str = ""  # of a ChArUco board's markers, OpenCV's name
    is_legacy: bool = False  # a ChArUco board as OpenCV drew it before 4.6

    @property
    def has_squares(self) -> bool:
        """Corners of squares are seen, otherwise centres of circles."""
        return self.kind in ("charuco", "chessboard")

    @cached_property
    def points_mm(self) -> FloatArray:
        """(N, 3) of all corners or centres, row by row; z = 0."""
        inner = int(self.has_squares)
        x, y = np.meshgrid(
            np.arange(inner, self.columns), np.arange(inner, self.rows), indexing="xy"
        )
        if self.kind == "circles_asymmetric":
            x = 2 * x + y % 2
        flat = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
        points_mm: FloatArray = flat.astype(np.float64) * self.spacing_mm
        return points_mm

    @property
    def size_mm(self) -> tuple[float, float]:
        """Width and height of what is printed, from outermost mark to outermost mark."""
        if self.has_squares:
            return self.columns * self.spacing_mm, self.rows * self.spacing_mm
        width, height = np.ptp(self.points_mm[:, :2], axis=0) + self.mark_mm
        return float(width), float(height)

    @property
    def clear_mm(self) -> float:
        """As near to its edges nothing but its four squares is printed around a corner."""
        if self.kind == "charuco":
            return 0.5 * (self.spacing_mm - self.mark_mm)
        return 0.5 * self.spacing_mm

    @cached_property
    def charuco(self) -> Any:
        """OpenCV's object of a ChArUco board."""
        board = cv2.aruco.CharucoBoard(
            (self.columns, self.rows),
            self.spacing_mm,
            self.mark_mm,
            cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, self.dictionary)),
        )
        board.setLegacyPattern(self.is_legacy)
        return board

    def __str__(self) -> str:
        what = "squares" if self.has_squares else "circles"
        return f"{self.kind} of {self.columns} x {self.rows} {what}, {self.spacing_mm:g} mm"


def read_board(path: str | Path) -> Board:
    """Read a target's description (JSON, keys in docs/calibration.md).

    Raises:
        InputError: missing, damaged, or no possible target.
    """
    path = Path(path)
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise _refusal(path, "does not exist") from None
    except (OSError, ValueError) as error:
        raise _refusal(path, f"is not readable as JSON ({error})") from error
    if not isinstance(content, dict):
        raise _refusal(path, "is not one JSON object")
    try:
        return parse_board(content)
    except ValueError as error:
        raise _refusal(path, f"describes no possible board: {error}") from error


def read_target(path: str | Path) -> Board | Plate:
    """Read what can be printed: a target of a calibration, or a tool's plate.

    Raises:
        InputError: missing, damaged, or neither.
    """
    try:
        content = json.loads(Path(path).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        content = None
    is_plate = isinstance(content, dict) and content.get("type") == "plate"
    return read_plate(path) if is_plate else read_board(path)


def parse_board(content: dict[str, Any]) -> Board:
    """A target from the keys of its file.

    Raises:
        ValueError: a key that is missing, unknown or impossible; the text names it.
    """
    kind = content.get("type")
    if kind == "plate":
        raise ValueError("a plate marks a tool, it calibrates no camera; see `calibrate pivot`")
    if kind not in _KEYS:
        raise ValueError(f"type must be one of {', '.join(_KEYS)}, not {kind!r}")
    needed, known = _KEYS[kind], (*_KEYS[kind], *_OPTIONAL[kind], "type")
    if missing := [key for key in needed if key not in content]:
        raise ValueError(f"it lacks {', '.join(missing)}")
    if unknown := sorted(set(content) - set(known)):
        raise ValueError(f"a {kind} has no {', '.join(unknown)}")
    if kind in ("charuco", "chessboard"):
        return _board_of_squares(kind, content)
    spacing_mm = _length(content, "spacing_mm")
    mark_mm = _length(content, "diameter_mm") if "diameter_mm" in content else 0.5 * spacing_mm
    nearest_mm = spacing_mm if kind == "circles" else 2.0**0.5 * spacing_mm
    if mark_mm >= nearest_mm:
        raise ValueError("the circles overlap: diameter_mm must be smaller than their distance")
    columns = _count(content, "circles_x", _FEWEST_CIRCLES)
    return Board(kind, columns, _count(content, "circles_y", _FEWEST_CIRCLES), spacing_mm, mark_mm)


def keys_of(board: Board) -> dict[str, Any]:
    """The keys of a target's file, so that `parse_board` gives the target again."""
    if not board.has_squares:
        return {
            "type": board.kind,
            "circles_x": board.columns,
            "circles_y": board.rows,
            "spacing_mm": board.spacing_mm,
            "diameter_mm": board.mark_mm,
        }
    keys: dict[str, Any] = {
        "type": board.kind,
        "squares_x": board.columns,
        "squares_y": board.rows,
        "square_mm": board.spacing_mm,
    }
    if board.kind == "charuco":
        keys |= {"marker_mm": board.mark_mm, "dictionary": board.dictionary}
        keys |= {"legacy_pattern": True} if board.is_legacy else {}
    return keys


def _board_of_squares(kind: BoardKind, content: dict[str, Any]) -> Board:
    columns = _count(content, "squares_x", _FEWEST_SQUARES)
    rows = _count(content, "squares_y", _FEWEST_SQUARES)
    spacing_mm = _length(content, "square_mm")
    if kind == "chessboard":
        return Board(kind, columns, rows, spacing_mm)
    mark_mm = _length(content, "marker_mm")
    if mark_mm >= spacing_mm:
        raise ValueError("marker_mm must be smaller than square_mm")
    dictionary, is_legacy = content["dictionary"], content.get("legacy_pattern", False)
    if not (isinstance(dictionary, str) and dictionary.startswith("DICT_")) or not isinstance(
        getattr(cv2.aruco, str(dictionary), None), int
    ):
        raise ValueError(f"dictionary {dictionary!r} is none of OpenCV's (DICT_4X4_100, ...)")
    if not isinstance(is_legacy, bool):
        raise ValueError("legacy_pattern must be true or false")
    n_markers = columns * rows // 2
    n_known = len(cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, dictionary)).bytesList)
    if n_markers > n_known:
        raise ValueError(f"it needs {n_markers} markers, but {dictionary} has {n_known}")
    return Board(kind, columns, rows, spacing_mm, mark_mm, dictionary, is_legacy)


def _count(content: dict[str, Any], key: str, fewest: int) -> int:
    value = content[key]
    if not isinstance(value, int) or isinstance(value, bool) or not fewest <= value <= 200:
        raise ValueError(f"{key} must be a whole number from {fewest} to 200, not {value!r}")
    return value


def _length(content: dict[str, Any], key: str) -> float:
    value = content[key]
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    if not is_number or not 0.0 < value < 1e4:
        raise ValueError(f"{key} must be a positive length below 10000, not {value!r}")
    return float(value)


def _refusal(path: Path, problem: str) -> InputError:
    return InputError(
        f"board file {path} {problem}",
        subject=str(path),
        remedy='write one such as {"type": "chessboard", "squares_x": 10, "squares_y": 7, '
        '"square_mm": 20.0}',
    )
