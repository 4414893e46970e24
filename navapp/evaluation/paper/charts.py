"""Bar charts: ours by stage; time and error by situation, after the paper's figures 5 and 6."""

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from calibration.report.plots import BLUE, GREY, ORANGE, draw_svg
from navapp.evaluation.paper.cases import SITUATIONS, STAGE_NAMES, SituationName
from navapp.evaluation.paper.published import Published, find_published
from navapp.evaluation.paper.rows import Row, find_ours
from navapp.geometry.transform import FloatArray
from navapp.tracking import Method

_METHODS: dict[Method, str] = {"icp": GREY, "paper": ORANGE, "bimcc": BLUE}
_SHORT: dict[SituationName, str] = {
    "registration": "registration",
    "overlay": "overlay",
    "patient": "patient moves",
    "instrument": "instrument moves",
}
_SITUATION_COLOURS = ("#2b6cb0", "#63b3ed", "#c05621", "#f6ad55")
# What the method has lost would hide all others.
_MOST_MM = 2.0


def draw_stages(rows: Sequence[Row]) -> str:
    """TRE of what our judge calls OK, and how much that is, by stage and situation; SVG.

    Bars are means over the samples, lines reach from the best to the worst sample.
    """
    from matplotlib.patches import Patch

    def draw(figure: Any) -> None:
        errors, shares = figure.subplots(1, 2)
        _draw_by_stage(errors, rows, lambda row: row.tre_mm)
        errors.set(ylabel="TRE of OK frames, mm, mean")
        _draw_by_stage(shares, rows, lambda row: 100.0 * row.figures.ok_share)
        shares.set(ylabel="OK, % of frames", ylim=(0.0, 100.0))
        names = [
            Patch(color=colour, label=_SHORT[one])
            for one, colour in zip(SITUATIONS, _SITUATION_COLOURS, strict=True)
        ]
        figure.legend(handles=names, frameon=False, ncols=4, loc="outside upper center")

    return draw_svg(draw, (9.6, 3.2))


def _draw_by_stage(axes: Any, rows: Sequence[Row], value_of: Callable[[Row], float | None]) -> None:
    for number, (situation, colour) in enumerate(zip(SITUATIONS, _SITUATION_COLOURS, strict=True)):
        for place, stage in enumerate(STAGE_NAMES):
            found = [value_of(row) for row in find_ours(rows, stage, situation)]
            values = [value for value in found if value is not None]
            at = place + 0.2 * (number - 1.5)
            if not values:
                axes.text(at, 0.0, "none", ha="center", va="bottom", fontsize=6, rotation=90)
                continue
            axes.bar(at, np.mean(values), 0.18, color=colour)
            axes.plot((at, at), (min(values), max(values)), color="black", linewidth=0.8)
    axes.set_xticks(np.arange(len(STAGE_NAMES)), STAGE_NAMES)


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
        "overlay error, mm, median",
        _MOST_MM,
    )


def _draw(
    rows: Sequence[Row],
    value_of: Callable[[Row], float | None],
    published: tuple[Callable[[Published], float], Callable[[Published], float]],
    label: str,
    most: float | None,
) -> str:
    bars = [
        ("state of the art, as printed", "#cbd5e0", _middle_printed(rows, published[0])),
        ("proposal, as printed", "#fbd38d", _middle_printed(rows, published[1])),
    ]
    for method, colour in _METHODS.items():
        bars.append((f"{method}, here", colour, _middle(rows, method, value_of)))

    def draw(figure: Any) -> None:
        axes = figure.add_subplot()
        for number, (name, colour, heights) in enumerate(bars):
            places = np.arange(len(SITUATIONS)) + 0.16 * (number - 2)
            is_known = np.isfinite(heights)
            shown = np.minimum(heights, math.inf if most is None else most)
            axes.bar(places[is_known], shown[is_known], 0.15, color=colour, label=name)
            for place, height, top in zip(places, heights, shown, strict=True):
                # No bar looks like one of height 0, the best of all; a cut one is higher.
                told = "none" if math.isnan(height) else f"{height:.1f}" if height > top else ""
                axes.text(place, np.nan_to_num(top), told, ha="center", va="bottom", fontsize=6)
        axes.set_xticks(np.arange(len(SITUATIONS)), [_SHORT[one] for one in SITUATIONS], fontsize=8)
        axes.set(ylabel=label)
        axes.legend(frameon=False, fontsize=7, ncols=3, loc="upper left")
        axes.margins(y=0.3)

    return draw_svg(draw, (9.6, 3.2))


def _middle(
    rows: Sequence[Row], method: Method, value_of: Callable[[Row], float | None]
) -> FloatArray:
    """Median of the cases with a value, by situation; NaN of none."""
    known = [
        (row.case.situation, value)
        for row in rows
        if row.method == method and (value := value_of(row)) is not None
    ]
    return _median_by_situation(known)


def _middle_printed(rows: Sequence[Row], get: Callable[[Published], float]) -> FloatArray:
    """The same of the paper's figures, of the cases that were run."""
    cases = {row.case for row in rows}
    return _median_by_situation([(one.situation, get(find_published(one))) for one in cases])


def _median_by_situation(values: Sequence[tuple[SituationName, float]]) -> FloatArray:
    parts = [[value for name, value in values if name == situation] for situation in SITUATIONS]
    return np.array([np.median(part) if part else math.nan for part in parts])
