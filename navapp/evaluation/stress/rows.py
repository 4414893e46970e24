"""A row of the stress matrix: what was reached at a level, and where along an axis OK ends."""

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from navapp.evaluation.campaign import Done
from navapp.evaluation.paper.rows import WRONG_MM, is_within_bound, is_wrong
from navapp.evaluation.scores import FrameScore
from navapp.evaluation.stress.axes import Axis
from navapp.evaluation.stress.matrix import StressTest

# OK is kept while so many frames are, and has ended when fewer than so many are.
KEPT_SHARE, ENDED_SHARE = 0.9, 0.5


@dataclass(frozen=True, slots=True)
class LevelRow:
    """Of one level, over its knees; None where no frame has the figure."""

    level: float
    n_knees: int
    n_frames: int  # that count
    n_ok: int
    # Over OK frames, mm: middle and worst.
    tre_mm: float | None
    worst_mm: float | None
    tre_any_mm: float | None  # median over all frames with a pose, whatever the judge says
    n_wrong: int  # OK, further off than 1 mm and than their bound
    coverage: float | None  # of OK frames, the share within their bound
    reason: str  # the one that is told most often of frames that are not OK; empty: none
    reason_share: float  # of those frames
    is_hidden: bool  # pictures cannot show this level

    @property
    def ok_share(self) -> float:
        """Of all frames that count."""
        return self.n_ok / max(self.n_frames, 1)

    def to_json(self) -> dict[str, Any]:
        """Named values."""
        return {**asdict(self), "ok_share": self.ok_share}


@dataclass(frozen=True, slots=True)
class AxisRows:
    """All levels of an axis that were run, rising."""

    axis: Axis
    rows: tuple[LevelRow, ...]

    @property
    def n_wrong(self) -> int:
        """OK and wrong, where pictures can show it."""
        return sum(row.n_wrong for row in self.rows if not row.is_hidden)

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
            "levels": [row.to_json() for row in self.rows],
        }


def make_axis_rows(axis: Axis, done: Sequence[Done[StressTest]]) -> AxisRows:
    """Pool the knees of each level of an axis."""
    of_axis = [one for one in done if one.test.axis_name == axis.name]
    levels = [(level, [one for one in of_axis if one.test.level == level]) for level in axis.levels]
    return AxisRows(axis, tuple(_make_row(axis, level, some) for level, some in levels if some))


def list_counted(done: Done[StressTest]) -> list[FrameScore]:
    """Frames of a test that show what its level says."""
    return [frame for frame in done.followed["bimcc"].frames if done.test.counts(frame.index)]


def _make_row(axis: Axis, level: float, done: Sequence[Done[StressTest]]) -> LevelRow:
    frames = [frame for one in done for frame in list_counted(one)]
    ok = [frame for frame in frames if frame.is_ok and frame.tre_mm is not None]
    errors_mm = [frame.tre_mm for frame in ok if frame.tre_mm is not None]
    any_mm = [frame.tre_mm for frame in frames if frame.tre_mm is not None]
    refused = [frame for frame in frames if not frame.is_ok]
    told = Counter(reason for frame in refused for reason in frame.reasons or ("no pose",))
    reason, n_told = told.most_common(1)[0] if told else ("", 0)
    return LevelRow(
        level=level,
        n_knees=len(done),
        n_frames=len(frames),
        n_ok=len(ok),
        tre_mm=float(np.median(errors_mm)) if errors_mm else None,
        worst_mm=max(errors_mm, default=None),
        tre_any_mm=float(np.median(any_mm)) if any_mm else None,
        n_wrong=sum(is_wrong(frame) for frame in ok),
        coverage=float(np.mean([is_within_bound(frame) for frame in ok])) if ok else None,
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
