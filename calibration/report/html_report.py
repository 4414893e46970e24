"""Writes the report of a calibration as one HTML file without external resources."""

from html import escape
from pathlib import Path

import numpy as np

from calibration.report import plots
from calibration.report.page import make_html, make_note, make_table, make_verdict
from calibration.rig.acceptance import Limits
from calibration.rig.rig_solution import Calibration
from navapp.geometry.rig import StereoRig
from navapp.geometry.whole_files import write_whole

_NOT_SEEN = (
    "All lengths hang on the board's: a board that is printed 0.1 % too large makes "
    "everything 0.1 % too large. Cameras that turn against each other sideways after this "
    "day change every depth and leave no trace in the pictures of a bone: check the rig "
    "with the board before each session. Research software, not for clinical use."
)


def write_report(path: str | Path, found: Calibration, limits: Limits) -> None:
    """Write the report, whole or not at all."""
    write_whole(path, make_page(found, limits).encode("utf-8"))


def make_page(found: Calibration, limits: Limits) -> str:
    """The report as HTML."""
    name = escape(found.rig.name or "stereo rig")
    parts = [
        f"<h1>Calibration of {name}</h1>",
        _verdict(found),
        "<h2>What it measures</h2>",
        make_table(_figures(found, limits)),
        "<h2>What a point in space is worth</h2>",
        _uncertainty(found),
        "<h2>What is left at the marks</h2>",
        plots.draw_residuals(found),
        make_note(
            "Arrows should point anywhere. Arrows of a common direction in one part of a picture "
            "say that the lens, or the board, is not as it was modelled."
        ),
        plots.draw_views(found),
        plots.draw_epipolar(found),
        "<h2>Where the board was shown</h2>",
        plots.draw_coverage(found),
        make_note(
            "Cells without a mark, where the working volume is seen, are orange. "
            f"Marks lay between {found.covered.depth_mm[0]:.0f} and "
            f"{found.covered.depth_mm[1]:.0f} mm; the board was tilted by "
            f"{np.median(found.covered.tilts_deg):.0f} deg (median), "
            f"{found.covered.tilts_deg.max():.0f} deg at most."
        ),
        "<h2>Pairs that are not used</h2>",
        _make_dropped_table(found),
        "<h2>The rig</h2>",
        make_table(_numbers(found)),
        "<h2>What this cannot see</h2>",
        make_note(_NOT_SEEN),
    ]
    return make_html(name, parts)


def _verdict(found: Calibration) -> str:
    quality = found.rig.quality
    if quality is None or quality.is_accepted:
        bound = float(np.median(found.bounds_mm))
        return make_verdict(
            True,
            f"95 % of points in the middle of the working volume are right to {bound:.2f} mm.",
        )
    return make_verdict(False, "", quality.reasons)


def _uncertainty(found: Calibration) -> str:
    if len(found.bounds_mm) == 0:
        return make_note("Nothing: no part of the working volume is seen by both cameras.")
    return plots.draw_uncertainty(found, float(np.mean(found.depth_mm))) + make_note(
        "Predicted error that 95 % of triangulated points stay below, from the covariance of "
        "the solved rig. Most of it is one common shift of everything that is seen."
    )


def _figures(found: Calibration, limits: Limits) -> list[tuple[str, str, str]]:
    ratios, bounds = found.length_ratios, found.bounds_mm
    near, far = found.depth_mm
    told = "unknown"
    if len(bounds):
        told = (
            f"{np.median(bounds):.2f} mm (middle), {np.quantile(bounds, 0.95):.2f} mm (nearly all)"
        )
    rows = [
        (
            "predicted error at the working volume",
            told,
            f"95 %; {near:.0f} to {far:.0f} mm away; at most {limits.accept_mm:.2f} mm",
        ),
        ("rms of what is left", f"{found.solved.rms_px:.3f} px", found.solved.model.name),
        (
            "rms on views not solved with",
            f"{found.held_out_rms_px:.3f} px",
            "only the board's pose is solved for",
        ),
        ("distance from the epipolar lines", f"{found.epipolar_rms_px:.3f} px rms", ""),
        ("pairs", f"{len(found.pairs)} used, {len(found.dropped)} not", str(found.board)),
    ]
    if len(ratios):
        rows.insert(
            1,
            (
                "a length of 100 mm on the board",
                f"measured as {100 * ratios.mean():.2f} &plusmn; {100 * ratios.std():.2f} mm",
                "between far corners, triangulated",
            ),
        )
    return rows


def _numbers(found: Calibration) -> list[tuple[str, str, str]]:
    """Every solved number with its standard error."""
    model, shared = found.solved.model, found.solved.shared
    sigma = np.sqrt(np.maximum(np.diag(found.solved.covariance), 0.0))
    lens = ("fx, px", "fy, px", "cx, px", "cy, px", "k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6")
    rows = [*_record(found.rig), ("baseline", f"{found.rig.baseline_mm:.3f} mm", "")]
    for number, side in enumerate(("left", "right")):
        for k in range(model.n_camera):
            at = number * model.n_camera + k
            rows.append((f"{side} {lens[k]}", f"{shared[at]:.6g}", f"&plusmn; {sigma[at]:.2g}"))
    place = 2 * model.n_camera
    names = [f"rotation {axis}, rad" for axis in "xyz"] + [f"translation {a}, mm" for a in "xyz"]
    for k, name in enumerate(names):
        value, error = shared[place + k], sigma[place + k]
        rows.append((name, f"{value:.6g}", f"&plusmn; {error:.2g}"))
    return rows


def _record(rig: StereoRig) -> list[tuple[str, str, str]]:
    """Which rig it is, and how long it may be used."""
    rows = [("rig id", rig.rig_id, f"pictures of {rig.width} x {rig.height} px")]
    if rig.quality is not None and rig.quality.made_on is not None:
        rows.append(("made on", str(rig.quality.made_on), f"expires on {rig.quality.expires_on}"))
    return rows


def _make_dropped_table(found: Calibration) -> str:
    if not found.dropped:
        return make_note("None.")
    rows = [(f"pair {one.index}", escape(one.reason), "") for one in found.dropped]
    return make_table(rows)
