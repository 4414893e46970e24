"""`navapp calibrate stereo`: a rig from pictures of a board."""

import argparse
import math
from dataclasses import replace
from datetime import date, timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from navapp.cli.board_pairs import read_pairs
from navapp.cli.diagnostics import Diagnostics, check_writable, write_json
from navapp.errors import InputError, ResultError, UsageError

if TYPE_CHECKING:
    from calibration.rig.rig_solution import Calibration
    from calibration.targets.boards import Board
    from calibration.targets.seen_pairs import SeenPair
    from navapp.config import CalibrationSection
    from navapp.geometry.rig import StereoRig
    from navapp.geometry.transform import FloatArray

_EXAMPLE = """\
examples:
  navapp calibrate stereo pictures/ --board board.json --out rig.yml --report rig.html
  navapp calibrate stereo pictures/ --board board.json --out rig.yml --holdout others/
  navapp calibrate stereo pictures/ --board board.json --out rig.yml --known-distance-mm 80.1

The folder holds left_0000.png, right_0000.png, ... (jpg, bmp and tif as well). A rig that misses a
limit is not written, unless with --force: then it says so of itself, and no frame is OK with it.
"""


def add_parser(subparsers: Any) -> None:
    """Declare the part."""
    parser = subparsers.add_parser(
        "stereo",
        help="solve a rig from pictures of a board, and judge it",
        epilog=_EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("images", metavar="IMAGES", help="folder of pairs")
    parser.add_argument("--board", required=True, metavar="BOARD.json", help="what was shown")
    parser.add_argument("--out", required=True, metavar="RIG.yml", help="rig file to write")
    parser.add_argument("--report", metavar="R.html", help="what a person needs to trust the rig")
    parser.add_argument(
        "--holdout",
        metavar="DIR",
        help="pairs that judge and are not solved with (default: each fifth of the views in turn)",
    )
    parser.add_argument(
        "--known-distance-mm",
        type=float,
        metavar="D",
        help="measured by hand: between the cameras' optical centres, or from the first to the "
        "last mark of the board's first row; what is nearer is compared",
    )
    parser.add_argument("--force", action="store_true", help="write a rig that is not accepted")
    parser.add_argument("--json", metavar="FILE", help="result for programs (- is stdout)")


def run(options: argparse.Namespace, diagnostics: Diagnostics) -> int:
    """Solve, judge, write; the exit code."""
    from calibration.rig.acceptance import Limits
    from calibration.rig.rig_solution import solve_rig
    from calibration.targets.boards import read_board
    from navapp.config import find_file, load
    from navapp.geometry.rig_files import write_rig

    for path in (options.out, options.report, options.json):
        check_writable(path)
    known_mm = options.known_distance_mm
    if known_mm is not None and not 0.0 < known_mm < 1e5:
        raise UsageError("--known-distance-mm must be a length", remedy="give it in mm")
    section = load(find_file(options.config)).calibration
    board = read_board(options.board)
    pairs = read_pairs(options.images, board, diagnostics)
    aside = _aside(options.holdout, board, pairs.size, diagnostics)
    limits = Limits(accept_mm=section.accept_mm, depth_mm=section.working_depth_mm)
    if is_unit(board):
        diagnostics.warn(
            "the board's unit is its own square: limits in mm are not checked, and no session "
            "takes this rig"
        )
        limits = replace(limits, accept_mm=math.inf, depth_mm=None)
    found = solve_rig(
        board, pairs.seen, pairs.size, limits=limits, aside=aside, known_distance_mm=known_mm,
        on_progress=lambda share: diagnostics.progress("solving", share),
    )  # fmt: skip
    found = replace(found, dropped=sorted([*pairs.unseen, *found.dropped], key=lambda d: d.index))
    rig = with_record(found, section, Path(options.out).stem)
    is_accepted = rig.quality is not None and rig.quality.is_accepted
    if is_accepted or options.force:
        write_rig(options.out, rig)
    if options.report:
        from calibration.report.html_report import write_report

        write_report(options.report, replace(found, rig=rig), limits)
    write_json(options.json, "calibrate stereo", make_content(found, rig))
    if options.json != "-":
        tell(found, rig, diagnostics)
    return _verdict(rig, options)


def _aside(
    folder: str | None, board: "Board", size: tuple[int, int], diagnostics: Diagnostics
) -> "list[SeenPair]":
    """Pairs that judge; none when no folder was given.

    Raises:
        InputError: pictures of another size.
        ResultError: none of them shows the board.
    """
    if folder is None:
        return []
    pairs = read_pairs(folder, board, diagnostics)
    if pairs.size != size:
        raise InputError(
            f"pictures of {folder} are {pairs.size[0]}x{pairs.size[1]}, those to solve with "
            f"{size[0]}x{size[1]}",
            subject=folder,
            remedy="set pairs of the same cameras aside",
        )
    if not pairs.seen:
        raise ResultError(
            f"no pair of {folder} shows the board",
            subject=folder,
            remedy="set pairs aside that do, or leave --holdout away",
        )
    return pairs.seen


def with_record(found: "Calibration", section: "CalibrationSection", name: str) -> "StereoRig":
    """The rig with its name and all that its file should say of it."""
    assert found.rig.quality is not None  # noqa: S101 (for the type checker: it always has one)
    today = date.today()
    quality = replace(
        found.rig.quality,
        made_on=today,
        expires_on=today + timedelta(days=section.valid_days),
        figures={
            "rms_px": found.solved.rms_px,
            "holdout_rms_px": found.held_out_rms_px,
            "epipolar_rms_px": found.epipolar_rms_px,
            "length_error_share": compute_length_error(found),
            "uncertainty_median_mm": _quantile(found.bounds_mm, 0.5),
            "views_used": len(found.pairs),
            "views_dropped": len(found.dropped),
            "coverage_left": found.covered.left,
            "coverage_right": found.covered.right,
            "working_near_mm": found.depth_mm[0],
            "working_far_mm": found.depth_mm[1],
            "nearest_mark_mm": found.covered.depth_mm[0],
            "farthest_mark_mm": found.covered.depth_mm[1],
        },
        covariance=found.solved.rig_covariance,
    )
    if is_unit(found.board):
        quality = replace(quality, length_unit="square")
    return replace(found.rig, quality=quality, name=name)


def is_unit(board: "Board") -> bool:
    """The board's own squares are the unit of length."""
    return board.spacing_mm == 1.0


def compute_length_error(found: "Calibration") -> float:
    """Root mean square of triangulated lengths over true ones less 1."""
    if len(found.length_ratios) == 0:
        return float("nan")
    return float(np.sqrt(np.mean((found.length_ratios - 1.0) ** 2)))


def _quantile(values: "FloatArray", share: float) -> float:
    """NaN of none."""
    return float(np.quantile(values, share)) if len(values) else math.nan


def make_content(found: "Calibration", rig: "StereoRig") -> dict[str, Any]:
    """The result for programs."""
    quality = rig.quality
    solved = found.solved
    sigmas = np.sqrt(np.diag(solved.rig_covariance))
    ratios = found.length_ratios
    return {
        "accepted": quality is not None and quality.is_accepted,
        "reasons": [] if quality is None else list(quality.reasons),
        "rms_px": solved.rms_px,
        "holdout_rms_px": found.held_out_rms_px,
        "epipolar_rms_px": found.epipolar_rms_px,
        "length_error_mm": 100.0 * compute_length_error(found),
        "length_100_mm": {
            "mean": 100.0 * float(ratios.mean()) if len(ratios) else None,
            "sd": 100.0 * float(ratios.std()) if len(ratios) else None,
        },
        "uncertainty_mm": {
            "median": _quantile(found.bounds_mm, 0.5),
            "p95": _quantile(found.bounds_mm, 0.95),
        },
        "views_used": len(found.pairs),
        "views_dropped": [{"index": one.index, "reason": one.reason} for one in found.dropped],
        "baseline_mm": rig.baseline_mm,
        "model": solved.model.name,
        "coverage": {
            "left": found.covered.left,
            "right": found.covered.right,
            "depth_mm": list(found.covered.depth_mm),
        },
        "standard_errors": {
            "focal_px": float(sigmas[0]),
            "principal_point_px": [float(sigmas[2]), float(sigmas[3])],
            "translation_mm": [float(value) for value in sigmas[-3:]],
        },
        "rig_id": rig.rig_id,
    }


def tell(found: "Calibration", rig: "StereoRig", diagnostics: Diagnostics) -> None:
    """The result for people."""
    told = make_content(found, rig)
    length, bound = told["length_100_mm"], told["uncertainty_mm"]
    diagnostics.say(
        f"{len(found.pairs)} pairs, {found.solved.model.name}: rms {told['rms_px']:.3f} px, "
        f"held out {told['holdout_rms_px']:.3f} px, across the lines "
        f"{told['epipolar_rms_px']:.3f} px"
    )
    for one in found.dropped:
        diagnostics.say(f"pair {one.index} is not used: {one.reason}")
    if length["mean"] is not None:
        diagnostics.say(
            f"a length of 100 mm on the board is measured as {length['mean']:.2f} +- "
            f"{length['sd']:.2f} mm; baseline {rig.baseline_mm:.2f} mm"
        )
    if len(found.bounds_mm):
        diagnostics.say(
            f"95 % of triangulated points in the working volume are right to {bound['median']:.2f} "
            f"mm (middle of the volume), {bound['p95']:.2f} mm (nearly all of it)"
        )


def _verdict(rig: "StereoRig", options: argparse.Namespace) -> int:
    quality = rig.quality
    if quality is None or quality.is_accepted:
        return 0
    remedy = (
        f"{options.out} was written as not accepted"
        if options.force
        else "show the board as the reasons ask, or write it anyway with --force"
    )
    raise ResultError(f"the rig is not accepted: {'; '.join(quality.reasons)}", remedy=remedy)
