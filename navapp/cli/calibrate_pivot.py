"""`navapp calibrate pivot`: the tip of a tracked tool."""

import argparse
from typing import TYPE_CHECKING, Any

import numpy as np

from navapp.cli.diagnostics import Diagnostics, check_writable, write_json

if TYPE_CHECKING:
    from calibration.pivot import Pivot, PivotFit

_EXAMPLE = """\
examples:
  navapp calibrate pivot poses.csv
  navapp calibrate pivot poses.json --json tip.json

The tool's tip stands in one place while the tool is leaned and turned. CSV lines hold time_ns and
the 16 numbers of tracker_from_tool row by row (mm); JSON is {"poses": [{"matrix": [[4x4]]}]}.
"""


def add_parser(subparsers: Any) -> None:
    """Declare the part."""
    parser = subparsers.add_parser(
        "pivot",
        help="the tip of a tracked tool, from poses in which it turned about its tip",
        epilog=_EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("poses", metavar="POSES", help="poses of the tool (CSV or JSON)")
    parser.add_argument("--json", metavar="FILE", help="result for programs (- is stdout)")


def run(options: argparse.Namespace, diagnostics: Diagnostics) -> int:
    """Solve; the exit code."""
    from calibration.pivot import solve_pivot
    from navapp.cli.tool_poses import read_tool_poses

    check_writable(options.json)
    found = solve_pivot(read_tool_poses(options.poses))
    write_json(options.json, "calibrate pivot", _content(found))
    if options.json != "-":
        _tell(found, diagnostics)
    return 0


def _content(found: "Pivot") -> dict[str, Any]:
    lengths = found.robust.lengths_mm
    return {
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


def _fit_content(fit: "PivotFit", is_used: Any) -> dict[str, Any]:
    return {
        "tip_mm": fit.tip_mm.tolist(),
        "pivot_mm": fit.pivot_mm.tolist(),
        "rms_mm": float(np.sqrt(np.mean(fit.residuals_mm[is_used] ** 2))),
    }


def _tell(found: "Pivot", diagnostics: Diagnostics) -> None:
    told = _content(found)
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


def _place(values: list[float]) -> str:
    return "(" + ", ".join(f"{value:.3f}" for value in values) + ")"
