"""What a method reached on a recording: a row of the tables, and its verdicts beside its errors."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from navapp.evaluation.paper.rows import WRONG_MM, is_within_bound, is_wrong
from navapp.evaluation.recording.study import Studied
from navapp.evaluation.recording.truth_files import DivotTruth
from navapp.evaluation.scores import Followed, FrameScore
from navapp.tracking import Method
from navapp.values import Status


@dataclass(frozen=True, slots=True)
class VerdictCount:
    """Frames of one verdict whose truth is known."""

    n_near: int  # at most `WRONG_MM` off
    n_far: int
    n_without_pose: int


@dataclass(frozen=True, slots=True)
class RecordingRow:
    """Of one recording and one method."""

    name: str  # of the recording
    stage: str
    method: Method
    n_frames: int  # after the one that is registered in
    n_known: int  # of them, with a known truth
    n_ok: int  # of all frames
    n_wrong: int  # OK, more than `WRONG_MM` off and beyond their bound
    # of OK frames with an error, the share within their bound; None for touched points, which are
    # no targets of the stage and carry errors of their own.
    coverage: float | None
    # Of OK frames for ours, of all with a pose for the paper's two methods, as in `rows.Row`; mm.
    errors_mm: tuple[float, ...]
    overlay_mm: float | None  # means
    outline_mm: float | None
    tre_refused_mm: float | None  # mean of poses that the judge refuses
    verdicts: dict[str, VerdictCount]
    times_ms: tuple[float, ...]  # of frames without a search
    registration_s: float | None

    @property
    def tre_mm(self) -> float | None:
        """Mean error."""
        return _mean(self.errors_mm)

    def percentile_mm(self, share: float) -> float | None:
        """Of the errors."""
        return float(np.percentile(self.errors_mm, share)) if self.errors_mm else None

    @property
    def fps(self) -> float | None:
        """One over the mean time of a frame."""
        return 1e3 / float(np.mean(self.times_ms)) if self.times_ms else None

    def to_json(self) -> dict[str, Any]:
        """As in `evaluate.json`."""
        times = {f"p{q}": float(np.percentile(self.times_ms, q)) for q in (50, 95) if self.times_ms}
        return {
            "sample": self.name,
            "stage": self.stage,
            "situation": "recording",
            "method": self.method,
            "overlay_error_mm": self.overlay_mm,
            "outline_error_mm": self.outline_mm,
            "tre_mm": self.tre_mm,
            "tre_percentiles_mm": {f"p{q}": self.percentile_mm(q) for q in (50, 95, 100)},
            "tre_refused_mm": self.tre_refused_mm,
            # Frames of one recording are too much alike for an interval.
            "ci95": {},
            "ok_share": self.n_ok / max(self.n_frames, 1),
            "refused": self.n_frames - self.n_ok,
            "wrong_and_ok": self.n_wrong,
            "bound_coverage": self.coverage,
            "verdicts": {
                status: {
                    "within_1_mm": one.n_near,
                    "beyond_1_mm": one.n_far,
                    "no_pose": one.n_without_pose,
                }
                for status, one in self.verdicts.items()
            },
            "fps": self.fps,
            "latency_ms": times or {"p50": None, "p95": None},
            "registration_s": self.registration_s,
            "tests": 1,
            "frames": self.n_frames,
            "frames_with_truth": self.n_known,
            "seeds": [],
        }


def make_rows(studied: Studied) -> list[RecordingRow]:
    """One for each method."""
    return [
        _make_row(studied, method, answers.followed) for method, answers in studied.answers.items()
    ]


def _make_row(studied: Studied, method: Method, followed: Followed) -> RecordingRow:
    frames = followed.frames
    known = [one for one in frames if one.index in studied.known]
    measured = [one for one in known if one.tre_mm is not None]
    ok = [one for one in measured if one.is_ok]
    is_touched = isinstance(studied.truth, DivotTruth)
    counted = ok if method == "bimcc" else measured
    return RecordingRow(
        name=studied.name,
        stage=studied.stage,
        method=method,
        n_frames=len(frames),
        n_known=len(known),
        n_ok=sum(one.is_ok for one in frames),
        n_wrong=sum(is_wrong(one) for one in ok),
        coverage=None if is_touched else _mean([float(is_within_bound(one)) for one in ok]),
        errors_mm=tuple(one.tre_mm for one in counted if one.tre_mm is not None),
        overlay_mm=_mean([one.displacement_mm for one in counted]),
        outline_mm=_mean([one.outline_mm for one in counted]),
        tre_refused_mm=_mean([one.tre_mm for one in measured if not one.is_ok]),
        verdicts={status.value: _count(known, status) for status in Status},
        times_ms=tuple(one.total_ms for one in frames if not one.is_search and one.total_ms > 0),
        registration_s=followed.registration_s,
    )


def _count(known: Sequence[FrameScore], status: Status) -> VerdictCount:
    errors_mm = [one.tre_mm for one in known if one.status == status.value]
    n_near = sum(error is not None and error <= WRONG_MM for error in errors_mm)
    n_far = sum(error is not None and error > WRONG_MM for error in errors_mm)
    return VerdictCount(n_near, n_far, len(errors_mm) - n_near - n_far)


def _mean(values: Sequence[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return float(np.mean(known)) if known else None
