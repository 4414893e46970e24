"""What a method reached on a recording: a row of the tables, and its verdicts beside its errors."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from navapp.evaluation.frame_figures import FrameFigures, find_percentile, find_rate_hz
from navapp.evaluation.recording.study import Studied
from navapp.evaluation.recording.truth_files import DivotTruth
from navapp.evaluation.scores import FrameScore, SequenceScore
from navapp.tracking import Method
from navapp.values import Status


@dataclass(frozen=True, slots=True)
class VerdictCount:
    """Frames of one verdict whose truth is known."""

    n_near: int  # at most `WRONG_MM` off
    n_far: int
    n_without_pose: int


@dataclass(frozen=True, slots=True, eq=False)
class RecordingRow:
    """The results of one method on one recording."""

    name: str  # of the recording
    stage: str
    method: Method
    figures: FrameFigures  # of all frames after the one that is registered in
    known: FrameFigures  # of them, those with a known truth
    counted: FrameFigures  # `known.select_counted(method)`
    # The truth is touched points: these are no targets of the stage and carry errors of their own,
    # so that nothing is said of the bound.
    is_touched: bool
    registration_s: float | None
    times_ms: tuple[float, ...]  # of frames in which a bone was followed

    @property
    def verdicts(self) -> dict[str, VerdictCount]:
        """Of frames with a known truth, by the judge's word."""
        return {status.value: _count(self.known.frames, status) for status in Status}

    @property
    def n_wrong(self) -> int:
        """OK, more than `WRONG_MM` off and beyond their bound; of touched points: far off."""
        if self.is_touched:
            return sum(one.is_far for one in self.known.ok.frames)
        return self.known.n_wrong

    @property
    def coverage(self) -> float | None:
        """Of OK frames with an error, the share within their bound."""
        return None if self.is_touched else self.known.bound_coverage

    @property
    def fps(self) -> float | None:
        """One over the mean time of a frame."""
        return find_rate_hz(self.times_ms)

    def to_json(self) -> dict[str, Any]:
        """As in `evaluate.json`."""
        counted = self.counted
        return {
            "sample": self.name,
            "stage": self.stage,
            "situation": "recording",
            "method": self.method,
            "overlay_error_mm": counted.mean_displacement_mm,
            "outline_error_mm": counted.mean_outline_mm,
            "tre_mm": counted.mean_mm,
            "tre_percentiles_mm": {f"p{q}": counted.percentile_mm(q) for q in (50, 95, 100)},
            "tre_refused_mm": self.known.refused.mean_mm,
            # Frames of one recording are too much alike for an interval.
            "ci95": {},
            "ok_share": self.figures.ok_share,
            "refused": self.figures.n_frames - self.figures.n_ok,
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
            "latency_ms": {f"p{q}": find_percentile(self.times_ms, q) for q in (50, 95)},
            "registration_s": self.registration_s,
            "tests": 1,
            "frames": self.figures.n_frames,
            "frames_with_truth": self.known.n_frames,
            "seeds": [],
        }


def make_rows(studied: Studied) -> list[RecordingRow]:
    """One for each method."""
    return [_make_row(studied, method, scores) for method, scores in studied.scores.items()]


def _make_row(studied: Studied, method: Method, scores: SequenceScore) -> RecordingRow:
    known = FrameFigures(tuple(one for one in scores.frames if one.index in studied.known))
    return RecordingRow(
        name=studied.name,
        stage=studied.stage,
        method=method,
        figures=FrameFigures(scores.frames),
        known=known,
        counted=known.select_counted(method),
        is_touched=isinstance(studied.truth, DivotTruth),
        registration_s=scores.registration_s,
        times_ms=tuple(scores.times_ms),
    )


def _count(known: Sequence[FrameScore], status: Status) -> VerdictCount:
    some = [one for one in known if one.status == status.value]
    n_far, n_posed = sum(one.is_far for one in some), sum(one.tre_mm is not None for one in some)
    return VerdictCount(n_posed - n_far, n_far, len(some) - n_posed)
