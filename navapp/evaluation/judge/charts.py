"""Charts of the judge: error against rejection, ROC, and how often the bound holds."""

from typing import Any

from calibration.report.plots import draw_svg
from navapp.evaluation.judge.rejector import SHARES, Rejector
from navapp.evaluation.judge.reliability import BoundQuality

_LINES = {
    "bound": ("by the bound", "#2b6cb0"),
    "rms": ("by the residual", "#c05621"),
    "coverage": ("by the share seen", "#2f855a"),
    "error": ("by the true error", "#718096"),
}
_GREY = "#718096"


def draw_rejection(rejector: Rejector) -> str:
    """Mean and 95 % error of what is kept; SVG."""

    def draw(figure: Any) -> None:
        for number, label in enumerate(("mean error kept, mm", "95 % of errors kept, mm")):
            axes = figure.add_subplot(1, 2, number + 1)
            for name, (told, colour) in _LINES.items():
                one = rejector.by[name]
                heights = one.mean_mm if number == 0 else one.p95_mm
                style = ":" if name == "error" else "-"
                axes.plot(100.0 * SHARES, heights, style, color=colour, label=told)
            axes.set(xlabel="frames rejected, %", ylabel=label)
            axes.set_ylim(bottom=0.0)
            axes.legend(frameon=False, fontsize=7)

    return draw_svg(draw, (9.6, 3.2))


def draw_trust(rejector: Rejector, bounds: BoundQuality | None) -> str:
    """ROC with the judge's own place, and nominal against observed levels; SVG."""

    def draw(figure: Any) -> None:
        left, right = figure.add_subplot(1, 2, 1), figure.add_subplot(1, 2, 2)
        for axes in (left, right):
            axes.plot((0.0, 100.0), (0.0, 100.0), color=_GREY, linewidth=0.8)
            axes.set(xlim=(-2.0, 102.0), ylim=(-2.0, 102.0))
        _draw_roc(left, rejector)
        if bounds is not None:
            _draw_levels(right, bounds)

    return draw_svg(draw, (9.6, 3.6))


def _draw_roc(axes: Any, rejector: Rejector) -> None:
    point = rejector.point
    axes.set(xlabel="right frames refused, %", ylabel="frames beyond 1 mm refused, %")
    if len(rejector.roc) == 0:
        told = "none beyond 1 mm" if point.n_wrong == 0 else "all beyond 1 mm"
        axes.text(50.0, 50.0, told, ha="center", fontsize=9)
        return
    axes.plot(*(100.0 * rejector.roc.T), color="#2b6cb0", label="by the bound")
    if point.wrong_refused is not None and point.right_refused is not None:
        place = (100.0 * point.right_refused, 100.0 * point.wrong_refused)
        axes.plot(*place, "o", color="#c53030", label="not OK")
    axes.legend(frameon=False, fontsize=7, loc="lower right")


def _draw_levels(axes: Any, bounds: BoundQuality) -> None:
    nominal = [100.0 * one.nominal for one in bounds.levels]
    for told, colour, shares, intervals in (
        (
            "the covariance alone", "#f6ad55",
            [one.claimed for one in bounds.levels], [one.claimed_ci95 for one in bounds.levels],
        ),
        (
            "the judge's bound", "#2b6cb0",
            [one.observed for one in bounds.levels], [one.ci95 for one in bounds.levels],
        ),
    ):  # fmt: skip
        axes.plot(nominal, [100.0 * one for one in shares], "o--", color=colour, label=told)
        for at, ends in zip(nominal, intervals, strict=True):
            if ends is not None:
                axes.plot((at, at), [100.0 * end for end in ends], color=colour, alpha=0.5)
    axes.set(xlabel="nominal, %", ylabel="errors within, %")
    axes.legend(frameon=False, fontsize=7, loc="upper left")
