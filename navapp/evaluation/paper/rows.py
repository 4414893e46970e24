"""A row of the tables: what a method reached in a case, over all its tests."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from navapp.evaluation.campaign import Done
from navapp.evaluation.paper.cases import Case, CaseTest
from navapp.evaluation.resampled_knees import find_mean_interval
from navapp.evaluation.scores import Followed, FrameScore
from navapp.tracking import Method

# A pose that is called OK and further off than this, and than its bound, is wrong.
WRONG_MM = 1.0


@dataclass(frozen=True, slots=True)
class Row:
    """Of one case and one method."""

    case: Case
    method: Method
    # Means over frames, mm: of ours over those that the judge calls OK; of the paper's two methods
    # over all that have a pose, because our judge is not theirs. None without any.
    overlay_mm: float | None
    outline_mm: float | None
    tre_mm: float | None
    tre_ci95: tuple[float, float] | None  # over tests
    overlay_ci95: tuple[float, float] | None
    tre_worst_mm: float | None  # of frames that the judge calls OK
    tre_refused_mm: float | None  # of poses that the judge refuses
    ok_share: float
    n_refused: int  # frames that are not OK
    n_wrong: int  # frames that are OK, wrong and beyond their bound
    coverage: float | None  # of OK frames, the share within their bound
    n_ok: int
    n_frames: int
    seeds: tuple[int, ...]
    # from the pass of its own; None before it: processing time of a frame, and of a registration.
    p50_ms: float | None
    p95_ms: float | None
    fps: float | None
    registration_s: float | None

    def to_json(self) -> dict[str, Any]:
        """As in `evaluate.json`."""
        return {
            "sample": self.case.sample,
            "stage": self.case.stage,
            "situation": self.case.situation,
            "method": self.method,
            "overlay_error_mm": self.overlay_mm,
            "outline_error_mm": self.outline_mm,
            "tre_mm": self.tre_mm,
            "tre_worst_mm": self.tre_worst_mm,
            "tre_refused_mm": self.tre_refused_mm,
            "ci95": {"tre_mm": self.tre_ci95, "overlay_error_mm": self.overlay_ci95},
            "ok_share": self.ok_share,
            "refused": self.n_refused,
            "wrong_and_ok": self.n_wrong,
            "bound_coverage": self.coverage,
            "fps": self.fps,
            "latency_ms": {"p50": self.p50_ms, "p95": self.p95_ms},
            "registration_s": self.registration_s,
            "tests": len(self.seeds),
            "frames": self.n_frames,
            "seeds": list(self.seeds),
        }


def find_ours(rows: Sequence[Row], stage: str, situation: str) -> list[Row]:
    """Those of our method in one stage and situation, of all samples."""
    wanted = ("bimcc", stage, situation)
    return [row for row in rows if (row.method, row.case.stage, row.case.situation) == wanted]


def make_row(
    case: Case, method: Method, done: Sequence[Done[CaseTest]], timed: Sequence[Done[CaseTest]]
) -> Row:
    """Pool the tests of a case.

    Args:
        case: of all of them.
        method: that is told of.
        done: its tests.
        timed: tests of the pass in which times were taken.
    """
    tests = [one.followed[method] for one in done]
    frames = [frame for test in tests for frame in test.frames]
    ok = [frame for frame in frames if frame.is_ok and frame.tre_mm is not None]
    times_ms, fps, registration_s = _time([one.followed[method] for one in timed])
    within = [is_within_bound(frame) for frame in ok]
    return Row(
        case=case,
        method=method,
        overlay_mm=_mean([one.displacement_mm for one in _counted(frames, method)]),
        outline_mm=_mean([one.outline_mm for one in _counted(frames, method)]),
        tre_mm=_mean([one.tre_mm for one in _counted(frames, method)]),
        tre_ci95=_resample(tests, method, lambda frame: frame.tre_mm),
        overlay_ci95=_resample(tests, method, lambda frame: frame.displacement_mm),
        tre_worst_mm=max((frame.tre_mm for frame in ok if frame.tre_mm is not None), default=None),
        tre_refused_mm=_mean([frame.tre_mm for frame in frames if not frame.is_ok]),
        ok_share=len(ok) / max(len(frames), 1),
        n_refused=len(frames) - len(ok),
        n_wrong=sum(is_wrong(frame) for frame in ok),
        coverage=float(np.mean(within)) if within else None,
        n_ok=len(ok),
        n_frames=len(frames),
        seeds=tuple(one.test.seed for one in done),
        p50_ms=None if times_ms is None else float(np.percentile(times_ms, 50)),
        p95_ms=None if times_ms is None else float(np.percentile(times_ms, 95)),
        fps=fps,
        registration_s=registration_s,
    )


def is_within_bound(frame: FrameScore) -> bool:
    """The error of an OK frame is below what its judge predicts for 95 of 100."""
    known = frame.tre_mm is not None and frame.bound_mm is not None
    return known and (frame.tre_mm or 0.0) <= (frame.bound_mm or 0.0)


def is_wrong(frame: FrameScore) -> bool:
    """It is called OK, and is further off than `WRONG_MM` and than its bound."""
    is_far = frame.tre_mm is not None and frame.tre_mm > WRONG_MM
    return frame.is_ok and is_far and not is_within_bound(frame)


def _counted(frames: Sequence[FrameScore], method: Method) -> list[FrameScore]:
    """Frames whose errors count for a method, as `Row` says."""
    return [frame for frame in frames if frame.is_ok or method != "bimcc"]


def _mean(values: Sequence[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return float(np.mean(known)) if known else None


def _resample(
    tests: Sequence[Followed], method: Method, value_of: Callable[[FrameScore], float | None]
) -> tuple[float, float] | None:
    """95 % interval of the mean, by drawing tests anew (percentile bootstrap)."""
    sums, counts = list[float](), list[int]()
    for test in tests:
        values = [value_of(frame) for frame in _counted(test.frames, method)]
        known = [value for value in values if value is not None]
        sums.append(float(np.sum(known)))
        counts.append(len(known))
    return find_mean_interval(sums, counts)


def _time(
    tests: Sequence[Followed],
) -> tuple[list[float] | None, float | None, float | None]:
    """Times of frames in which a bone was followed, frames a second, seconds of a registration."""
    times_ms = [ms for test in tests for ms in test.times_ms]
    registrations = [test.registration_s for test in tests if test.registration_s is not None]
    mean_s = float(np.mean(registrations)) if registrations else None
    if not times_ms:
        return None, None, mean_s
    return times_ms, 1e3 / float(np.mean(times_ms)), mean_s
