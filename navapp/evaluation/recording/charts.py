"""Charts of a recording: errors over its pictures, against the bound, against what hides it."""

from typing import Any

from calibration.report.plots import draw_svg
from navapp.evaluation.recording.study import Studied
from navapp.evaluation.scores import FrameScore
from navapp.tracking import Method

_COLOURS = {"OK": "#2f855a", "DEGRADED": "#c05621", "LOST": "#c53030"}
_LEAST_MM = 1e-3  # of the logarithmic axes


def draw_errors_over_frames(studied: Studied) -> str:
    """Each method's error in every picture, coloured by the judge's word; SVG."""
    methods = list(studied.scores)

    def draw(figure: Any) -> None:
        for number, method in enumerate(methods):
            axes = figure.add_subplot(len(methods), 1, number + 1)
            for status, colour in _COLOURS.items():
                some = [one for one in _measured(studied, method) if one.status == status]
                axes.plot(
                    [one.index for one in some], [_at_least(one.tre_mm) for one in some],
                    ".", color=colour, markersize=4, label=status,
                )  # fmt: skip
            axes.axhline(1.0, color="#718096", linewidth=0.8)
            axes.set_yscale("log")
            axes.set(ylabel=f"{method}: error, mm")
            axes.legend(frameon=False, fontsize=7, ncols=3, loc="upper left")
            axes.margins(y=0.3)
        axes.set(xlabel="picture")

    return draw_svg(draw, (9.6, 0.6 + 1.9 * len(methods)))


def draw_errors_beside_bounds(studied: Studied, method: Method) -> str:
    """Errors against the predicted bound, and against the share that is hidden; SVG."""
    measured = _measured(studied, method)

    def draw(figure: Any) -> None:
        left, right = figure.add_subplot(1, 2, 1), figure.add_subplot(1, 2, 2)
        for status, colour in _COLOURS.items():
            some = [one for one in measured if one.status == status]
            bounded = [one for one in some if one.bound_mm is not None]
            left.plot(
                [_at_least(one.bound_mm) for one in bounded],
                [_at_least(one.tre_mm) for one in bounded],
                ".", color=colour, markersize=4, label=status,
            )  # fmt: skip
            hidden = [one for one in some if one.hidden is not None]
            right.plot(
                [100.0 * (one.hidden or 0.0) for one in hidden],
                [_at_least(one.tre_mm) for one in hidden],
                ".", color=colour, markersize=4, label=status,
            )  # fmt: skip
        ends = (0.05, 20.0)
        left.plot(ends, ends, color="#718096", linewidth=0.8)
        left.set(xscale="log", yscale="log", xlabel="predicted bound (95 %), mm")
        right.set(yscale="log", xlabel="share of the bone that is hidden, %")
        for axes in (left, right):
            axes.set(ylabel=f"{method}: error, mm")
            axes.legend(frameon=False, fontsize=7)

    return draw_svg(draw, (9.6, 3.4))


def _measured(studied: Studied, method: Method) -> list[FrameScore]:
    frames = studied.scores[method].frames
    return [one for one in frames if one.tre_mm is not None]


def _at_least(value: float | None) -> float:
    return max(value or 0.0, _LEAST_MM)
