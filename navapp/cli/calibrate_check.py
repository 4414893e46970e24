"""`navapp calibrate check`: how good a rig, or a display in a mirror, is today."""

import argparse
from dataclasses import replace
from datetime import date
from typing import TYPE_CHECKING, Any

import numpy as np

from navapp.cli.board_pairs import read_pairs
from navapp.cli.diagnostics import Diagnostics, check_writable, write_json
from navapp.errors import ResultError, RigError, UsageError

if TYPE_CHECKING:
    from calibration.rig.rig_check import RigCheck
    from navapp.geometry.rig import StereoRig

_EXAMPLE = """\
examples:
  navapp calibrate check rig.yml today/ --board board.json
  navapp calibrate check --display display.yml --views today/ --board board.json --rig rig.yml

A few pairs are enough: the board near and far, tilted, in the middle and at the edges.
"""


def add_parser(subparsers: Any) -> None:
    """Declare the part."""
    parser = subparsers.add_parser(
        "check",
        help="how good a rig, or a display in a mirror, is today, on new pictures",
        epilog=_EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("rig", nargs="?", metavar="RIG", help="rig file")
    parser.add_argument("images", nargs="?", metavar="IMAGES", help="folder of new pairs")
    parser.add_argument("--display", metavar="DISPLAY.yml", help="check this instead of a rig")
    parser.add_argument("--views", metavar="DIR", help="new views, as calibrate mirror takes them")
    parser.add_argument("--rig", dest="views_rig", metavar="R", help="rig that took the views")
    parser.add_argument("--lens", metavar="FILE", help="of the eye's camera, calibrated")
    parser.add_argument("--board", required=True, metavar="BOARD.json", help="what they show")
    parser.add_argument("--json", metavar="FILE", help="result for programs (- is stdout)")


def run(options: argparse.Namespace, diagnostics: Diagnostics) -> int:
    """Judge; the exit code."""
    from calibration.rig.rig_check import check_rig
    from calibration.targets.boards import read_board
    from navapp.config import find_file, load
    from navapp.geometry.rig_files import read_rig

    check_writable(options.json)
    if options.display is not None or options.views is not None:
        from navapp.cli.mirror_check import check_mirror

        return check_mirror(options, diagnostics)
    if options.rig is None or options.images is None:
        raise UsageError(
            "calibrate check needs a rig and a folder of pairs",
            remedy="give RIG and IMAGES, or --display DISPLAY.yml and --views DIR",
        )
    rig, board = read_rig(options.rig), read_board(options.board)
    pairs = read_pairs(options.images, board, diagnostics)
    if pairs.size != (rig.width, rig.height):
        raise RigError(
            f"the pictures are {pairs.size[0]}x{pairs.size[1]}, rig {options.rig} is "
            f"{rig.width}x{rig.height}",
            subject=options.rig,
            remedy="check the rig with pictures of its own cameras",
        )
    section = load(find_file(options.config)).calibration
    found = check_rig(board, rig, pairs.seen, section.worst_length)
    found = replace(found, reasons=(*_of_record(rig), *found.reasons))
    write_json(options.json, "calibrate check", _content(found, len(pairs.unseen)))
    if options.json != "-":
        _tell(found, diagnostics)
    if found.reasons:
        raise ResultError(
            f"the rig does not pass: {'; '.join(found.reasons)}",
            remedy="calibrate again",
        )
    return 0


def _of_record(rig: "StereoRig") -> tuple[str, ...]:
    """What the rig's own file says against it."""
    quality = rig.quality
    if quality is None:
        return ()
    reasons = [] if quality.is_accepted else ["its calibration was not accepted"]
    if quality.has_expired(date.today()):
        reasons.append(f"it expired on {quality.expires_on}")
    return tuple(reasons)


def _content(found: "RigCheck", n_unseen: int) -> dict[str, Any]:
    return {
        "accepted": not found.reasons,
        "reasons": list(found.reasons),
        "rms_px": found.rms_px,
        "epipolar_rms_px": found.epipolar_rms_px,
        "epipolar_offset_px": found.epipolar_offset_px,
        "length_100_mm": {
            "mean": 100.0 * found.length_mean,
            "standard_error": 100.0 * found.length_error,
        },
        "views_used": found.n_pairs,
        "views_not_seen": n_unseen,
    }


def _tell(found: "RigCheck", diagnostics: Diagnostics) -> None:
    diagnostics.say(
        f"{found.n_pairs} pairs: rms {found.rms_px:.3f} px, across the lines "
        f"{found.epipolar_rms_px:.3f} px (offset {found.epipolar_offset_px:+.3f} px)"
    )
    if np.isfinite(found.length_mean):
        diagnostics.say(
            f"a length of 100 mm on the board is measured as {100.0 * found.length_mean:.2f} +- "
            f"{100.0 * found.length_error:.2f} mm"
        )
