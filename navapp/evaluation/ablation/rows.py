"""A row of the ablation: what a variant reached in a stage and situation, over all samples."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from operator import attrgetter
from typing import Any, Final, Literal

from navapp.evaluation.campaign import Done
from navapp.evaluation.frame_figures import FrameFigures, find_mean, find_percentile, pool_frames
from navapp.evaluation.methods import OURS, VARIANTS
from navapp.evaluation.paper.cases import SITUATIONS, STAGE_NAMES, CaseTest, SituationName
from navapp.evaluation.scores import FrameScore

ALL: Final = "all"
SituationOrAll = SituationName | Literal["all"]
# Fits that begin at different places and end at the same pose differ by far less.
ALIKE_MM = 0.001


@dataclass(frozen=True, slots=True, eq=False)
class VariantRow:
    """The results of one variant in one stage and situation, or in all."""

    stage: str  # or `ALL`, then with the situation `ALL`
    situation: SituationOrAll
    variant: str
    n_tests: int
    figures: FrameFigures
    # Frames compared with those of the whole method: verdict, errors and bound are the same to the
    # last bit; the status is the same, and the error differs by at most `ALIKE_MM`.
    n_same: int
    n_alike: int
    # From the timed pass: processing time of a frame in which the bone was followed, and mean time
    # of a registration.
    median_ms: float | None
    mean_ms: float | None
    registration_s: float | None

    def to_json(self) -> dict[str, Any]:
        """Named values."""
        figures = self.figures
        return {
            "stage": self.stage,
            "situation": self.situation,
            "variant": self.variant,
            "n_tests": self.n_tests,
            "n_frames": figures.n_frames,
            "n_ok": figures.n_ok,
            "ok_share": figures.ok_share,
            "tre_ok_mm": figures.ok.mean_mm,
            "tre_any_mm": figures.mean_mm,
            "worst_ok_mm": figures.ok.worst_mm,
            "n_wrong": figures.n_wrong,
            "coverage": figures.bound_coverage,
            "n_same": self.n_same,
            "n_alike": self.n_alike,
            "median_ms": self.median_ms,
            "mean_ms": self.mean_ms,
            "registration_s": self.registration_s,
        }


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
        some, some_timed = (
            [one for one in tests if one.test.case.place == (stage, situation)]
            for tests in (done, timed)
        )
        if some:
            rows += [_make_row(stage, situation, name, some, some_timed) for name in VARIANTS]
    return rows


def _make_row(
    stage: str,
    situation: SituationOrAll,
    variant: str,
    done: Sequence[Done[CaseTest]],
    timed: Sequence[Done[CaseTest]],
) -> VariantRow:
    figures, whole = (
        pool_frames(one.scores[name].frames for one in done) for name in (variant, OURS)
    )
    pairs = list(zip(figures.frames, whole.frames, strict=True))
    times_ms = [ms for one in timed for ms in one.scores[variant].times_ms]
    return VariantRow(
        stage=stage,
        situation=situation,
        variant=variant,
        n_tests=len(done),
        figures=figures,
        n_same=sum(_is_same(*both) for both in pairs),
        n_alike=sum(_is_alike(*both) for both in pairs),
        median_ms=find_percentile(times_ms, 50.0),
        mean_ms=find_mean(times_ms),
        registration_s=find_mean(one.scores[variant].registration_s for one in timed),
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
