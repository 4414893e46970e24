"""What an evaluation says of the judge and of the noise limit, as Markdown."""

from collections.abc import Mapping, Sequence

from navapp.evaluation.judge.rejector import SHARES, TOLD_SHARES, Rejector
from navapp.evaluation.judge.reliability import BoundQuality, Reliability
from navapp.evaluation.noise_limit.summary import LEAST_EFFICIENCY, STEPS, Efficiency
from navapp.evaluation.report_parts import format_number, format_table
from navapp.evaluation.scores import WRONG_MM

_REJECTED_BY = {
    "bound": "the judge's bound",
    "rms": "residual over the expected one",
    "coverage": "share of the bone that is seen",
    "error": "the true error (unknown in use)",
}
_STEP_NAMES = {
    "pictures": "the pictures: highlights, edges, interpolation",
    "matcher": "the matcher",
    "fit": "the fit and the outline",
}


def make_rejector_tables(
    rejector: Rejector | None,
    bounds: BoundQuality | None,
    limits: Mapping[str, Efficiency],
    titles: Mapping[str, str],
) -> list[str]:
    """Lines for `tables.md`; nothing of what was not measured.

    Args:
        rejector: of our method.
        bounds: of its OK frames.
        limits: by situation.
        titles: of the situations.
    """
    parts: list[str] = []
    if rejector is not None:
        parts += _format_rejector(rejector)
    if bounds is not None:
        parts += _format_reliability(bounds.levels) + _format_sharpness(bounds, titles)
    if limits:
        parts += _format_limits(limits, titles)
    return parts


def _format_rejector(rejector: Rejector) -> list[str]:
    places = [int(abs(SHARES - share).argmin()) for share in TOLD_SHARES]
    head = (
        "rejected by", *(f"{100.0 * share:.0f} % rejected" for share in TOLD_SHARES), "area mm",
        "AUC",
    )  # fmt: skip
    cells = (
        (
            _REJECTED_BY[name],
            *(f"{one.mean_mm[place]:.3f} ({one.p95_mm[place]:.3f})" for place in places),
            f"{one.area_mm:.3f}",
            format_number(one.auc, 3),
        )
        for name, one in rejector.by.items()
    )
    lines = [
        "## The judge as a rejector",
        "",
        f"All {rejector.n_frames} frames of `bimcc` with a pose, whatever the judge says of them; "
        f"{rejector.n_without_pose} without one are refused as well. Mean error (95 % of errors "
        "below), mm, of those that are kept when the worst by a score are rejected; area: mean "
        f"over all shares; AUC: chance that a frame further off than {WRONG_MM:g} mm has a worse "
        "score than another.",
        "",
        *format_table(head, cells),
    ]
    point = rejector.point
    told = [f"{_percent(point.right_refused)} of {point.n_right} others"]
    if point.n_wrong:
        told.insert(0, f"{_percent(point.wrong_refused)} of {point.n_wrong} frames")
        line = f"The judge refuses {told[0]} that are further off than {WRONG_MM:g} mm, and "
        line += f"{told[1]}."
    else:
        line = f"No frame with a pose is further off than {WRONG_MM:g} mm; the judge refuses "
        line += f"{_percent(point.right_refused)} of {point.n_right}."
    return [*lines, "", line, ""]


def _format_reliability(levels: Sequence[Reliability]) -> list[str]:
    return [
        "## How often the bound holds",
        "",
        f"{levels[0].n_frames} OK frames of {levels[0].n_knees} knees; intervals: bootstrap over "
        "knees.",
        "",
        *format_table(
            (
                "nominal", "within the judge's bound (95 %)",
                "within what the covariance alone says (95 %)",
            ),
            (
                (
                    f"{100.0 * one.nominal:.0f} %",
                    f"{100.0 * one.observed:.1f} %{_interval(one.ci95)}",
                    f"{100.0 * one.claimed:.1f} %{_interval(one.claimed_ci95)}",
                )
                for one in levels
            ),
        ),
        "",
    ]  # fmt: skip


def _format_sharpness(bounds: BoundQuality, titles: Mapping[str, str]) -> list[str]:
    cells = (
        (titles.get(name, name), f"{one.median:.1f}", str(one.n_frames))
        for name, one in bounds.sharpness.items()
    )
    return [
        "Bound over error, median; a right bound for errors in three directions has 1.8.",
        "",
        *format_table(("situation", "bound over error", "OK frames"), cells),
        "",
    ]


def _format_limits(limits: Mapping[str, Efficiency], titles: Mapping[str, str]) -> list[str]:
    head = (
        "situation", "frames", "knees", "limit", "ideal", "matched", "reached", "efficiency",
        f"{', '.join(STEPS)} add, mm^2", "largest contribution",
    )  # fmt: skip
    cells = ((titles.get(name, name), *_format_limit(one)) for name, one in limits.items())
    return [
        "## Noise limit",
        "",
        "Root mean square errors over targets and OK frames, mm. Limit: Cramer-Rao bound from the "
        "pictures' slopes and the sensor's noise, of the pixels that obey the model. Ideal: an "
        "estimator that uses these pixels as the model says, told which they are. Matched: a plain "
        "fit to the matcher's disparities at the true pose. Efficiency: limit over reached, "
        f"squared; where it is below {LEAST_EFFICIENCY:g}, the step that adds the largest mean "
        "square.",
        "",
        *format_table(head, cells),
        "",
    ]


def _format_limit(one: Efficiency) -> tuple[str, ...]:
    lengths_mm = one.limit_mm, one.ideal_mm, one.matched_mm, one.reached_mm
    return (
        str(one.n_frames),
        str(one.n_knees),
        *(f"{length_mm:.4f}" for length_mm in lengths_mm),
        f"{one.efficiency:.3f}",
        ", ".join(f"{one.added_mm2[step]:+.5f}" for step in STEPS),
        "-" if one.largest_step is None else _STEP_NAMES[one.largest_step],
    )


def _percent(share: float | None) -> str:
    return "-" if share is None else f"{100.0 * share:.1f} %"


def _interval(ends: tuple[float, float] | None) -> str:
    return "" if ends is None else f" ({100.0 * ends[0]:.1f} to {100.0 * ends[1]:.1f})"
