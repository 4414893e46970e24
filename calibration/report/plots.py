"""Plots of a calibration's report, each as SVG text.

Matplotlib is slow to import, so each function takes it at first use.
"""

import io
import re
from collections.abc import Callable
from typing import Any

import numpy as np

from calibration.rig.lengths import compute_epipolar_px
from calibration.rig.rig_solution import Calibration
from calibration.rig.uncertainty import compute_bounds_mm
from navapp.geometry.transform import FloatArray

BLUE, ORANGE, _PALE, GREY = "#2b6cb0", "#c05621", "#fbd38d", "#718096"
_MAP_COLUMNS, _MAP_ROWS = 48, 27


def draw_residuals(found: Calibration) -> str:
    """Seen less predicted of every mark, enlarged, over both pictures."""
    largest = max(float(np.abs(part).max()) for pair in found.solved.residuals_px for part in pair)
    factor = 0.04 * found.solved.model.width / max(largest, 1e-9)

    def draw(figure: Any) -> None:
        for number, side in enumerate(("left", "right")):
            axes = _picture_axes(figure, number, found, f"{side} picture")
            for pair, left in zip(found.pairs, found.solved.residuals_px, strict=True):
                marks, arrows = getattr(pair, side).pixels, left[number] * factor
                axes.quiver(
                    marks[:, 0], marks[:, 1], arrows[:, 0], arrows[:, 1],
                    angles="xy", scale_units="xy", scale=1.0, color=BLUE, width=0.0015,
                )  # fmt: skip
        figure.suptitle(
            f"what is left at every mark, {factor:.0f} times as long as it is "
            f"(the largest coordinate is {largest:.3f} px)",
            fontsize=9,
        )

    return draw_svg(draw, (9.6, 3.1))


def draw_coverage(found: Calibration) -> str:
    """Where marks were seen in both pictures, and where none were though the rig is used there."""
    from matplotlib.colors import ListedColormap

    model = found.solved.model

    def draw(figure: Any) -> None:
        for number, side in enumerate(("left", "right")):
            share = getattr(found.covered, side)
            axes = _picture_axes(figure, number, found, f"{side}: {100 * share:.0f} % covered")
            marks = np.vstack([getattr(pair, side).pixels for pair in found.pairs])
            bare = found.covered.bare[number]
            edges = [
                np.linspace(0.0, side_px, n + 1)
                for side_px, n in zip((model.width, model.height), bare.shape[::-1], strict=True)
            ]
            shade = np.ma.masked_where(~bare, np.ones(bare.shape))
            axes.pcolormesh(*edges, shade, cmap=ListedColormap([_PALE]))
            axes.plot(marks[:, 0], marks[:, 1], ".", color=BLUE, markersize=1.5)

    return draw_svg(draw, (9.6, 3.1))


def draw_views(found: Calibration) -> str:
    """Residuals of every view, solved with and held out."""
    solved = [_rms(np.vstack(left)) for left in found.solved.residuals_px]
    held = np.sqrt(found.held_out.squares_px2)
    names = [str(pair.index) for pair in found.pairs]

    def draw(figure: Any) -> None:
        axes = figure.add_subplot()
        place = np.arange(len(names))
        axes.bar(place - 0.2, solved, 0.4, color=BLUE, label="solved with")
        axes.bar(place + 0.2, held, 0.4, color=ORANGE, label="held out")
        axes.set_xticks(place, names, fontsize=7)
        axes.set(xlabel="pair", ylabel="rms, px")
        axes.legend(frameon=False)

    return draw_svg(draw, (9.6, 2.4))


def draw_epipolar(found: Calibration) -> str:
    """Distances of the right marks from the left ones' lines."""
    across = compute_epipolar_px(found.rig, found.pairs)

    def draw(figure: Any) -> None:
        axes = figure.add_subplot()
        axes.hist(across, bins=60, color=BLUE)
        axes.axvline(0.0, color=GREY, linewidth=0.8)
        axes.set(xlabel="distance from the epipolar line, px", ylabel="marks")

    return draw_svg(draw, (4.7, 2.4))


def draw_uncertainty(found: Calibration, depth_mm: float) -> str:
    """Predicted 95 % error of a point at one distance, over the left picture; mm."""
    model, shared = found.solved.model, found.solved.shared
    x = (np.arange(_MAP_COLUMNS) + 0.5) / _MAP_COLUMNS * model.width
    y = (np.arange(_MAP_ROWS) + 0.5) / _MAP_ROWS * model.height
    u, v = np.meshgrid(x, y)
    points_mm = found.rig.left.rays(np.column_stack([u.ravel(), v.ravel()])) * depth_mm
    covariance = found.solved.rig_covariance
    # In the working volume the solve may know of more than its covariance does.
    formal = compute_bounds_mm(model, shared, covariance, found.points_mm)
    told = compute_bounds_mm(model, shared, covariance, points_mm) * np.median(
        found.bounds_mm / formal
    )
    pixels = found.rig.right.project(found.rig.right_from_left.apply(points_mm))
    is_seen = ((pixels >= 0.0) & (pixels < (model.width, model.height))).all(axis=1)
    told = np.where(is_seen, told, np.nan).reshape(u.shape)

    def draw(figure: Any) -> None:
        axes = figure.add_subplot()
        shown = axes.contourf(u, v, told, levels=8, cmap="viridis")
        figure.colorbar(shown, ax=axes, label="95 % error, mm")
        axes.set(xlim=(0, model.width), ylim=(model.height, 0), aspect="equal")
        axes.set_title(f"at {depth_mm:.0f} mm, where both cameras see it", fontsize=9)

    return draw_svg(draw, (4.7, 2.8))


def _rms(residual_px: FloatArray) -> float:
    return float(np.sqrt((residual_px**2).sum(axis=1).mean()))


def _picture_axes(figure: Any, number: int, found: Calibration, title: str) -> Any:
    axes = figure.add_subplot(1, 2, number + 1)
    model = found.solved.model
    axes.set(xlim=(0, model.width), ylim=(model.height, 0), aspect="equal")
    axes.set_title(title, fontsize=9)
    return axes


def draw_svg(draw: Callable[[Any], None], size_inch: tuple[float, float]) -> str:
    """A figure without a window, as the text of an SVG element."""
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    with rc_context({"svg.fonttype": "none", "font.size": 8.0, "svg.hashsalt": "navapp"}):
        figure = Figure(figsize=size_inch, layout="constrained")
        draw(figure)
        file = io.StringIO()
        figure.savefig(file, format="svg", metadata={"Date": None, "Creator": None})
    # Inside a page neither a head nor a record of who drew it is wanted.
    return re.sub(r"^.*?(?=<svg)|<metadata>.*?</metadata>", "", file.getvalue(), flags=re.DOTALL)
