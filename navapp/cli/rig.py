"""`navapp rig`: prints what a rig's file holds, or converts it to another format."""

import argparse
from datetime import date
from typing import TYPE_CHECKING, Any

import numpy as np

from navapp.cli.diagnostics import Diagnostics, check_writable, write_json
from navapp.errors import ResultError

if TYPE_CHECKING:
    from navapp.geometry.camera import Camera
    from navapp.geometry.rig import RigQuality, StereoRig

_FORMATS = ("opencv-yaml", "opencv-xml", "ros", "kalibr")

_EXAMPLE = """\
examples:
  navapp rig show rig.yml
  navapp rig convert rig.yml rig.xml
  navapp rig convert rig.yml ros_pair            a folder: left.yaml and right.yaml for ROS
  navapp rig convert camchain-today.yaml rig.yml

What is read is recognised by its content, what is written by its name: .xml is OpenCV's XML, .yml
and .yaml OpenCV's YAML, or Kalibr's where the name holds `camchain`; a name without ending is the
folder of a ROS pair.
"""


def add_parser(subparsers: Any) -> None:
    """Declare the verb."""
    parser = subparsers.add_parser(
        "rig",
        help="what a rig's file says, or the same rig for OpenCV, ROS or Kalibr",
        epilog=_EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parts = parser.add_subparsers(dest="part", metavar="PART", required=True)
    show = parts.add_parser("show", help="ids, geometry, verdict, date and figures")
    show.add_argument("rig", metavar="R", help="rig file, or the folder of a ROS pair")
    convert = parts.add_parser("convert", help="the same rig in another format")
    convert.add_argument("rig", metavar="IN", help="rig file, or the folder of a ROS pair")
    convert.add_argument("out", metavar="OUT", help="file or folder to write")
    convert.add_argument("--to", choices=_FORMATS, help="format (default: by the name of OUT)")
    convert.add_argument(
        "--force",
        action="store_true",
        help="also when the rig was not accepted and the format cannot say so",
    )
    for part in (show, convert):
        part.add_argument("--json", metavar="FILE", help="result for programs (- is stdout)")


def run(options: argparse.Namespace, diagnostics: Diagnostics) -> int:
    """Do it."""
    from calibration.exchange.formats import read_any

    check_writable(options.json)
    if options.part == "convert":
        return _convert(options, diagnostics)
    rig, form = read_any(options.rig)
    write_json(options.json, "rig show", {"format": form, **make_content(rig, date.today())})
    if options.json != "-":
        diagnostics.say(format_text(rig, date.today()))
    return 0


def _convert(options: argparse.Namespace, diagnostics: Diagnostics) -> int:
    from calibration.exchange.formats import format_of_name, list_losses, read_any, write_as

    form = options.to or format_of_name(options.out)
    # A ROS pair is a folder, which its writer looks at.
    if form != "ros":
        check_writable(options.out)
    rig, before = read_any(options.rig)
    is_refused = rig.quality is not None and not rig.quality.is_accepted
    if is_refused and form in ("ros", "kalibr") and not options.force:
        raise ResultError(
            f"rig {options.rig} was not accepted, and {form} has no place to say so",
            subject=options.rig,
            remedy="calibrate again, or add --force",
        )
    write_as(form, options.out, rig)
    warnings = list_losses(rig, form)
    for warning in warnings:
        diagnostics.warn(warning)
    result = {"from": before, "to": form, "out": options.out, "rig_id": rig.rig_id}
    write_json(options.json, "rig convert", {**result, "warnings": warnings})
    if options.json != "-":
        diagnostics.say(f"wrote {options.out} ({form})")
    return 0


def make_content(rig: "StereoRig", today: date) -> dict[str, Any]:
    """A rig for programs."""
    return {
        "rig_id": rig.rig_id,
        "name": rig.name,
        "serials": list(rig.serials),
        "image_size": [rig.width, rig.height],
        "baseline_mm": rig.baseline_mm,
        "toe_in_deg": compute_toe_in_deg(rig),
        "right_from_left": rig.right_from_left.to_list(),
        "left": _lens(rig.left),
        "right": _lens(rig.right),
        "quality": None if rig.quality is None else _record(rig.quality, today),
    }


def compute_toe_in_deg(rig: "StereoRig") -> float:
    """How far the optical axes turn towards each other, seen from above; negative: apart."""
    axis = rig.right_from_left.rotation.T @ np.array([0.0, 0.0, 1.0])
    return float(np.degrees(np.arctan2(-axis[0], axis[2])))


def format_text(rig: "StereoRig", today: date) -> str:
    """A rig for people."""
    told = make_content(rig, today)
    left, right = told["left"], told["right"]
    serials = " and ".join(serial or "unknown" for serial in rig.serials)
    lines = [
        f"rig {rig.name or '(without a name)'}, id {rig.rig_id}, cameras {serials}",
        f"  pictures {rig.width} x {rig.height} px, baseline {rig.baseline_mm:.3f} mm, "
        f"toe-in {told['toe_in_deg']:.2f} deg",
        *(
            f"  {side}: focal lengths {lens['focal_px'][0]:.2f} and {lens['focal_px'][1]:.2f} px, "
            f"centre ({lens['centre_px'][0]:.2f}, {lens['centre_px'][1]:.2f}) px, "
            f"{len(lens['distortion'])} coefficients of distortion"
            for side, lens in (("left", left), ("right", right))
        ),
    ]
    if rig.quality is None:
        return "\n".join([*lines, "  no quality record: nobody says how good it is"])
    return "\n".join(lines + _describe_quality(rig.quality, today))


def _describe_quality(quality: "RigQuality", today: date) -> list[str]:
    if quality.is_accepted:
        lines = ["  accepted by its calibration"]
    else:
        why = "; ".join(quality.reasons) or "no reason is recorded"
        lines = [f"  NOT accepted by its calibration: {why}"]
    if quality.uncertainty_mm is not None:
        lines.append(
            f"  95 % of triangulated points in the working volume are right to "
            f"{quality.uncertainty_mm:.2f} mm"
        )
    if quality.made_on is not None:
        lines.append(f"  made on {quality.made_on}")
    if quality.expires_on is not None:
        word = "EXPIRED on" if quality.has_expired(today) else "good until"
        lines.append(f"  {word} {quality.expires_on}")
    return lines + [f"  {name}: {value:.6g}" for name, value in quality.figures.items()]


def _lens(camera: "Camera") -> dict[str, Any]:
    matrix = camera.matrix
    return {
        "focal_px": [float(matrix[0, 0]), float(matrix[1, 1])],
        "centre_px": [float(matrix[0, 2]), float(matrix[1, 2])],
        "distortion": camera.distortion.tolist(),
    }


def _record(quality: "RigQuality", today: date) -> dict[str, Any]:
    return {
        "accepted": quality.is_accepted,
        "reasons": list(quality.reasons),
        "uncertainty_mm": quality.uncertainty_mm,
        "made_on": None if quality.made_on is None else quality.made_on.isoformat(),
        "expires_on": None if quality.expires_on is None else quality.expires_on.isoformat(),
        "expired": quality.has_expired(today),
        "figures": dict(quality.figures),
    }
