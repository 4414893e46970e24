"""A row of the tables: what a method reached in a case, over all its tests."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from navapp.evaluation.campaign import Done
from navapp.evaluation.frame_figures import (
    FrameFigures,
    find_mean,
    find_percentile,
    find_rate_hz,
    pool_frames,
)
from navapp.evaluation.methods import OURS
from navapp.evaluation.paper.cases import Case, CaseTest
from navapp.evaluation.resampled_knees import find_mean_interval
from navapp.evaluation.scores import FrameScore, SequenceScore


@dataclass(frozen=True, slots=True, eq=False)
class Row:
    """The results of one method in one case, over all its tests."""

    case: Case
    method: str
    seeds: tuple[int, ...]
    figures: FrameFigures  # of all frames
    counted: FrameFigures  # `figures.select_counted(method)`
    # 95 % intervals of the means over `counted`, over tests.
    tre_ci95: tuple[float, float] | None
    overlay_ci95: tuple[float, float] | None
    # from the pass of its own, of one knee: time of each frame, and mean time of a registration;
    # none before it.
    times_ms: tuple[float, ...]
    registration_s: float | None

    @property
    def tre_mm(self) -> float | None:
        """Mean over the counted frames."""
        return self.counted.mean_mm

    @property
    def overlay_mm(self) -> float | None:
        """Mean over the counted frames."""
        return self.counted.mean_displacement_mm

    @property
    def fps(self) -> float | None:
        """One over the mean time of a frame."""
        return find_rate_hz(self.times_ms)

    def to_json(self) -> dict[str, Any]:
        """As in `evaluate.json`."""
        figures, counted = self.figures, self.counted
        return {
            "sample": self.case.sample,
            "stage": self.case.stage,
            "situation": self.case.situation,
            "method": self.method,
            "overlay_error_mm": self.overlay_mm,
            "outline_error_mm": counted.mean_outline_mm,
            "tre_mm": self.tre_mm,
            "tre_worst_mm": figures.ok.worst_mm,
            "tre_refused_mm": figures.refused.mean_mm,
            "ci95": {"tre_mm": self.tre_ci95, "overlay_error_mm": self.overlay_ci95},
            "ok_share": figures.ok_share,
            "refused": figures.n_frames - figures.n_ok,
            "wrong_and_ok": figures.n_wrong,
            "bound_coverage": figures.bound_coverage,
            "fps": self.fps,
            "latency_ms": {f"p{q}": find_percentile(self.times_ms, q) for q in (50, 95)},
            "registration_s": self.registration_s,
            "tests": len(self.seeds),
            "frames": figures.n_frames,
            "seeds": list(self.seeds),
        }


def find_ours(rows: Sequence[Row], stage: str, situation: str) -> list[Row]:
    """Those of our method in one stage and situation, of all samples."""
    return [row for row in rows if row.method == OURS and row.case.place == (stage, situation)]


def make_row(
    case: Case, method: str, done: Sequence[Done[CaseTest]], timed: Sequence[Done[CaseTest]]
) -> Row:
    """Pool the tests of a case.

    Args:
        case: of all of them.
        method: that is told of.
        done: its tests.
        timed: tests of the pass in which times were taken.
    """
    tests = [one.scores[method] for one in done]
    figures = pool_frames(test.frames for test in tests)
    in_time = [one.scores[method] for one in timed]
    return Row(
        case=case,
        method=method,
        seeds=tuple(one.test.seed for one in done),
        figures=figures,
        counted=figures.select_counted(method),
        tre_ci95=_resample(tests, method, lambda frame: frame.tre_mm),
        overlay_ci95=_resample(tests, method, lambda frame: frame.displacement_mm),
        times_ms=tuple(ms for test in in_time for ms in test.times_ms),
        registration_s=find_mean(test.registration_s for test in in_time),
    )


def _resample(
    tests: Sequence[SequenceScore], method: str, value_of: Callable[[FrameScore], float | None]
) -> tuple[float, float] | None:
    """95 % interval of the mean, by drawing tests anew (percentile bootstrap)."""
    sums, counts = list[float](), list[int]()
    for test in tests:
        counted = FrameFigures(test.frames).select_counted(method)
        values = [value_of(frame) for frame in counted.frames]
        known = [value for value in values if value is not None]
        sums.append(float(np.sum(known)))
        counts.append(len(known))
    return find_mean_interval(sums, counts)
