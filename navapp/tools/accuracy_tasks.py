"""What an accuracy test asks for, place by place."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from navapp.errors import InputError
from navapp.geometry.transform import FloatArray

TaskKind = Literal["point", "rotation", "distance"]
PLACES = ("centre", "bottom", "top", "left", "right")
ORIENTATIONS = ("upright", "leaned to the left", "leaned to the right")
AXES = ("towards and away from the cameras", "to the left and right", "about the shaft")
N_DIVOTS, _LEAST_APART_MM = 20, 4.0


@dataclass(frozen=True, slots=True)
class Task:
    """One thing to do with the tip in a divot."""

    place: str  # of the divot plate in the working volume
    kind: TaskKind
    number: int  # orientation, axis, or divot, from 0
    divot: int  # that the tip stands in

    @property
    def instruction(self) -> str:
        """For people."""
        where = f"divot plate at the {self.place}: tip in divot {self.divot + 1}"
        match self.kind:
            case "point":
                return f"{where}, {ORIENTATIONS[self.number]}; hold still"
            case "rotation":
                return f"{where}; lean it slowly {AXES[self.number]}"
        return f"{where}; hold still"


def find_middle_divot(divots_mm: FloatArray) -> int:
    """The divot nearest to the middle of all."""
    away_mm = np.linalg.norm(divots_mm - divots_mm.mean(axis=0), axis=1)
    return int(away_mm.argmin())


def make_tasks(divots_mm: FloatArray, places: Sequence[str] = PLACES) -> tuple[Task, ...]:
    """All of them, in order: at each place the middle divot first, then every divot."""
    middle = find_middle_divot(divots_mm)
    tasks: list[Task] = []
    for place in places:
        tasks += [Task(place, "point", k, middle) for k in range(len(ORIENTATIONS))]
        tasks += [Task(place, "rotation", k, middle) for k in range(len(AXES))]
        tasks += [Task(place, "distance", k, k) for k in range(len(divots_mm))]
    return tuple(tasks)


def read_divots(path: str | Path) -> FloatArray:
    """(N, 3) mm of a divot plate's file, `{"points_mm": [[x, y, z], ...]}`.

    Raises:
        InputError: missing, damaged, or fewer than three points, or two at one place.
    """
    try:
        content = json.loads(Path(path).read_text(encoding="utf-8"))
        points = np.array(content["points_mm"], dtype=np.float64)
        if points.ndim != 2 or points.shape[1] != 3 or len(points) < 3:
            raise ValueError("three points or more, of three numbers each, are expected")
        apart = np.linalg.norm(points[:, None] - points, axis=2)[np.triu_indices(len(points), 1)]
        if not np.isfinite(points).all() or apart.min() < _LEAST_APART_MM:
            raise ValueError(f"points are not finite, or nearer than {_LEAST_APART_MM:g} mm")
    except (OSError, ValueError, TypeError, KeyError) as error:
        raise InputError(
            f"divot plate {path} cannot be read ({error})",
            subject=str(path),
            remedy='write {"points_mm": [[x, y, z], ...]} as the plate was measured, mm',
        ) from error
    return points
