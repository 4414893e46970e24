"""What `run` and `replay` answer: frames, their summary, and both for people."""

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from navapp.control.commands import DistrustRig
from navapp.control.frame_result import FrameResult
from navapp.control.recorder import measured_to_json, reading_to_json
from navapp.control.session import describe_moved_rig
from navapp.control.states import SessionState, Snapshot
from navapp.limb import LimbMeasurement
from navapp.values import FrameTimings, Measured, Reason, Status, TrackedFrame, join_measured

_ANGLES = ("flexion", "varus", "internal_rotation")
# Gaps count as those of a flexion when the knee is bent by so much more or less; chosen.
_NEAR_DEG = 10.0


def frame_to_json(result: FrameResult, tre_mm: Mapping[str, float | None]) -> dict[str, Any]:
    """One entry of `frames`.

    Args:
        result: of the frame.
        tre_mm: bone -> error, of the bones whose truth is known.
    """
    # Frames are handled in no other fault.
    is_rig_moved = result.state is SessionState.FAULT
    silence = Reason.RIG_MOVED if is_rig_moved else Reason.NOT_NAVIGATING
    return {
        "index": result.frame.index,
        "state": result.state.value,
        "stage": result.stage.name,
        "bone": result.stage.bone,
        **_answer_to_json(result.tracked, result.timings, tre_mm.get(result.stage.bone), silence),
        "bodies": {
            name: _answer_to_json(tracked, tracked.timings, tre_mm.get(name))
            for name, tracked in result.others.items()
        },
        "bone_version": result.bone_version,
        "measured": {name: measured_to_json(one) for name, one in result.measured.items()},
        "tools": {kind: reading_to_json(one) for kind, one in result.tools.items()},
        **({} if result.limb is None else {"limb": limb_to_json(result.limb)}),
    }


def limb_to_json(limb: LimbMeasurement) -> dict[str, Any]:
    """Angles and gaps of a pair of pictures; null where they are not known, and why."""
    angles, gaps = limb.angles, limb.gaps
    found: dict[str, Any] = {
        f"{name}_deg": None if angles is None else getattr(angles, f"{name}_deg")
        for name in _ANGLES
    }
    found["bound_deg"] = {
        name: None if angles is None else getattr(angles, f"{name}_bound_deg") for name in _ANGLES
    }
    for name in ("medial", "lateral"):
        found[f"gap_{name}_mm"] = gaps[name].mm if name in gaps else None
    found["bound_mm"] = {
        name: gaps[name].bound_mm if name in gaps else None for name in ("medial", "lateral")
    }
    return {**found, "not_known": limb.missing}


def summarise_gaps(limbs: Sequence[LimbMeasurement | None]) -> dict[str, Any]:
    """The gaps where the knee was nearest to 0 and to 90 degrees; null beyond 10 degrees of it."""
    known = [limb for limb in limbs if limb is not None and limb.angles is not None]

    def find(flexion_deg: float) -> dict[str, Any] | None:
        def off_deg(limb: LimbMeasurement) -> float:
            known_deg = math.inf if limb.angles is None else limb.angles.flexion_deg
            return abs(known_deg - flexion_deg)

        nearest = min(known, key=off_deg, default=None)
        is_near = nearest is not None and off_deg(nearest) <= _NEAR_DEG
        return limb_to_json(nearest) if nearest is not None and is_near else None

    return {"at_0_deg": find(0.0), "at_90_deg": find(90.0)}


def summarise_measured(measured: Sequence[Mapping[str, Measured]]) -> dict[str, Any]:
    """Faces of cuts and holes, over all frames that have measured them."""
    names = dict.fromkeys(name for frame in measured for name in frame)
    return {
        name: measured_to_json(join_measured([frame[name] for frame in measured if name in frame]))
        for name in names
    }


def _answer_to_json(
    tracked: TrackedFrame | None,
    timings: FrameTimings,
    tre_mm: float | None,
    silence: Reason = Reason.NOT_NAVIGATING,
) -> dict[str, Any]:
    """What was said of one bone; when nothing was, why."""
    pose = None if tracked is None else tracked.left_from_bone
    estimate = None if tracked is None else tracked.estimate
    return {
        "status": Status.LOST.value if tracked is None else tracked.verdict.status.value,
        "reasons": (
            [silence.value]
            if tracked is None
            else [reason.value for reason in tracked.verdict.reasons]
        ),
        "camera_from_model": None if pose is None else pose.to_list(),
        "covariance": None if estimate is None else estimate.covariance.tolist(),
        "predicted_tre_mm": None if tracked is None else tracked.verdict.predicted_tre_mm,
        "tre_mm": tre_mm,
        "timing_ms": {
            "rectify": timings.rectify_ms,
            "stereo": timings.stereo_ms,
            "nearer": timings.nearer_beside_ms,
            "fill": timings.fill_ms + timings.fill_beside_ms,
            "estimate": timings.estimate_ms,
            "judge": timings.judge_ms,
            "overlay": timings.overlay_ms,
            "total": timings.total_ms,
        },
    }


def rig_to_json(snapshot: Snapshot) -> dict[str, Any]:
    """The `rig` object of a live session: is it believed, and what a known length said last."""
    check = snapshot.length_check
    return {
        "name": snapshot.rig_name,
        "alarm": snapshot.rig_alarm or None,
        "length_check": None
        if check is None
        else {
            "length_100_mm": {"mean": 100.0 * check.ratio, "bound_95": 100.0 * check.bound},
            "looks": check.n_looks,
            "finding": check.finding.value,
            "age_s": (snapshot.time_ns - check.captured_ns) / 1e9,
        },
    }


def rig_alarm_to_json(name: str, after: int, found: DistrustRig) -> dict[str, Any]:
    """The `rig` object of a replay: after which frame the session found the rig moved, and how."""
    return {"name": name, "alarm": describe_moved_rig(found.why), "moved_after_frame": after}


def frame_text(result: FrameResult) -> str:
    """One frame for people: number, state, verdict, time, what is wrong with it, other bones."""
    verdict = None if result.tracked is None else result.tracked.verdict
    word = "-" if verdict is None else verdict.status.value
    reasons = () if verdict is None else verdict.reasons
    why = "".join(f"; {reason.value}" for reason in reasons)
    others = "".join(
        f" | {name} {tracked.verdict.status.value} {tracked.timings.total_ms:.0f} ms"
        for name, tracked in result.others.items()
    )
    return (
        f"frame {result.frame.index} {result.state.value} {word} "
        f"{result.timings.total_ms:.0f} ms{why}{others}"
    )


def summarise(frames: Sequence[dict[str, Any]], seconds: float) -> dict[str, Any]:
    """The `summary` object.

    Its `latency_ms` holds percentiles of the processing time (`timing_ms.total`): the frames of
    headless sessions and replays wait to be read and have no latency (docs/conventions.md).
    """
    totals = [frame["timing_ms"]["total"] for frame in frames if frame["timing_ms"]["total"] > 0]
    # Every pose that was accepted and followed, OK or not: leaving out the doubtful ones would
    # flatter. What was offered for review and refused is no result of tracking.
    errors = [
        frame["tre_mm"]
        for frame in frames
        if frame["tre_mm"] is not None and frame["state"] == SessionState.NAVIGATING.value
    ]
    return {
        **_count(frames),
        "bodies": _others(frames),
        "fps": len(frames) / seconds if seconds > 0 and frames else None,
        "latency_ms": (
            {f"p{q}": float(np.percentile(totals, q)) for q in (50, 95, 99)}
            if totals
            else {"p50": None, "p95": None, "p99": None}
        ),
        "tre_mm": (
            {
                "median": float(np.median(errors)),
                "p95": float(np.percentile(errors, 95)),
                "max": float(np.max(errors)),
            }
            if errors
            else None
        ),
    }


def _others(frames: Sequence[dict[str, Any]]) -> dict[str, dict[str, int]]:
    """The other bones' answers, counted for each."""
    turns: dict[str, list[dict[str, Any]]] = {}
    for frame in frames:
        for name, answer in frame["bodies"].items():
            turns.setdefault(name, []).append(answer)
    return {name: _count(answers) for name, answers in turns.items()}


def _count(answers: Sequence[dict[str, Any]]) -> dict[str, int]:
    statuses = [answer["status"] for answer in answers]
    counts = {status.value.lower(): statuses.count(status.value) for status in Status}
    return {"frames": len(answers), **counts}


def _count_text(counts: dict[str, int]) -> str:
    return (
        f"{counts['frames']} frames: {counts['ok']} OK, {counts['degraded']} degraded, "
        f"{counts['lost']} lost"
    )


def _measured_text(name: str, face: Mapping[str, float]) -> str:
    if "diameter_mm" in face:
        return (
            f"hole {name}: {face['off_mm']:.2f} mm (+- {face['bound_mm']:.2f}) off its entry, "
            f"{face['diameter_mm']:.1f} mm wide, {100.0 * face['seen_share']:.0f} % of its rim seen"
        )
    return (
        f"cut {name}: {face['angle_deg']:.2f} deg (+- {face['bound_deg']:.2f}) and "
        f"{face['offset_mm']:+.2f} mm (+- {face['bound_mm']:.2f}) from its plan, "
        f"{100.0 * face['seen_share']:.0f} % of it seen"
    )


# So many reasons are told after a session; the others stand in its JSON.
_MOST_REASONS = 4


def reasons_text(frames: Sequence[Mapping[str, Any]]) -> str:
    """Why frames were not OK, the most frequent reason first; empty when all were."""
    missed = [frame for frame in frames if frame["status"] != "OK"]
    counts = Counter(reason for frame in missed for reason in frame["reasons"])
    words = [f"{reason} ({n})" for reason, n in counts.most_common(_MOST_REASONS)]
    more = len(counts) - len(words)
    words += [f"{more} more in --json"] if more > 0 else []
    return f"not OK, and in how many frames: {'; '.join(words)}" if words else ""


def summary_text(summary: dict[str, Any]) -> str:
    """The summary for people."""
    lines = [_count_text(summary)]
    lines += [f"other bone, {name}: {_count_text(n)}" for name, n in summary["bodies"].items()]
    lines += [_measured_text(name, face) for name, face in summary.get("measured", {}).items()]
    processing_ms, tre = summary["latency_ms"], summary["tre_mm"]
    if summary["fps"] is not None and processing_ms["p50"] is not None:
        lines.append(
            f"{summary['fps']:.1f} frames/s, processing {processing_ms['p50']:.0f} ms (median), "
            f"{processing_ms['p95']:.0f} ms (95 %)"
        )
    if tre is not None:
        lines.append(
            f"TRE against the truth, while navigating: median {tre['median']:.2f} mm, "
            f"95 % {tre['p95']:.2f} mm, worst {tre['max']:.2f} mm"
        )
    return "\n".join(lines)
