"""Bar charts after the paper's figures 5 and 6: processing time and error by situation."""

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from calibration.report.plots import draw_svg
from navapp.evaluation.cases import SITUATIONS, SituationName
from navapp.evaluation.published import Published, find_published
from navapp.evaluation.rows import Row
from navapp.tracking import Method

_METHODS: dict[Method, tuple[str, str]] = {
    "icp": ("icp", "#718096"),
    "paper": ("paper", "#c05621"),
    "bimcc": ("bimcc", "#2b6cb0"),
}
_SHORT: dict[SituationName, str] = {
    "registration": "registration",
    "overlay": "overlay",
    "patient": "patient moves",
    "instrument": "instrument moves",
}
# What the method has lost would hide all others.
_MOST_MM = 2.0


def draw_rates(rows: Sequence[Row]) -> str:
    """Frames a second by situation, median of the cases; SVG."""
    return _draw(
        rows,
        lambda row: row.fps,
        (lambda told: told.icp_fps, lambda told: told.paper_fps),
        "frames a second, median",
        None,
    )


def draw_errors(rows: Sequence[Row]) -> str:
    """Overlay error by situation, median of the cases; SVG."""
    return _draw(
        rows,
        lambda row: row.overlay_mm,
        (lambda told: told.icp_mm, lambda told: told.paper_mm),
        f"overlay error, mm, median (to {_MOST_MM:g})",
        _MOST_MM,
    )


def _draw(
    rows: Sequence[Row],
    value_of: Callable[[Row], float | None],
    published: tuple[Callable[[Published], float], Callable[[Published], float]],
    label: str,
    most: float | None,
) -> str:
    situations = tuple(SITUATIONS)
    places = np.arange(len(situations))
    cases = {row.case for row in rows}

    def draw(figure: Any) -> None:
        axes = figure.add_subplot()
        for number, (name, colour, get) in enumerate(
            (("state of the art, as printed", "#cbd5e0", published[0]),
             ("proposal, as printed", "#fbd38d", published[1]))
        ):  # fmt: skip
            heights = [
                np.median([get(find_published(case)) for case in cases if case.situation == one])
                if any(case.situation == one for case in cases) else math.nan
                for one in situations
            ]  # fmt: skip
            axes.bar(places + 0.16 * (number - 2), heights, 0.15, color=colour, label=name)
        for number, (method, (name, colour)) in enumerate(_METHODS.items()):
            heights = [_middle(rows, method, one, value_of) for one in situations]
            shown = heights if most is None else np.minimum(heights, most)
            axes.bar(places + 0.16 * number, shown, 0.15, color=colour, label=f"{name}, here")
        axes.set_xticks(places, [_SHORT[one] for one in situations], fontsize=8)
        axes.set(ylabel=label)
        axes.legend(frameon=False, fontsize=7, ncols=3, loc="upper left")
        axes.margins(y=0.3)

    return draw_svg(draw, (9.6, 3.2))


def _middle(
    rows: Sequence[Row],
    method: Method,
    situation: SituationName,
    value_of: Callable[[Row], float | None],
) -> float:
    values = [
        value_of(row) for row in rows if row.method == method and row.case.situation == situation
    ]
    known = [value for value in values if value is not None]
    # No bar: one of height 0 would be the best of all.
    return float(np.median(known)) if known else math.nan
