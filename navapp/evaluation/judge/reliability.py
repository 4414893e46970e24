"""Whether predicted bounds hold as often as they say, and by how much they exceed the errors."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from navapp.evaluation.resampled_knees import find_mean_interval
from navapp.evaluation.scores import LEVELS, FrameScore

Knees = Sequence[Sequence[FrameScore]]  # frames of each

_JUDGED = LEVELS.index(0.95)


@dataclass(frozen=True, slots=True)
class Reliability:
    """Of one nominal level, over OK frames."""

    nominal: float
    observed: float  # share of errors within the judge's bound at this level
    ci95: tuple[float, float] | None  # over knees
    claimed: float  # the same of what the pose's covariance alone says
    claimed_ci95: tuple[float, float] | None
    n_frames: int
    n_knees: int


@dataclass(frozen=True, slots=True)
class Sharpness:
    """Bound over error, of OK frames."""

    median: float
    n_frames: int


@dataclass(frozen=True, slots=True)
class BoundQuality:
    """What is to be known of the bounds."""

    levels: tuple[Reliability, ...]
    sharpness: dict[str, Sharpness]  # by situation, and of "all"

    def to_json(self) -> dict[str, Any]:
        """Named values."""
        return {
            "reliability": [asdict(one) for one in self.levels],
            "sharpness": {name: asdict(one) for name, one in self.sharpness.items()},
        }


def judge_bounds(knees: Mapping[str, Knees]) -> BoundQuality | None:
    """Pool the OK frames of all knees, by situation; None without any that has a bound."""
    every = [_known(frames) for of_situation in knees.values() for frames in of_situation]
    if not any(every):
        return None
    sharpness = {"all": _measure_sharpness(every)}
    for name, of_situation in knees.items():
        known = [_known(frames) for frames in of_situation]
        if any(known):
            sharpness[name] = _measure_sharpness(known)
    return BoundQuality(
        tuple(_measure_level(every, number) for number in range(len(LEVELS))), sharpness
    )


def _known(frames: Sequence[FrameScore]) -> list[FrameScore]:
    """OK frames with an error and bounds."""
    return [
        one
        for one in frames
        if one.is_ok
        and one.tre_mm is not None
        and one.bound_mm is not None
        and one.claimed_mm is not None
    ]


def find_bound_mm(frame: FrameScore, number: int) -> float:
    """The judge's bound at a level, for a frame that has one.

    What it adds for plan and rig at 95 % are two standard deviations of normal errors, and are
    taken as such at the other levels.
    """
    from scipy.special import ndtri

    claimed, bound_mm = frame.claimed_mm or (), frame.bound_mm or 0.0
    added_mm2 = max(bound_mm**2 - claimed[_JUDGED] ** 2, 0.0)
    factor = float(ndtri(0.5 + 0.5 * LEVELS[number]) / ndtri(0.5 + 0.5 * LEVELS[_JUDGED]))
    return math.hypot(claimed[number], factor * math.sqrt(added_mm2))


def _measure_level(knees: Knees, number: int) -> Reliability:
    counts = [len(frames) for frames in knees]
    within = [sum(_error(one) <= find_bound_mm(one, number) for one in frames) for frames in knees]
    alone = [
        sum(_error(one) <= (one.claimed_mm or ())[number] for one in frames) for frames in knees
    ]
    n_frames = sum(counts)
    return Reliability(
        LEVELS[number],
        sum(within) / n_frames,
        find_mean_interval(within, counts),
        sum(alone) / n_frames,
        find_mean_interval(alone, counts),
        n_frames,
        sum(count > 0 for count in counts),
    )


def _measure_sharpness(knees: Knees) -> Sharpness:
    ratios = [(one.bound_mm or 0.0) / max(_error(one), 1e-9) for frames in knees for one in frames]
    return Sharpness(float(np.median(ratios)), len(ratios))


def _error(frame: FrameScore) -> float:
    return math.inf if frame.tre_mm is None else frame.tre_mm
