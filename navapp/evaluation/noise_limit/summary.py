"""The least error beside the one that was reached, by situation, and which step adds most to it."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from navapp.evaluation.scores import ErrorBudget, FrameScore

# A method that needs more than twice the variance that noise allows is looked at.
LEAST_EFFICIENCY = 0.5
# Between two columns of the budget: what the later one has and the earlier has not.
STEPS = ("pictures", "matcher", "fit")


@dataclass(frozen=True, slots=True)
class Efficiency:
    """Root mean squares over the OK frames of a situation that have a budget, mm."""

    n_frames: int
    n_knees: int
    limit_mm: float
    ideal_mm: float
    matched_mm: float
    reached_mm: float

    @property
    def efficiency(self) -> float:
        """Variance that the noise allows over the one that was reached."""
        return self.limit_mm**2 / max(self.reached_mm**2, 1e-12)

    @property
    def added_mm2(self) -> dict[str, float]:
        """By which mean square each of `STEPS` is worse than the one before; may be negative."""
        squares = [
            one**2 for one in (self.limit_mm, self.ideal_mm, self.matched_mm, self.reached_mm)
        ]
        added = np.diff(squares).tolist()
        return dict(zip(STEPS, added, strict=True))

    @property
    def largest_step(self) -> str | None:
        """The step that adds most; None where the efficiency is good, or no step adds anything."""
        added = self.added_mm2
        name = max(added, key=lambda step: added[step])
        is_good = self.efficiency >= LEAST_EFFICIENCY
        return None if is_good or added[name] <= 0.0 else name

    def to_json(self) -> dict[str, Any]:
        """Named values."""
        return {
            **asdict(self),
            "efficiency": self.efficiency,
            "added_mm2": self.added_mm2,
            "largest_step": self.largest_step,
        }


def compare_with_limit(
    knees: Mapping[str, Sequence[Sequence[FrameScore]]],
) -> dict[str, Efficiency]:
    """By situation, of those with a frame whose budget was measured."""
    found = {}
    for name, of_situation in knees.items():
        budgets = [
            [one.budget for one in frames if one.is_ok and one.budget is not None]
            for frames in of_situation
        ]
        if any(budgets):
            found[name] = _pool(budgets)
    return found


def _pool(knees: Sequence[Sequence[ErrorBudget]]) -> Efficiency:
    every = [one for budgets in knees for one in budgets]
    steps = [
        [one.limit_mm, one.ideal_mm, one.matched_mm, one.reached_mm] for one in every
    ]  # fmt: skip
    roots = np.sqrt(np.mean(np.square(steps), axis=0))
    limit_mm, ideal_mm, matched_mm, reached_mm = (float(one) for one in roots)
    n_knees = sum(len(budgets) > 0 for budgets in knees)
    return Efficiency(len(every), n_knees, limit_mm, ideal_mm, matched_mm, reached_mm)
