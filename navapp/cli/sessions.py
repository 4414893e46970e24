"""What `run` and `replay` share: priors, results, summaries."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from navapp.control.results import FrameResult
from navapp.errors import PriorError
from navapp.geometry.transform import RigidTransform
from navapp.values import Prior, Reason, Status

_POSE_KEY = "camera_from_model"


def read_prior(path: str | Path) -> Prior:
    """Read a prior file.

    Raises:
        PriorError: missing, no JSON, or values that are none.
    """
    path = Path(path)
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        poses = {
            key.removeprefix(_POSE_KEY).lstrip("_") or "femur": value
            for key, value in content.items()
            if key == _POSE_KEY or key.startswith(f"{_POSE_KEY}_")
        }
        cone = content.get("approach_cone") or {}
        axis = cone.get("axis")
        box = content.get("box")
        return Prior(
            {bone: RigidTransform("left", bone, value) for bone, value in poses.items()},
            None if axis is None else _unit(axis),
            float(cone.get("half_angle_deg", 180.0)),
            None if box is None else (int(box[0]), int(box[1]), int(box[2]), int(box[3])),
        )
    except OSError as error:
        raise PriorError(
            f"prior {path} cannot be read ({error.strerror})",
            subject=str(path),
            remedy="give the JSON file with the rough start pose",
        ) from error
    except (ValueError, TypeError, KeyError, IndexError, AttributeError) as error:
        raise PriorError(
            f"prior {path} is damaged ({error})",
            subject=str(path),
            remedy="it holds camera_from_model (4x4), approach_cone and box",
        ) from error


def prior_to_json(prior: Prior) -> dict[str, Any]:
    """The content of a prior file."""
    content: dict[str, Any] = {}
    for bone, pose in prior.left_from_bone.items():
        content[_POSE_KEY if bone == "femur" else f"{_POSE_KEY}_{bone}"] = pose.to_list()
    if prior.approach_axis is not None:
        content["approach_cone"] = {
            "axis": prior.approach_axis.tolist(),
            "half_angle_deg": prior.approach_half_angle_deg,
        }
    if prior.box is not None:
        content["box"] = list(prior.box)
    return content


def frame_to_json(result: FrameResult, tre_mm: float | None) -> dict[str, Any]:
    """One entry of `frames`."""
    tracked = result.tracked
    pose = None if tracked is None else tracked.left_from_bone
    estimate = None if tracked is None else tracked.estimate
    timings = result.timings
    return {
        "index": result.frame.index,
        "status": Status.LOST.value if tracked is None else tracked.verdict.status.value,
        "reasons": (
            [Reason.NOT_NAVIGATING.value]
            if tracked is None
            else [reason.value for reason in tracked.verdict.reasons]
        ),
        "state": result.state.value,
        "stage": result.stage.name,
        "bone": result.stage.bone,
        _POSE_KEY: None if pose is None else pose.to_list(),
        "covariance": None if estimate is None else estimate.covariance.tolist(),
        "predicted_tre_mm": None if tracked is None else tracked.verdict.predicted_tre_mm,
        "tre_mm": tre_mm,
        "bodies": {},
        "timing_ms": {
            "rectify": timings.rectify,
            "stereo": timings.stereo,
            "fill": timings.fill,
            "estimate": timings.estimate,
            "judge": timings.judge,
            "overlay": timings.overlay,
            "total": timings.total,
        },
    }


def summarise(frames: Sequence[dict[str, Any]], seconds: float) -> dict[str, Any]:
    """The `summary` object."""
    statuses = [frame["status"] for frame in frames]
    totals = [frame["timing_ms"]["total"] for frame in frames if frame["timing_ms"]["total"] > 0]
    # A wrong pose that was offered on purpose and refused is not a result of tracking.
    errors = [
        frame["tre_mm"]
        for frame in frames
        if frame["tre_mm"] is not None and frame["status"] == Status.OK.value
    ]
    return {
        "frames": len(frames),
        "ok": statuses.count("OK"),
        "degraded": statuses.count("DEGRADED"),
        "lost": statuses.count("LOST"),
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


def summary_text(summary: dict[str, Any]) -> str:
    """The summary for people."""
    lines = [
        f"{summary['frames']} frames: {summary['ok']} OK, {summary['degraded']} degraded, "
        f"{summary['lost']} lost"
    ]
    latency, tre = summary["latency_ms"], summary["tre_mm"]
    if summary["fps"] is not None and latency["p50"] is not None:
        lines.append(
            f"{summary['fps']:.1f} frames/s, line {latency['p50']:.0f} ms (median), "
            f"{latency['p95']:.0f} ms (95 %)"
        )
    if tre is not None:
        lines.append(
            f"simulated TRE of the OK frames: median {tre['median']:.2f} mm, "
            f"95 % {tre['p95']:.2f} mm, worst {tre['max']:.2f} mm"
        )
    return "\n".join(lines)


def _unit(axis: Sequence[float]) -> np.ndarray:
    values = np.asarray(axis, dtype=np.float64).reshape(3)
    length = float(np.linalg.norm(values))
    if not length > 0.0:
        raise ValueError("the cone's axis has no length")
    unit: np.ndarray = values / length
    return unit
