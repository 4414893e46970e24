"""A row of the ablation: what a variant reached in a stage and situation, over all samples."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from itertools import product
from operator import attrgetter
from typing import Any, Final, Literal

import numpy as np

from navapp.evaluation.ablation.settings import VARIANTS, WHOLE
from navapp.evaluation.campaign import Done
from navapp.evaluation.paper.cases import SITUATIONS, STAGE_NAMES, CaseTest, SituationName
from navapp.evaluation.paper.rows import is_within_bound, is_wrong
from navapp.evaluation.scores import FrameScore

ALL: Final = "all"
SituationOrAll = SituationName | Literal["all"]
# Fits that begin at different places and end at the same pose differ by far less.
ALIKE_MM = 0.001


@dataclass(frozen=True, slots=True)
class VariantRow:
    """Of one variant; None where no frame has the figure."""

    stage: str  # or `ALL`, then with the situation `ALL`
    situation: SituationOrAll
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
    # Frames compared with those of the whole method: verdict, errors and bound are the same to the
    # last bit; the status is the same, and the error differs by at most `ALIKE_MM`.
    n_same: int
    n_alike: int
    # From the timed pass: processing time of a frame in which the bone was followed, and mean time
    # of a registration.
    median_ms: float | None
    mean_ms: float | None
    registration_s: float | None

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
    """Of all tests together, then of every stage and situation that has one: every variant.

    Args:
        done: all tests.
        timed: tests of the pass in which times were taken.
    """
    rows = [_make_row(ALL, ALL, name, done, timed) for name in VARIANTS if done]
    for stage, situation in product(STAGE_NAMES, SITUATIONS):
        some, some_timed = (_select(tests, stage, situation) for tests in (done, timed))
        if some:
            rows += [_make_row(stage, situation, name, some, some_timed) for name in VARIANTS]
    return rows


def _select(done: Sequence[Done[CaseTest]], stage: str, situation: str) -> list[Done[CaseTest]]:
    return [
        one for one in done if (one.test.case.stage, one.test.case.situation) == (stage, situation)
    ]


def _make_row(
    stage: str,
    situation: SituationOrAll,
    variant: str,
    done: Sequence[Done[CaseTest]],
    timed: Sequence[Done[CaseTest]],
) -> VariantRow:
    frames = [frame for one in done for frame in one.followed[variant].frames]
    whole = [frame for one in done for frame in one.followed[WHOLE].frames]
    ok = [frame for frame in frames if frame.is_ok and frame.tre_mm is not None]
    times_ms = [ms for one in timed for ms in one.followed[variant].times_ms]
    return VariantRow(
        stage=stage,
        situation=situation,
        variant=variant,
        n_tests=len(done),
        n_frames=len(frames),
        n_ok=len(ok),
        tre_ok_mm=_mean([frame.tre_mm for frame in ok]),
        tre_any_mm=_mean([frame.tre_mm for frame in frames]),
        worst_ok_mm=max((frame.tre_mm or 0.0 for frame in ok), default=None),
        n_wrong=sum(is_wrong(frame) for frame in ok),
        coverage=_mean([is_within_bound(frame) for frame in ok]),
        n_same=sum(_is_same(*both) for both in zip(frames, whole, strict=True)),
        n_alike=sum(_is_alike(*both) for both in zip(frames, whole, strict=True)),
        median_ms=float(np.median(times_ms)) if times_ms else None,
        mean_ms=_mean(times_ms),
        registration_s=_mean([one.followed[variant].registration_s for one in timed]),
    )


def _is_same(one: FrameScore, other: FrameScore) -> bool:
    """Verdict, errors and bound are, to the last bit."""
    compared = attrgetter(
        "status", "reasons", "tre_mm", "displacement_mm", "outline_mm", "bound_mm"
    )
    return bool(compared(one) == compared(other))


def _is_alike(one: FrameScore, other: FrameScore) -> bool:
    """The status is the same, and the error nearly; without a pose in either as well."""
    if one.tre_mm is None or other.tre_mm is None:
        return (one.status, one.tre_mm) == (other.status, other.tre_mm)
    return one.status == other.status and abs(one.tre_mm - other.tre_mm) <= ALIKE_MM


def _mean(values: Sequence[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return float(np.mean(known)) if known else None
