"""`navapp calibrate board`: a target to print, to scale."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from navapp.cli.diagnostics import Diagnostics, check_writable, write_json
from navapp.errors import UsageError

if TYPE_CHECKING:
    from calibration.targets.printing import Sheet

_EXAMPLE = """\
example: navapp calibrate board --board board.json --out board.pdf

board.json: {"type": "charuco", "squares_x": 11, "squares_y": 8, "square_mm": 15.0,
             "marker_mm": 11.0, "dictionary": "DICT_4X4_100"}
plate.json: {"type": "plate", "squares_x": 2, "squares_y": 2, "square_mm": 20.0,
             "marker_mm": 16.0, "dictionary": "DICT_4X4_100"}     of a tool (docs/tools.md)
Print it at 100 %, measure the line of 100 mm, and glue it to something flat.
"""


def add_parser(subparsers: Any) -> None:
    """Declare the part."""
    parser = subparsers.add_parser(
        "board",
        help="a target to print, to scale, with a ruler that checks the printer",
        epilog=_EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--board", required=True, metavar="BOARD.json", help="what to print")
    parser.add_argument("--out", required=True, metavar="F.pdf|F.svg", help="file to write")
    parser.add_argument("--json", metavar="FILE", help="result for programs (- is stdout)")


def run(options: argparse.Namespace, diagnostics: Diagnostics) -> int:
    """Draw and write."""
    from calibration.targets.boards import read_target
    from calibration.targets.printing import Sheet, render_page
    from navapp.geometry.whole_files import write_whole

    form = Path(options.out).suffix.lower().lstrip(".")
    if form not in ("pdf", "svg"):
        raise UsageError(
            f"{options.out} is neither PDF nor SVG", remedy="let it end in .pdf or .svg"
        )
    for path in (options.out, options.json):
        check_writable(path)
    sheet = Sheet(read_target(options.board))
    write_whole(options.out, render_page(sheet, "pdf" if form == "pdf" else "svg"))
    warnings = _warnings(sheet)
    for warning in warnings:
        diagnostics.warn(warning)
    content = {
        "out": options.out,
        "board": sheet.keys,
        "board_mm": list(sheet.size_mm),
        "page_mm": [sheet.width_mm, sheet.height_mm],
        "paper": sheet.paper,
        "warnings": warnings,
    }
    write_json(options.json, "calibrate board", content)
    if options.json != "-":
        fits = f", fits on {sheet.paper}" if sheet.paper else ""
        diagnostics.say(
            f"wrote {options.out}: {sheet.board}; page {sheet.width_mm:.1f} x "
            f"{sheet.height_mm:.1f} mm{fits}; print it at 100 %"
        )
    return 0


def _warnings(sheet: "Sheet") -> list[str]:
    told = []
    if sheet.paper is None:
        told.append(
            f"the page is {sheet.width_mm:.0f} x {sheet.height_mm:.0f} mm, larger than A0: have "
            "the board made on a plate, or describe a smaller one"
        )
    elif sheet.paper != "A4":
        told.append(
            f"the page is {sheet.width_mm:.0f} x {sheet.height_mm:.0f} mm, too large for A4: it "
            f"needs {sheet.paper} paper"
        )
    if getattr(sheet.board, "spacing_mm", 0.0) == 1.0:
        told.append("square_mm 1.0 means that lengths are counted in squares; these are 1 mm large")
    return told
