"""The report of a display in a mirror: one HTML file by which a person trusts it, or does not."""

from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from calibration.mirror.alignments import ACCEPT_MM, AlignedCalibration
from calibration.mirror.display_acceptance import DisplayLimits
from calibration.mirror.display_solution import DisplayCalibration
from calibration.report.page import make_html, make_note, make_table, make_verdict
from calibration.report.plots import BLUE, ORANGE, draw_svg
from navapp.geometry.display_model import DisplayModel
from navapp.geometry.transform import FloatArray
from navapp.geometry.whole_files import write_whole

_NOT_SEEN = (
    "The eye itself is not measured: guides are right for an eye at the calibrated place, and off "
    "by its displacement times the depth between screen and point over the distance. A mirror, a "
    "monitor or a stereo camera that is moved after this day moves all guides and leaves no trace: "
    "check before each session. Research software, not for clinical use."
)


def write_view_report(path: str | Path, found: DisplayCalibration, limits: DisplayLimits) -> None:
    """Write the report of a calibration by views, whole or not at all."""
    write_whole(path, make_view_page(found, limits).encode("utf-8"))


def write_alignment_report(path: str | Path, found: AlignedCalibration, reading: str) -> None:
    """Write the report of a calibration by alignments, whole or not at all.

    The reading is `AlignedDisplay.reading`.
    """
    write_whole(path, make_alignment_page(found, reading).encode("utf-8"))


def make_view_page(found: DisplayCalibration, limits: DisplayLimits) -> str:
    """The report of a calibration by views as HTML."""
    held_mm, held_arcmin = found.held_out.quantile(0.95)
    quality = found.model.quality
    error_mm = float("nan") if quality is None or quality.error_mm is None else quality.error_mm
    rows = [
        ("error on held-out views, 95 %", f"{held_mm:.3f} mm", f"at most {limits.accept_mm:.2f}"),
        ("the same as the eye sees it", f"{held_arcmin:.2f} arcmin",
         f"at most {limits.accept_arcmin:.1f}"),
        ("predicted error, 95 %", f"{error_mm:.3f} mm", "at nearly all marks of the site"),
        ("rms of what is left at the marks", f"{found.rms_px:.3f} px", "all four pictures"),
        ("views", f"{len(found.views)} used, {len(found.dropped)} not", str(found.scene.board)),
    ]  # fmt: skip
    dropped = [(f"view {one.index}", escape(one.reason), "") for one in found.dropped]
    return _page(
        found.model,
        f"guides appear within {held_mm:.2f} mm of where they should on views that were held out.",
        [
            make_table(rows),
            "<h2>How far guides appear from their points, on held-out views</h2>",
            _draw_errors(found.held_out.mm, limits.accept_mm),
            "<h2>What is left at the pattern's marks, in the eye's camera</h2>",
            _draw_residuals(found),
            make_note("Arrows of a common direction say that the panel is not flat, or that "
                      "something moved."),
            "<h2>Predicted error at the marks of the site</h2>",
            _draw_predicted(found.model, found.anatomy_mm, found.predicted_mm),
            "<h2>Views that are not used</h2>",
            make_table(dropped) if dropped else make_note("None."),
        ],
    )  # fmt: skip


def make_alignment_page(found: AlignedCalibration, reading: str) -> str:
    """The report of a calibration by alignments as HTML."""
    quality = found.model.quality
    error_mm = float("nan") if quality is None or quality.error_mm is None else quality.error_mm
    n_used = int(found.is_used.sum())
    rows = [
        ("predicted error, 95 %", f"{error_mm:.3f} mm", f"at most {ACCEPT_MM:.2f}"),
        ("alignments", f"{n_used} used, {len(found.is_used) - n_used} not", ""),
        ("scatter of the alignments", f"{found.alignment_sd_px:.2f} px", "standard deviation"),
        ("wandering of the eye", f"{found.wander_sd_mm:.2f} mm", "standard deviation, assumed"),
        ("the eye reads the display", reading, "as it was told; alignments cannot tell"),
    ]
    lengths = np.linalg.norm(found.residuals_px, axis=1)
    return _page(
        found.model,
        f"guides appear within {error_mm:.2f} mm of where they should, by prediction.",
        [
            make_table(rows),
            "<h2>How far crosses were from where the solution draws them, px</h2>",
            _draw_errors(lengths, 3.0 * found.alignment_sd_px, "px"),
            "<h2>Predicted error at the anatomy</h2>",
            _draw_predicted(found.model, found.anatomy_mm, found.predicted_mm),
        ],
    )


def _page(model: DisplayModel, praise: str, parts: list[str]) -> str:
    quality = model.quality
    is_accepted = quality is not None and quality.is_accepted
    verdict = make_verdict(is_accepted, praise, () if quality is None else quality.reasons)
    name = escape(model.display_name or "the display")
    head = [f"<h1>Calibration of {name} in the mirror</h1>", verdict, "<h2>How good it is</h2>"]
    tail = [
        "<h2>What was solved for</h2>", make_table(_numbers(model)),
        "<h2>What this cannot see</h2>", make_note(_NOT_SEEN),
    ]  # fmt: skip
    return make_html(name, [*head, *parts, *tail])


def _numbers(model: DisplayModel) -> list[tuple[str, str, str]]:
    screen, quality = model.screen, model.quality
    covariance = None if quality is None else quality.covariance
    sds = np.sqrt(np.diag(covariance)) if covariance is not None else np.full(14, np.nan)
    shown = "mirrored" if model.flips_columns ^ model.flips_rows else "as it is"
    rows = [
        ("screen's middle, mm", _three(screen.middle_mm), f"&plusmn; {_three(sds[3:6])}"),
        ("eye, mm", _three(model.eye_mm), f"&plusmn; {_three(sds[11:])}, {model.viewing_eye}"),
        ("pitch, mm", f"{screen.pitch_mm:.5f}", f"&plusmn; {screen.pitch_mm * sds[6]:.5f}"),
        ("bulge, mm", f"{screen.bulge_mm:.2f}", f"&plusmn; {sds[7]:.2f}"),
        ("picture", f"{screen.width_px} x {screen.height_px} px", f"seen {shown}"),
    ]
    if model.glass is not None:
        rows.append(("glass, mm", f"{model.glass.thickness_mm:.2f}", f"&plusmn; {sds[8]:.2f}"))
    if quality is not None and quality.made_on is not None:
        rows.append(("made on", str(quality.made_on), f"expires on {quality.expires_on}"))
    return rows


def _three(values: FloatArray) -> str:
    return ", ".join(f"{value:.2f}" for value in values)


def _draw_errors(errors: FloatArray, limit: float, unit: str = "mm") -> str:
    def draw(figure: Any) -> None:
        axes = figure.add_subplot()
        axes.hist(errors, bins=40, color=BLUE)
        axes.axvline(limit, color=ORANGE, linewidth=1.0)
        axes.set(xlabel=f"error, {unit}", ylabel="marks")

    return draw_svg(draw, (4.7, 2.4))


def _draw_residuals(found: DisplayCalibration) -> str:
    """Arrows at the pattern's marks of all views, enlarged."""
    width, height = found.scene.eye_size
    left = found.solved.residuals_px["eye_screen"]
    marks = np.vstack([view.eye_screen.pixels for view in found.views])
    factor = 0.04 * width / max(float(np.abs(left).max()), 1e-9)

    def draw(figure: Any) -> None:
        axes = figure.add_subplot()
        axes.quiver(
            marks[:, 0], marks[:, 1], left[:, 0] * factor, left[:, 1] * factor,
            angles="xy", scale_units="xy", scale=1.0, color=BLUE, width=0.0015,
        )  # fmt: skip
        axes.set(xlim=(0, width), ylim=(height, 0), aspect="equal")
        axes.set_title(f"{factor:.0f} times as long as they are", fontsize=9)

    return draw_svg(draw, (6.0, 4.0))


def _draw_predicted(model: DisplayModel, points_mm: FloatArray, predicted_mm: FloatArray) -> str:
    pixels = model.project(points_mm)

    def draw(figure: Any) -> None:
        axes = figure.add_subplot()
        shown = axes.scatter(pixels[:, 0], pixels[:, 1], c=predicted_mm, s=9, cmap="viridis")
        figure.colorbar(shown, ax=axes, label="95 % error, mm")
        axes.set(xlim=(0, model.screen.width_px), ylim=(model.screen.height_px, 0), aspect="equal")
        axes.set_title("where they are drawn on the display", fontsize=9)

    return draw_svg(draw, (6.0, 3.2))
