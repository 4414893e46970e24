"""Figures of an accuracy test, in the manner of ASTM F2554: points, rotations, distances.

The manner alone is taken from the standard; nothing here claims to conform to it.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from navapp.control.accuracy_test.states import TakenTip
from navapp.geometry.transform import FloatArray
from navapp.tools.accuracy_tasks import AXES, ORIENTATIONS, TaskKind


@dataclass(frozen=True, slots=True)
class Scatter:
    """Places that should be one, or lengths that should have no error."""

    n: int
    mean_mm: float  # of the distances from the mean place; of the errors of lengths
    span_mm: float  # between the two that are furthest apart; from the least error to the largest
    rms_mm: float
    max_mm: float  # the largest distance, or the largest error without its sign


@dataclass(frozen=True, slots=True)
class PlaceFigures:
    """What a place of the working volume gave; None where nothing was taken."""

    point: Scatter | None  # the middle divot in all orientations
    rotations: dict[str, Scatter | None]  # the middle divot while leaned, by axis
    distances: Scatter | None  # between all divots


def measure_scatter(tips_mm: FloatArray) -> Scatter | None:
    """Of tips (N, 3) that stood in one divot; None with fewer than two."""
    if len(tips_mm) < 2:
        return None
    away = np.linalg.norm(tips_mm - tips_mm.mean(axis=0), axis=1)
    apart = np.linalg.norm(tips_mm[:, None] - tips_mm, axis=2)
    return Scatter(
        len(tips_mm), float(away.mean()), float(apart.max()),
        float(np.sqrt(np.mean(away**2))), float(away.max()),
    )  # fmt: skip


def measure_lengths(errors_mm: FloatArray) -> Scatter | None:
    """Of errors of lengths (N,), measured less true."""
    if len(errors_mm) == 0:
        return None
    return Scatter(
        len(errors_mm), float(errors_mm.mean()), float(np.ptp(errors_mm)),
        float(np.sqrt(np.mean(errors_mm**2))), float(np.abs(errors_mm).max()),
    )  # fmt: skip


def find_length_errors(taken: Sequence[TakenTip], divots_mm: FloatArray) -> FloatArray:
    """(M,) errors of the distances between the divots of one place, each a mean over its tips."""
    numbers = sorted({one.task.divot for one in taken if one.task.kind == "distance"})
    if len(numbers) < 2:
        return np.empty(0)
    means = np.array([_tips(taken, "distance", number).mean(axis=0) for number in numbers])
    first, second = np.triu_indices(len(numbers), 1)
    seen = np.linalg.norm(means[first] - means[second], axis=1)
    true = divots_mm[numbers]
    return np.asarray(seen - np.linalg.norm(true[first] - true[second], axis=1))


def measure_place(taken: Sequence[TakenTip], divots_mm: FloatArray) -> PlaceFigures:
    """The figures of what was taken at one place."""
    points = [_tips(taken, "point", number) for number in range(len(ORIENTATIONS))]
    means = np.array([one.mean(axis=0) for one in points if len(one)])
    return PlaceFigures(
        measure_scatter(means.reshape(-1, 3)),
        {
            axis: measure_scatter(_tips(taken, "rotation", number))
            for number, axis in enumerate(AXES)
        },
        measure_lengths(find_length_errors(taken, divots_mm)),
    )


def measure_all(
    taken: Sequence[TakenTip], divots_mm: FloatArray
) -> tuple[dict[str, PlaceFigures], Scatter | None]:
    """Figures by place, and those of the distances of all places together."""
    places = list(dict.fromkeys(one.task.place for one in taken))
    of_place = {place: [one for one in taken if one.task.place == place] for place in places}
    errors = [find_length_errors(tips, divots_mm) for tips in of_place.values()]
    joined = measure_lengths(np.concatenate([np.empty(0), *errors]))
    return {place: measure_place(tips, divots_mm) for place, tips in of_place.items()}, joined


def _tips(taken: Sequence[TakenTip], kind: TaskKind, number: int) -> FloatArray:
    """(N, 3) of one task."""
    tips = [one.tip_mm for one in taken if one.task.kind == kind and one.task.number == number]
    return np.array(tips).reshape(-1, 3)
