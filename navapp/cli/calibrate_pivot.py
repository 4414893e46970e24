"""`navapp calibrate pivot`: the tip of a tool, live with its plate, or from recorded poses."""

import argparse
from contextlib import ExitStack
from dataclasses import replace
from datetime import date
from typing import TYPE_CHECKING, Any

import numpy as np

from navapp.cli.diagnostics import Diagnostics, check_writable, write_json
from navapp.errors import ResultError, UsageError

if TYPE_CHECKING:
    from calibration.pivot import Pivot, PivotFit
    from calibration.tool_axis import ToolAxis
    from navapp.config import Configuration
    from navapp.control.tool_calibration.calibrating import ToolCalibrating
    from navapp.tools.plate import Plate

_EXAMPLE = """\
examples:
  navapp calibrate pivot --out pointer.json                     the simulated pointer
  navapp calibrate pivot --tool drill --out drill.json          its axis too
  navapp --config mine.toml calibrate pivot --board plate.json --out pointer.json
  navapp calibrate pivot poses.csv                              recorded poses
  navapp calibrate pivot poses.csv --turns turn.csv --json tip.json

Live, the tool's tip stands in a small hole while the tool is leaned to all sides; the screen shows
how the error falls, and ends when the tip is known. A drill is then turned about itself, twice. The
plate's paper is measured on the way: nobody prints without an error.
Recorded: CSV lines hold time_ns and the 16 numbers of tracker_from_tool row by row (mm); JSON is
{"poses": [{"matrix": [[4x4]]}]}.
"""
# Without a screen: far more frames than a calibration takes.
_MOST_FRAMES = 3000


def add_parser(subparsers: Any) -> None:
    """Declare the part."""
    parser = subparsers.add_parser(
        "pivot",
        help="the tip of a tool, and a drill's axis: live, or from poses",
        epilog=_EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "poses", metavar="POSES", nargs="?", help="recorded poses (CSV or JSON); none: live"
    )
    parser.add_argument(
        "--turns", metavar="POSES", nargs="+", default=[], help="recorded turns about itself"
    )
    parser.add_argument("--board", metavar="PLATE.json", help="live: the tool's printed plate")
    parser.add_argument("--out", metavar="TOOL.json", help="live: file of the tool, for [tools]")
    parser.add_argument(
        "--tool",
        choices=("pointer", "drill"),
        default="pointer",
        help="a drill has an axis, too",
    )
    parser.add_argument(
        "--headless", action="store_true", help="live: no screen; a simulated hand does it"
    )
    parser.add_argument("--json", metavar="FILE", help="result for programs (- is stdout)")


def run(options: argparse.Namespace, diagnostics: Diagnostics) -> int:
    """Solve; the exit code."""
    check_writable(options.json)
    if options.poses is None:
        return _run_live(options, diagnostics)
    if options.board or options.out or options.headless:
        raise UsageError(
            "recorded poses say nothing of a plate: --board, --out and --headless are for live use",
            remedy="leave them away, or leave POSES away",
        )
    from calibration.pivot import solve_pivot
    from calibration.tool_axis import solve_axis
    from navapp.cli.tool_poses import read_tool_poses

    found = solve_pivot(read_tool_poses(options.poses))
    turns = [read_tool_poses(path) for path in options.turns]
    axis = solve_axis(turns, found.robust.tip_mm) if turns else None
    _report(found, axis, options, diagnostics)
    return 0


def _run_live(options: argparse.Namespace, diagnostics: Diagnostics) -> int:
    from navapp.config import find_file, load
    from navapp.control.tool_calibration.calibrating import ToolCalibrating, ToolSettings
    from navapp.devices.tool_calibration import open_tool_calibration
    from navapp.tools.tool_files import write_tool

    if options.turns:
        raise UsageError("--turns needs POSES", remedy="live turns are asked for by --tool drill")
    check_writable(options.out)
    configuration = load(find_file(options.config))
    plate = _find_plate(options, configuration)
    with ExitStack() as undo:
        opened, hand = open_tool_calibration(
            configuration, options.tool, plate, is_headless=options.headless
        )
        undo.callback(opened.camera.close)
        settings = ToolSettings(has_axis=options.tool == "drill")
        calibrating = ToolCalibrating(
            opened.camera, opened.clock, opened.rig, plate, settings, hand
        )
        if options.headless:
            follow(calibrating, diagnostics)
        elif (code := _on_screen(calibrating)) != 0:
            return code
    if calibrating.snapshot.phase.value == "over":
        raise ResultError("the calibration was left: no tool is written")
    tool, found, axis = calibrating.collected.solve(date.today(), opened.rig.rig_id)
    # What is told is what is written, with what no residual shows.
    found = replace(found, covariance_mm2=tool.tip_covariance_mm2)
    if options.out is not None:
        write_tool(options.out, tool)
    _report(found, axis, options, diagnostics)
    if options.out is not None and options.json != "-":
        diagnostics.say(f"wrote {options.out}; name it in [tools] {options.tool}")
    return 0


def _find_plate(options: argparse.Namespace, configuration: "Configuration") -> "Plate":
    """The described one; of the simulated tool when none is described."""
    from navapp.devices.simulated_tool import SIMULATED_PLATES
    from navapp.tools.plate_files import read_plate

    is_simulated = configuration.camera.backend == "simulated"
    if options.headless and not is_simulated:
        raise UsageError(
            "--headless needs the simulated rig: nobody else leans the tool",
            remedy="leave --headless away",
        )
    if options.board is not None:
        return read_plate(options.board)
    if not is_simulated:
        raise UsageError("a live calibration needs --board PLATE.json, the tool's printed plate")
    return SIMULATED_PLATES[options.tool]


def follow(calibrating: "ToolCalibrating", diagnostics: Diagnostics) -> None:
    """Without a screen: until it is done."""
    from navapp.control.recent_events import list_new_events

    told = 0
    for _ in range(_MOST_FRAMES):
        snapshot = calibrating.step()
        for text in list_new_events(snapshot, told):
            diagnostics.detail(text)
        told = snapshot.n_events
        if snapshot.is_over:
            diagnostics.progress("done", 1.0)
            return
        done = min(snapshot.n_poses / 60.0, 1.0) if snapshot.n_kept == 0 else 0.99
        diagnostics.progress(snapshot.phase.value, done)
    raise ResultError(
        f"no tip was found in {_MOST_FRAMES} pictures ({calibrating.snapshot.missing or 'seen'})",
        remedy="see that the plate faces both cameras",
    )


def _on_screen(calibrating: "ToolCalibrating") -> int:
    """The operator does it; 0, or the code of what ended the screen."""
    from navapp.cli.guided_screen import run_on_screen
    from navapp.ui.tool_calibration.app import run_tool_app

    return run_on_screen(calibrating, "tool", run_tool_app)


def _report(
    found: "Pivot",
    axis: "ToolAxis | None",
    options: argparse.Namespace,
    diagnostics: Diagnostics,
) -> None:
    write_json(options.json, "calibrate pivot", _content(found, axis))
    if options.json != "-":
        _tell(found, axis, diagnostics)


def _content(found: "Pivot", axis: "ToolAxis | None") -> dict[str, Any]:
    lengths = found.robust.lengths_mm
    content = {
        **_fit_content(found.robust, found.is_used),
        "standard_errors_mm": [float(v) for v in np.sqrt(np.diag(found.covariance_mm2))],
        "covariance_mm2": found.covariance_mm2.tolist(),
        "bound_mm": found.bound_mm,
        "half_angle_deg": found.half_angle_deg,
        "gain": found.gain,
        "poses": len(lengths),
        "outliers": [{"index": n, "residual_mm": float(lengths[n])} for n in found.outliers],
        "linear": _fit_content(found.linear, np.ones(len(lengths), dtype=bool)),
    }
    if axis is not None:
        content["axis"] = axis.axis.tolist()
        content["axis_sigma_deg"] = float(np.degrees(axis.sigma_rad))
        content["axis_rms_deg"] = axis.rms_deg
        content["swept_deg"] = list(axis.swept_deg)
    return content


def _fit_content(fit: "PivotFit", is_used: Any) -> dict[str, Any]:
    return {
        "tip_mm": fit.tip_mm.tolist(),
        "pivot_mm": fit.pivot_mm.tolist(),
        "rms_mm": float(np.sqrt(np.mean(fit.residuals_mm[is_used] ** 2))),
    }


def _tell(found: "Pivot", axis: "ToolAxis | None", diagnostics: Diagnostics) -> None:
    told = _content(found, axis)
    linear = told["linear"]
    diagnostics.say(
        f"tip {_place(told['tip_mm'])} mm in the tool's frame, standard errors "
        f"{_place(told['standard_errors_mm'])} mm; 95 % bound {told['bound_mm']:.2f} mm"
    )
    diagnostics.say(
        f"pivot {_place(told['pivot_mm'])} mm; rms {told['rms_mm']:.3f} mm per component over "
        f"{told['poses'] - len(told['outliers'])} of {told['poses']} poses"
    )
    for one in told["outliers"]:
        diagnostics.say(f"pose {one['index']} is left out: it is {one['residual_mm']:.2f} mm off")
    diagnostics.say(
        f"the tool leaned by up to {told['half_angle_deg']:.0f} deg; an error of one pose enters "
        f"the tip up to {told['gain']:.1f}-fold"
    )
    apart_mm = float(np.linalg.norm(found.linear.tip_mm - found.robust.tip_mm))
    diagnostics.say(
        f"least squares over all poses: tip {_place(linear['tip_mm'])} mm, pivot "
        f"{_place(linear['pivot_mm'])} mm, rms {linear['rms_mm']:.3f} mm per component "
        f"({apart_mm:.2f} mm apart)"
    )
    if axis is not None:
        swept = " and ".join(f"{one:.0f}" for one in axis.swept_deg)
        diagnostics.say(
            f"axis {_place(told['axis'])} towards the tip, standard error "
            f"{told['axis_sigma_deg']:.2f} deg; turned by {swept} deg"
        )


def _place(values: list[float]) -> str:
    return "(" + ", ".join(f"{value:.3f}" for value in values) + ")"
