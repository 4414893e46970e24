"""A row of the stress matrix: what was reached at a level, and where along an axis OK ends."""

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from navapp.evaluation.campaign import Done
from navapp.evaluation.frame_figures import FrameFigures, pool_frames
from navapp.evaluation.methods import OURS
from navapp.evaluation.scores import WRONG_MM, FrameScore
from navapp.evaluation.stress.axes import Axis
from navapp.evaluation.stress.matrix import StressTest

# OK is kept while so many frames are, and has ended when fewer than so many are.
KEPT_SHARE, ENDED_SHARE = 0.9, 0.5


@dataclass(frozen=True, slots=True, eq=False)
class LevelRow:
    """The results at one level of an axis, over all its knees."""

    level: float
    n_knees: int
    figures: FrameFigures  # of frames that show what the level says
    # of all frames that were followed, with those in which a leg that is moved to and fro turns
    every: FrameFigures
    reason: str  # the one that is told most often of frames that are not OK; empty: none
    reason_share: float  # of those frames
    is_hidden: bool  # pictures cannot show this level

    @property
    def ok_share(self) -> float:
        """Share of OK frames, of those that count."""
        return self.figures.ok_share

    @property
    def tre_mm(self) -> float | None:
        """Median of OK frames that count."""
        return self.figures.ok.percentile_mm(50.0)

    @property
    def worst_mm(self) -> float | None:
        """Largest error of all OK frames."""
        return self.every.ok.worst_mm

    @property
    def tre_any_mm(self) -> float | None:
        """Median of all frames that count and have a pose, whatever the judge says."""
        return self.figures.percentile_mm(50.0)

    def to_json(self) -> dict[str, Any]:
        """Named values."""
        return {
            "level": self.level,
            "n_knees": self.n_knees,
            "n_frames": self.figures.n_frames,
            "n_ok": self.figures.n_ok,
            "ok_share": self.ok_share,
            "tre_mm": self.tre_mm,
            "worst_mm": self.worst_mm,
            "tre_any_mm": self.tre_any_mm,
            "n_frames_all": self.every.n_frames,
            "n_ok_all": self.every.n_ok,
            "n_wrong": self.every.n_wrong,
            "coverage": self.figures.bound_coverage,
            "reason": self.reason,
            "reason_share": self.reason_share,
            "is_hidden": self.is_hidden,
        }


@dataclass(frozen=True, slots=True)
class AxisRows:
    """All levels of an axis that were run, rising."""

    axis: Axis
    rows: tuple[LevelRow, ...]

    @property
    def n_wrong(self) -> int:
        """OK and wrong, where pictures can show it."""
        return sum(row.every.n_wrong for row in self.rows if not row.is_hidden)

    @property
    def n_wrong_hidden(self) -> int:
        """OK and wrong at levels that pictures cannot show."""
        return sum(row.every.n_wrong for row in self.rows if row.is_hidden)

    def sides(self) -> Iterator[list[LevelRow]]:
        """The usual level and those beyond it, outwards: below it, then above."""
        usual = self.axis.usual
        for side in (
            [row for row in reversed(self.rows) if row.level <= usual],
            [row for row in self.rows if row.level >= usual],
        ):
            if any(row.level != usual for row in side):
                yield side

    def find_kept(self) -> list[float | None]:
        """On each side the last level up to which nine tenths of the frames are OK."""
        return [_last_before(side, lambda row: row.ok_share < KEPT_SHARE) for side in self.sides()]

    def find_ends(self) -> list[float | None]:
        """On each side the first level at which fewer than half are; None: at none."""
        return [_first(side, lambda row: row.ok_share < ENDED_SHARE) for side in self.sides()]

    def find_passed(self) -> list[float | None]:
        """On each side where the error of any pose passes 1 mm, between levels in proportion."""
        return [_find_crossing(side, WRONG_MM) for side in self.sides()]

    def to_json(self) -> dict[str, Any]:
        """Named values."""
        axis = self.axis
        return {
            "axis": axis.name,
            "title": axis.title,
            "unit": axis.unit,
            "usual": axis.usual,
            "is_cause": axis.is_cause,
            "found_by": axis.found_by,
            "ok_kept_up_to": self.find_kept(),
            "ok_ends_at": self.find_ends(),
            "one_mm_passed_at": self.find_passed(),
            "wrong_and_ok": self.n_wrong,
            "wrong_and_ok_hidden": self.n_wrong_hidden,
            "levels": [row.to_json() for row in self.rows],
        }


def make_axis_rows(axis: Axis, done: Sequence[Done[StressTest]]) -> AxisRows:
    """Pool the knees of each level of an axis."""
    of_axis = [one for one in done if one.test.axis_name == axis.name]
    levels = [(level, [one for one in of_axis if one.test.level == level]) for level in axis.levels]
    return AxisRows(axis, tuple(_make_row(axis, level, some) for level, some in levels if some))


def list_counted(done: Done[StressTest]) -> list[FrameScore]:
    """Frames of a test that show what its level says."""
    return [frame for frame in done.scores[OURS].frames if done.test.counts(frame.index)]


def _make_row(axis: Axis, level: float, done: Sequence[Done[StressTest]]) -> LevelRow:
    figures = pool_frames(list_counted(one) for one in done)
    refused = figures.refused.frames
    told = Counter(reason for frame in refused for reason in frame.reasons or ("no pose",))
    reason, n_told = told.most_common(1)[0] if told else ("", 0)
    return LevelRow(
        level=level,
        n_knees=len(done),
        figures=figures,
        every=pool_frames(one.scores[OURS].frames for one in done),
        reason=reason,
        reason_share=n_told / max(len(refused), 1),
        is_hidden=axis.is_hidden(level),
    )


def _first(side: Sequence[LevelRow], holds: Callable[[LevelRow], bool]) -> float | None:
    return next((row.level for row in side if holds(row)), None)


def _last_before(side: Sequence[LevelRow], holds: Callable[[LevelRow], bool]) -> float | None:
    kept = None
    for row in side:
        if holds(row):
            break
        kept = row.level
    return kept


def _find_crossing(side: Sequence[LevelRow], limit_mm: float) -> float | None:
    known = [(row.level, row.tre_any_mm) for row in side if row.tre_any_mm is not None]
    for place, (level, error_mm) in enumerate(known):
        if error_mm > limit_mm:
            if place == 0:
                return level
            before, before_mm = known[place - 1]
            share = (limit_mm - before_mm) / (error_mm - before_mm)
            return before + share * (level - before)
    return None
