"""Renders a target, or a tool's plate, to scale as a page, PDF or SVG."""

import io
import json
import textwrap
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

import numpy as np

from calibration.targets.boards import Board, keys_of
from calibration.targets.drawing import Drawing, make_drawing
from calibration.targets.plate_drawing import draw_plate
from navapp.geometry.transform import FloatArray
from navapp.tools.plate import Plate
from navapp.tools.plate_files import plate_keys

_MM_PER_INCH, _POINTS_PER_INCH = 25.4, 72.0
# Detectors want white around the board, printers leave the outermost 5 mm of the paper out.
_LEAST_MARGIN_MM, _MOST_MARGIN_MM = 10.0, 20.0
RULER_MM = 100.0
_RULER_HEIGHT_MM, _LINE_MM, _STROKE_MM, _SMALL_PT, _LETTER_MM = 10.0, 3.5, 0.2, 7.0, 1.5
_TICK_MM, _CUT_PT = 4.0, 0.3
_PAPERS_MM = {
    "A4": (297.0, 210.0),
    "A3": (420.0, 297.0),
    "A2": (594.0, 420.0),
    "A1": (841.0, 594.0),
    "A0": (1189.0, 841.0),
}


@dataclass(frozen=True)
class Sheet:
    """A board with what is printed around it; x right, y down, from the paper's corner."""

    board: Board | Plate

    @cached_property
    def drawing(self) -> Drawing:
        """The board's shapes, in its own frame."""
        board = self.board
        return draw_plate(board) if isinstance(board, Plate) else make_drawing(board)

    @property
    def size_mm(self) -> tuple[float, float]:
        """Width and height of the board."""
        width, height = self.drawing.high_mm - self.drawing.low_mm
        return float(width), float(height)

    @property
    def keys(self) -> dict[str, Any]:
        """Of the board's file."""
        return plate_keys(self.board) if isinstance(self.board, Plate) else keys_of(self.board)

    @property
    def folds_mm(self) -> list[float]:
        """Where the folds between a plate's faces lie: x from the board's origin."""
        if not isinstance(self.board, Plate):
            return []
        return [number * self.board.face_size_mm[0] for number in range(1, self.board.faces)]

    @property
    def margin_mm(self) -> float:
        """White on each side of the board: as wide as a square, within what paper allows."""
        board = self.board
        square_mm = board.square_mm if isinstance(board, Plate) else board.spacing_mm
        return float(np.clip(square_mm, _LEAST_MARGIN_MM, _MOST_MARGIN_MM))

    @property
    def width_mm(self) -> float:
        """Of the page; the ruler must fit."""
        return max(self.size_mm[0], RULER_MM) + 2.0 * self.margin_mm

    @property
    def height_mm(self) -> float:
        """Of the page."""
        text_mm = _LINE_MM * len(self.caption) + 0.5 * _LEAST_MARGIN_MM
        return self.ruler_mm[1] + _RULER_HEIGHT_MM + text_mm

    @property
    def page_from_board_mm(self) -> FloatArray:
        """(2,) where the board's origin lies on the page."""
        left = 0.5 * (self.width_mm - self.size_mm[0])
        return np.array([left, self.margin_mm]) - self.drawing.low_mm

    @property
    def ruler_mm(self) -> tuple[float, float]:
        """Where the ruler begins."""
        x = 0.5 * (self.width_mm - RULER_MM)
        return x, self.size_mm[1] + 2.0 * self.margin_mm

    @cached_property
    def caption(self) -> list[str]:
        """Lines under the ruler: the board's file, and how to check the printer."""
        width, height = self.size_mm
        advice = (
            f"Print at 100 %, not fitted to the page. The line above is {RULER_MM:g} mm long, the "
            f"board {width:g} x {height:g} mm: measure both, and glue the paper to a flat plate."
        )
        if isinstance(self.board, Plate):
            advice += " Cut it out along the thin line; leave the white around the markers."
            if self.folds_mm:
                advice += f" Fold it back at the ticks, by {self.board.fold_deg:g} deg."
        n_letters = int((self.width_mm - _LEAST_MARGIN_MM) / _LETTER_MM)
        keys = textwrap.wrap(json.dumps(self.keys), n_letters, break_on_hyphens=False)
        return keys + textwrap.wrap(advice, n_letters)

    @property
    def paper(self) -> str | None:
        """The smallest paper, A4 to A0, that the page fits on; None: it is larger than A0."""
        long, short = max(self.width_mm, self.height_mm), min(self.width_mm, self.height_mm)
        for name, (longest, shortest) in _PAPERS_MM.items():
            if long <= longest and short <= shortest:
                return name
        return None


def render_page(sheet: Sheet, form: Literal["pdf", "svg"]) -> bytes:
    """The page as a file, to scale."""
    # Slow to import, and of no use to any other command.
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    size = (sheet.width_mm / _MM_PER_INCH, sheet.height_mm / _MM_PER_INCH)
    nobody = {"Date": None} if form == "svg" else {"CreationDate": None}
    # Letters as shapes: the page looks the same where the font is missing.
    with rc_context({"svg.fonttype": "path", "svg.hashsalt": "navapp", "pdf.fonttype": 42}):
        figure = Figure(figsize=size, facecolor="white")
        axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
        axes.set(xlim=(0.0, sheet.width_mm), ylim=(sheet.height_mm, 0.0))
        axes.set_axis_off()
        _add_board(axes, sheet)
        if isinstance(sheet.board, Plate):
            _add_cuts(axes, sheet)
        _add_ruler(axes, sheet)
        _add_caption(axes, sheet)
        file = io.BytesIO()
        figure.savefig(file, format=form, metadata={"Creator": None, **nobody})
    return file.getvalue()


def _add_board(axes: Any, sheet: Sheet) -> None:
    """All black shapes as one path: no seams where cells of a marker touch."""
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path

    place = sheet.page_from_board_mm
    paths = []
    for left, top, right, bottom in sheet.drawing.rectangles_mm + np.tile(place, 2):
        corners = [(left, top), (right, top), (right, bottom), (left, bottom), (left, top)]
        paths.append(Path(corners, closed=True))
    for x, y, radius in sheet.drawing.discs_mm + np.append(place, 0.0):
        paths.append(Path.circle((x, y), radius))
    whole = Path.make_compound_path(*paths)
    axes.add_patch(PathPatch(whole, facecolor="black", edgecolor="none", linewidth=0, gid="board"))


def _add_cuts(axes: Any, sheet: Sheet) -> None:
    """A thin line round a plate, and ticks outside of it where it is folded."""
    from matplotlib.collections import LineCollection

    (left, top), (width, height) = sheet.page_from_board_mm, sheet.size_mm
    right, bottom = left + width, top + height
    lines = [[(left, top), (right, top), (right, bottom), (left, bottom), (left, top)]]
    for x in sheet.folds_mm:
        for y, outside in ((top, -_TICK_MM), (bottom, _TICK_MM)):
            lines.append([(left + x, y), (left + x, y + outside)])
    axes.add_collection(
        LineCollection(lines, colors="0.6", linewidths=_CUT_PT, gid="cuts"), autolim=False
    )


def _add_ruler(axes: Any, sheet: Sheet) -> None:
    """A line with ticks: the middles of its first and last are 100 mm apart."""
    from matplotlib.collections import LineCollection

    x, y = sheet.ruler_mm
    lines = [[(x, y), (x + RULER_MM, y)]]
    for mm in range(0, int(RULER_MM) + 1, 5):
        length_mm = 3.0 if mm % 10 == 0 else 1.5
        lines.append([(x + mm, y), (x + mm, y + length_mm)])
        if mm % 10 == 0:
            axes.text(x + mm, y + 6.0, str(mm), fontsize=_SMALL_PT, ha="center", va="baseline")
    stroke_pt = _STROKE_MM / _MM_PER_INCH * _POINTS_PER_INCH
    axes.add_collection(
        LineCollection(lines, colors="black", linewidths=stroke_pt, gid="ruler"), autolim=False
    )


def _add_caption(axes: Any, sheet: Sheet) -> None:
    top = sheet.ruler_mm[1] + _RULER_HEIGHT_MM
    for number, line in enumerate(sheet.caption):
        y = top + _LINE_MM * (number + 0.5)
        axes.text(0.5 * _LEAST_MARGIN_MM, y, line, fontsize=_SMALL_PT, va="baseline")
