"""A row of the ablation: what a variant reached in a stage and situation, over all samples."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from navapp.evaluation.ablation.settings import VARIANTS, WHOLE
from navapp.evaluation.campaign import Done
from navapp.evaluation.paper.cases import SITUATIONS, STAGE_NAMES, CaseTest
from navapp.evaluation.paper.rows import is_within_bound, is_wrong
from navapp.evaluation.scores import FrameScore

ALL = "all"
# A fit that begins elsewhere within its basin ends at the same pose to far less.
ALIKE_MM = 0.001


@dataclass(frozen=True, slots=True)
class VariantRow:
    """Of one variant; None where no frame has the figure."""

    stage: str  # or `ALL`
    situation: str  # or `ALL`
    variant: str
    n_tests: int
    n_frames: int
    n_ok: int
    # Mean errors over the stage's targets, mm: of OK frames, and of all that have a pose.
    tre_ok_mm: float | None
    tre_any_mm: float | None
    worst_ok_mm: float | None
    n_wrong: int  # OK, further off than 1 mm and than their bound
    coverage: float | None  # of OK frames, the share within their bound
    n_same: int  # verdict, errors and bound are those of the whole method to the last bit
    n_alike: int  # the status is, and the error within `ALIKE_MM`
    # processing time of a frame in which the bone was followed, from the pass of its own.
    median_ms: float | None
    mean_ms: float | None
    registration_s: float | None  # mean, from that pass

    @property
    def ok_share(self) -> float:
        """Of all counted frames."""
        return self.n_ok / max(self.n_frames, 1)

    def to_json(self) -> dict[str, Any]:
        """Named values."""
        return {**asdict(self), "ok_share": self.ok_share}


def make_variant_rows(
    done: Sequence[Done[CaseTest]], timed: Sequence[Done[CaseTest]]
) -> list[VariantRow]:
    """Of every stage and situation that has a test, and of all of them, every variant.

    Args:
        done: all tests.
        timed: tests of the pass in which times were taken.
    """
    rows = [_make_row(ALL, ALL, name, done, timed) for name in VARIANTS if done]
    for stage in STAGE_NAMES:
        for situation in SITUATIONS:
            some, some_timed = (_of(stage, situation, tests) for tests in (done, timed))
            if some:
                rows += [_make_row(stage, situation, name, some, some_timed) for name in VARIANTS]
    return rows


def _of(stage: str, situation: str, done: Sequence[Done[CaseTest]]) -> list[Done[CaseTest]]:
    return [
        one for one in done if (one.test.case.stage, one.test.case.situation) == (stage, situation)
    ]


def _make_row(
    stage: str,
    situation: str,
    variant: str,
    done: Sequence[Done[CaseTest]],
    timed: Sequence[Done[CaseTest]],
) -> VariantRow:
    frames = [frame for one in done for frame in one.followed[variant].frames]
    whole = [frame for one in done for frame in one.followed[WHOLE].frames]
    ok = [frame for frame in frames if frame.is_ok and frame.tre_mm is not None]
    ok_mm = [frame.tre_mm for frame in ok if frame.tre_mm is not None]
    any_mm = [frame.tre_mm for frame in frames if frame.tre_mm is not None]
    times_ms = [
        frame.total_ms
        for one in timed
        for frame in one.followed[variant].frames
        if not frame.is_search and (frame.tre_mm is not None or frame.reasons)
    ]
    registered = [one.followed[variant].registration_s for one in timed]
    seconds = [value for value in registered if value is not None]
    return VariantRow(
        stage=stage,
        situation=situation,
        variant=variant,
        n_tests=len(done),
        n_frames=len(frames),
        n_ok=len(ok),
        tre_ok_mm=_mean(ok_mm),
        tre_any_mm=_mean(any_mm),
        worst_ok_mm=max(ok_mm, default=None),
        n_wrong=sum(is_wrong(frame) for frame in ok),
        coverage=_mean([is_within_bound(frame) for frame in ok]),
        n_same=sum(_is_same(*both) for both in zip(frames, whole, strict=True)),
        n_alike=sum(_is_alike(*both) for both in zip(frames, whole, strict=True)),
        median_ms=float(np.median(times_ms)) if times_ms else None,
        mean_ms=_mean(times_ms),
        registration_s=_mean(seconds),
    )


def _is_same(one: FrameScore, other: FrameScore) -> bool:
    """Nothing that the frame tells differs, but for the time that it took."""

    def told(frame: FrameScore) -> tuple[object, ...]:
        return (
            frame.status, frame.reasons, frame.tre_mm, frame.displacement_mm, frame.outline_mm,
            frame.bound_mm,
        )  # fmt: skip

    return told(one) == told(other)


def _is_alike(one: FrameScore, other: FrameScore) -> bool:
    if one.tre_mm is None or other.tre_mm is None:
        return (one.status, one.tre_mm) == (other.status, other.tre_mm)
    return one.status == other.status and abs(one.tre_mm - other.tre_mm) <= ALIKE_MM


def _mean(values: Sequence[float]) -> float | None:
    return float(np.mean(values)) if values else None
