"""The chart of an ablation: errors, shares of frames and times, variant by variant."""

from collections.abc import Sequence
from typing import Any

from calibration.report.plots import BLUE, ORANGE, draw_svg
from navapp.evaluation.ablation.rows import VariantRow


def draw_variants(rows: Sequence[VariantRow]) -> str:
    """All variants of one place, the first one on top; SVG."""

    def draw(figure: Any) -> None:
        errors, shares, times = figure.subplots(1, 3, sharey=True)
        _draw_errors(errors, rows)
        _draw_shares(shares, rows)
        times.barh(range(len(rows)), [row.median_ms or 0.0 for row in rows], 0.6, color=BLUE)
        times.set(xlabel="median time of a frame, ms")
        errors.set_yticks(range(len(rows)), [row.variant for row in rows], fontsize=8)
        errors.invert_yaxis()
        for axes in (errors, shares):
            if axes.get_legend_handles_labels()[0]:  # without a pose there are no errors
                axes.legend(frameon=False, fontsize=7, loc="upper center",
                            bbox_to_anchor=(0.5, 1.2), ncols=3)  # fmt: skip

    return draw_svg(draw, (9.6, 3.4))


def _draw_errors(axes: Any, rows: Sequence[VariantRow]) -> None:
    for label, values, marker, colour in (
        ("OK, mean", [row.figures.ok.mean_mm for row in rows], "o", BLUE),
        ("OK, worst", [row.figures.ok.worst_mm for row in rows], "x", BLUE),
        ("all, mean", [row.figures.mean_mm for row in rows], "s", ORANGE),
    ):
        known = [(value, place) for place, value in enumerate(values) if value is not None]
        if known:
            axes.plot(*zip(*known, strict=True), marker, color=colour, ms=5, label=label)
    # Errors without the judge can be a thousand times as large.
    axes.set(xlabel="TRE, mm", xscale="log")
    axes.grid(axis="x", alpha=0.3)


def _draw_shares(axes: Any, rows: Sequence[VariantRow]) -> None:
    for shift, label, counts, colour in (
        (-0.2, "OK", [row.figures.n_ok for row in rows], BLUE),
        (0.2, "OK and wrong", [row.figures.n_wrong for row in rows], ORANGE),
    ):
        widths = [n / max(row.figures.n_frames, 1) for n, row in zip(counts, rows, strict=True)]
        places = [place + shift for place in range(len(rows))]
        axes.barh(places, widths, 0.36, color=colour, label=label)
    axes.set(xlabel="share of frames", xlim=(0.0, 1.0))
