"""`navapp register`: where a model lies in a scene."""

import argparse
import re
import time
from typing import TYPE_CHECKING, Any

import numpy as np

from navapp.cli.compiling import run_compiled
from navapp.cli.diagnostics import Diagnostics, check_writable, write_json
from navapp.cli.register_inputs import (
    RegisterInputs,
    compute_since_ms,
    read_inputs,
)
from navapp.errors import ResultError, UsageError
from navapp.geometry.transform import FloatArray, skew

if TYPE_CHECKING:
    from navapp.registration import Registration

_EXAMPLE = """\
examples:
  navapp register scan.ply femur.stl --initial start.json --camera 0 0 0 --json result.json
  navapp register scan.pcd scan_before.pcd --global --units m --aligned aligned.ply

start.json holds {"matrix": [[4x4]]}, rough scene_from_model; start.txt four lines of four numbers.
The exit code is 0 for CONVERGED only, 4 for DEGENERATE and FAILED.
"""


def add_parser(subparsers: Any) -> None:
    """Declare the verb."""
    parser = subparsers.add_parser(
        "register",
        help="where a model lies in a scene, both clouds or meshes",
        epilog=_EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    # argparse knows -1 and -0.5 as numbers, but not -1e-05.
    parser._negative_number_matcher = re.compile(r"^-(\d+\.?|\d*\.\d+)([eE][-+]?\d+)?$")  # noqa: SLF001
    parser.add_argument("scene", metavar="SCENE", help="PLY, STL, OBJ, VTK, PCD or XYZ: its points")
    parser.add_argument("model", metavar="MODEL", help="mesh, or cloud, of one of these kinds")
    parser.add_argument(
        "--method",
        choices=("bimcc", "bimcc-literal", "icp"),
        default="bimcc",
        help="bimcc-literal is the paper's own, icp its baseline",
    )
    parser.add_argument(
        "--initial",
        metavar="T.json",
        help="rough scene_from_model, lengths in the files' unit (or .txt)",
    )
    parser.add_argument("--global", dest="is_global", action="store_true", help="try many starts")
    parser.add_argument(
        "--camera",
        type=float,
        nargs=3,
        metavar=("X", "Y", "Z"),
        help="where the scene was seen from, in its coordinates and unit; what faces away does not "
        "pair",
    )
    parser.add_argument(
        "--units",
        choices=("mm", "m", "none"),
        default="mm",
        help="of both files, of --initial, --camera and the result (default mm); none: the files' "
        "own unit, limits follow the spacing of the model's points",
    )
    parser.add_argument("--aligned", metavar="OUT.ply", help="the model in the scene's coordinates")
    parser.add_argument("--json", metavar="FILE", help="result for programs (- is stdout)")


def run(options: argparse.Namespace, diagnostics: Diagnostics) -> int:
    """Register, write what was asked for; the exit code."""
    _check(options)
    work = read_inputs(options)
    for warning in work.warnings:
        diagnostics.warn(warning)
    answer, register_ms = _register(work, options, diagnostics)
    content = _content(work, answer, register_ms, options)
    write_json(options.json, "register", content)
    if options.json != "-":
        _tell(content, options.units, diagnostics)
    has_pose = content["scene_from_model"] is not None
    if options.aligned and has_pose:
        _write_aligned(options, work, answer)
    elif options.aligned:
        diagnostics.warn(f"{options.aligned} was not written, as there is no pose")
    if content["status"] == "CONVERGED":
        return 0
    raise ResultError(
        f"the registration is {content['status']}: {'; '.join(answer.explanations)}",
        remedy=_remedy(has_pose, options),
    )


def _check(options: argparse.Namespace) -> None:
    if options.is_global and options.method != "bimcc":
        raise UsageError(
            f"--global does not go with --method {options.method}",
            remedy="leave one of them away, the paper's methods start once",
        )
    if options.camera is not None and not np.isfinite(options.camera).all():
        raise UsageError("--camera needs three finite numbers", remedy="give its place as X Y Z")
    check_writable(options.aligned)
    check_writable(options.json)


def _register(
    work: RegisterInputs, options: argparse.Namespace, diagnostics: Diagnostics
) -> tuple["Registration", float]:
    """The answer, and how many ms it took."""
    from navapp.registration import register

    def measure() -> tuple["Registration", float]:
        started = time.perf_counter()
        answer = register(
            work.scene,
            work.model,
            work.start,
            options.method,
            is_global=options.is_global,
            on_progress=lambda share: diagnostics.progress("starts", share),
        )
        return answer, compute_since_ms(started)

    return run_compiled(measure, diagnostics)


def _content(
    work: RegisterInputs,
    answer: "Registration",
    register_ms: float,
    options: argparse.Namespace,
) -> dict[str, Any]:
    """The result for programs, in the files' unit."""
    from navapp.registration import Outcome

    estimate = answer.estimate
    pose = work.pose(estimate.camera_from_bone)
    has_pose = answer.outcome is not Outcome.FAILED
    fixes_all = has_pose and estimate.has_finite_covariance
    n_fit = estimate.inlier_fraction * estimate.n_points
    return {
        "units": {"length": options.units, "angle": "deg"},
        "scene_from_model": pose.to_list() if has_pose else None,
        "status": answer.outcome.value,
        "reasons": list(answer.explanations),
        "iterations": estimate.iterations,
        "rms": work.length(estimate.rms_mm),
        "inlier_share": n_fit / len(work.scene),
        "covariance": _covariance(work, answer).tolist() if fixes_all else None,
        "predicted_tre": work.length(answer.predicted_tre_mm) if fixes_all else None,
        "coverage": answer.coverage,
        "starts": answer.n_starts,
        "method": options.method,
        "scene_points": len(work.scene),
        "model_vertices": len(work.model.points_mm),
        "timing_ms": {
            "read": work.read_ms,
            "prepare": work.prepare_ms,
            "register": register_ms,
            "total": work.read_ms + work.prepare_ms + register_ms,
        },
        "warnings": list(work.warnings),
        **({} if has_pose else {"best_guess": pose.to_list()}),
    }


def _covariance(work: RegisterInputs, answer: "Registration") -> FloatArray:
    """(6, 6) of the twist about the mean of the file's vertices, in the files' unit."""
    estimate = answer.estimate
    centre_mm = work.factor * work.file.whole.centroid_mm
    offset_mm = estimate.camera_from_bone.rotate(centre_mm - work.model.centre_mm)
    change = np.eye(6)
    change[:3, 3:] = -skew(offset_mm)
    change[:3] /= work.factor
    moved: FloatArray = change @ estimate.covariance @ change.T
    return moved


def _tell(content: dict[str, Any], units: str, diagnostics: Diagnostics) -> None:
    """The result for people."""
    has_unit = units != "none"
    unit = f" {units}" if has_unit else ""
    parts = []
    if np.isfinite(content["rms"]):
        parts.append(f"rms {content['rms']:.3g}{unit}")
    parts.append(f"{100 * content['inlier_share']:.0f} % of {content['scene_points']} points fit")
    if content["predicted_tre"] is not None:
        parts.append(f"predicted error at most {content['predicted_tre']:.2g}{unit} (95 %)")
    if content["coverage"] is not None:
        parts.append(f"{100 * content['coverage']:.0f} % of what faces the camera was seen")
    starts = content["starts"]
    parts.append(f"{starts} start{'s' if starts > 1 else ''}")
    parts.append(f"{content['timing_ms']['register']:.0f} ms")
    if not has_unit:
        parts.append("lengths in the files' own unit")
    diagnostics.say(f"{content['status']}: {', '.join(parts)}")
    if content["scene_from_model"] is not None:
        diagnostics.say("scene_from_model")
        for row in content["scene_from_model"]:
            diagnostics.say(" ".join(f"{value + 0.0:14.8g}" for value in row))


def _write_aligned(
    options: argparse.Namespace, work: RegisterInputs, answer: "Registration"
) -> None:
    """The model as its file holds it, in the scene's coordinates and unit."""
    from navapp.geometry.ply import write_ply

    aligned = work.file.whole.transform(work.pose(answer.estimate.camera_from_bone))
    write_ply(options.aligned, aligned, space="scene", unit=options.units)


def _remedy(has_pose: bool, options: argparse.Namespace) -> str:
    if has_pose:
        return "give a scene that shows more of the surface"
    if options.method != "bimcc":
        return "start nearer, or take --method bimcc"
    if options.is_global:
        return "give --initial nearer to the truth, or a scene with more of the surface"
    return "give a nearer --initial, or --global"
