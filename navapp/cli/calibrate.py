"""`navapp calibrate`: a stereo rig that knows how good it is, a mirror, delays, a tool's tip."""

import argparse
import importlib
from typing import Any

from navapp.cli.diagnostics import Diagnostics

# What can be calibrated -> module with `add_parser(subparsers)` and `run(options, diagnostics)`.
_PARTS = {
    "board": "calibrate_board",
    "capture": "calibrate_capture",
    "stereo": "calibrate_stereo",
    "check": "calibrate_check",
    "mirror": "calibrate_mirror",
    "latency": "calibrate_latency",
    "pivot": "calibrate_pivot",
}

_EXAMPLE = """\
examples:
  navapp calibrate board --board board.json --out board.pdf
  navapp calibrate capture --board board.json --out capture/
  navapp calibrate stereo pictures/ --board board.json --out rig.yml --report rig.html
  navapp calibrate check rig.yml today/ --board board.json
  navapp calibrate mirror --out display.yml --views views/ --board board.json --rig rig.yml
  navapp calibrate mirror --out display.yml --board board.json --by-keys
  navapp calibrate latency
  navapp calibrate pivot poses.csv
"""


def add_parser(subparsers: Any) -> None:
    """Declare the verb and its parts."""
    parser = subparsers.add_parser(
        "calibrate",
        help="boards, their pictures, a stereo rig, a mirror, checks; delays; a tool's tip",
        epilog=_EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parts = parser.add_subparsers(dest="part", metavar="PART", required=True)
    for module in _PARTS.values():
        importlib.import_module(f"navapp.cli.{module}").add_parser(parts)


def run(options: argparse.Namespace, diagnostics: Diagnostics) -> int:
    """Do the part that was asked for; the exit code."""
    module = importlib.import_module(f"navapp.cli.{_PARTS[options.part]}")
    return int(module.run(options, diagnostics))
