"""What a report says of a recording's truth: its kind, what it can show, its own errors."""

from typing import Any

from navapp.evaluation.recording.study import Studied
from navapp.evaluation.recording.truth_files import DivotTruth, OwnError, PoseTruth


def describe_truth(studied: Studied) -> list[str]:
    """Sentences for people."""
    lines = [*_describe_kind(studied), _describe_own_error(studied.truth.own_error)]
    if not studied.has_times:
        lines.append(
            "The recording has no times of its own: its pictures count as evenly spaced (--fps)."
        )
    return lines


def _describe_kind(studied: Studied) -> list[str]:
    truth, solved = studied.truth, studied.solved
    if isinstance(truth, PoseTruth):
        return [f"Poses of the {studied.bone} in {len(studied.known)} pictures."]
    if isinstance(truth, DivotTruth):
        return [
            f"{len(truth.divots_mm)} points of the {studied.bone}, touched {len(truth.touched)} "
            f"times in {len(studied.known)} pictures.",
            "Each error contains that of the touch, and is one at the touched points; the "
            "predicted bound is one at the stage's targets: they are not compared. The bone must "
            "have kept still against the camera while it was touched.",
        ]
    if solved is None:
        raise AssertionError("another tracker's frames are solved before a report")
    return [
        "Poses of another tracker. Its frames and its clock were solved with "
        f"{len(solved.solved_with)} OK poses of `{studied.leading}` in one of every two seconds; "
        f"the errors are those in {len(solved.scored)} pictures of the other seconds, which the "
        "solve never saw.",
        f"Its clock reads {solved.offset_ns / 1e6:.1f} ms more than the recording's (sd "
        f"{solved.offset_sd_ms:.1f} ms); {solved.fit_mm:.3f} mm are left in the middle one of the "
        "pictures that were solved with; the solved frames alone put the bone off by "
        f"{solved.frames_sd_mm:.3f} mm (sd) in the scored ones.",
        "The errors contain those of the other tracker, and are an upper bound in that sense; "
        "fewer of them lie within the predicted bound than of the navigation's own. "
        "An error of the poses under test that is the same throughout the recording, on the bone "
        "or in the camera, is taken up by the solved frames: this truth cannot show it. Touched "
        "points can.",
    ]


def _describe_own_error(own: OwnError) -> str:
    told = [
        f"{value:g} {unit}" for value, unit in ((own.sd_mm, "mm"), (own.sd_deg, "degrees"))
        if value is not None
    ]  # fmt: skip
    if not told:
        return "The truth's file does not state how uncertain it is itself (sd_mm, sd_deg)."
    return (
        f"The truth itself is uncertain by {' and '.join(told)} (sd), as its file states: errors "
        "of that size say nothing of the navigation."
    )


def truth_to_json(studied: Studied) -> dict[str, Any]:
    """Named values for programs."""
    truth, solved = studied.truth, studied.solved
    kind = "tracker"
    if isinstance(truth, PoseTruth):
        kind = "poses"
    elif isinstance(truth, DivotTruth):
        kind = "divots"
    told: dict[str, Any] = {
        "kind": kind,
        "pictures": len(studied.known),
        "sd_mm": truth.own_error.sd_mm,
        "sd_deg": truth.own_error.sd_deg,
    }
    if solved is not None:
        told["solved"] = {
            "by": studied.leading,
            "camera_from_tracker": solved.left_from_tracker.to_list(),
            "marker_from_model": solved.marker_from_bone.to_list(),
            "offset_ns": solved.offset_ns,
            "offset_sd_ms": solved.offset_sd_ms,
            "fit_mm": solved.fit_mm,
            "frames_sd_mm": solved.frames_sd_mm,
            "solved_with": len(solved.solved_with),
        }
    return told
