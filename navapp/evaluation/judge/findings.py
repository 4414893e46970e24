"""All that an evaluation finds out about the judge of our method, and about the noise limit."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from calibration.report.page import make_note
from navapp.evaluation.judge.charts import draw_rejection, draw_trust
from navapp.evaluation.judge.rejector import Rejector, judge_rejector
from navapp.evaluation.judge.reliability import BoundQuality, Knees, judge_bounds
from navapp.evaluation.judge.tables import make_rejector_tables
from navapp.evaluation.noise_limit.summary import Efficiency, compare_with_limit
from navapp.evaluation.paper.cases import SITUATIONS

_TITLES: dict[str, str] = {name: one.title for name, one in SITUATIONS.items()}
_NOTE = (
    "Left: the share of frames refused among those that are right and among those further off than "
    "1 mm; the point is what the judge does. Right: on the line, a bound holds as often as it says."
)


@dataclass(frozen=True, slots=True)
class JudgeFindings:
    """None, or empty, is what no frame tells."""

    rejector: Rejector | None
    bounds: BoundQuality | None
    limits: dict[str, Efficiency]  # by situation

    def to_lines(self) -> list[str]:
        """For `tables.md`."""
        return make_rejector_tables(self.rejector, self.bounds, self.limits, _TITLES)

    def draw(self) -> list[str]:
        """For the report: HTML."""
        if self.rejector is None:
            return []
        return [
            "<h2>Error against rejection</h2>",
            draw_rejection(self.rejector),
            "<h2>ROC, and how often the bound holds</h2>",
            make_note(_NOTE),
            draw_trust(self.rejector, self.bounds),
        ]

    def to_json(self) -> dict[str, Any]:
        """As under `summary` in `evaluate.json`."""
        rejector = None if self.rejector is None else self.rejector.to_json()
        bounds = {} if self.bounds is None else self.bounds.to_json()
        return {
            "judge": {"rejector": rejector, **bounds},
            "noise_limit": {name: one.to_json() for name, one in self.limits.items()},
        }


def examine_judge(knees: Mapping[str, Knees]) -> JudgeFindings:
    """Of the frames of our method, by situation and knee."""
    frames = [one for of_situation in knees.values() for knee in of_situation for one in knee]
    return JudgeFindings(judge_rejector(frames), judge_bounds(knees), compare_with_limit(knees))
