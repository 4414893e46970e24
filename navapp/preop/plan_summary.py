"""The summary of a plan as one HTML page."""

import base64
from html import escape
from pathlib import Path

import numpy as np

from navapp.preop.plan_origin import PlanOrigin
from navapp.values import Plan

_STYLE = """
body { font: 15px/1.45 system-ui, sans-serif; color: #1a202c; max-width: 70em; margin: 2em auto;
  padding: 0 1em; }
h1 { font-size: 1.5em; } h2 { font-size: 1.15em; margin-top: 2em; }
table { border-collapse: collapse; } td, th { padding: .2em .9em .2em 0; text-align: left;
  vertical-align: top; border-bottom: 1px solid #e2e8f0; }
.warning { padding: .5em 1em; border-left: .5em solid #c05621; background: #fffaf0; }
img { max-width: 100%; } p.note { color: #4a5568; max-width: 52em; }
"""
_LOOK = (
    "Look at the orange line: it must follow the outer rim of the bright cortex all the way, stop "
    "at the joint, and take in no part of another bone. Where it does not, give --seed, --region "
    "or a ready segmentation (--labels)."
)


def make_summary_page(plan: Plan, origin: PlanOrigin, folder: Path) -> str:
    """The page; pictures are those that lie in the folder already."""
    warnings = "".join(f'<p class="warning">{escape(text)}</p>' for text in origin.warnings)
    parts = [
        f"<h1>Plan {escape(plan.name or folder.name)}</h1>",
        "<p>Research software, not for clinical use. Coordinates are LPS, lengths mm.</p>",
        warnings or "<p>No warnings.</p>",
        "<h2>Where it comes from</h2>",
        _table(_origin_rows(origin)),
        "<h2>Bones</h2>",
        _bones(plan, origin),
    ]
    if origin.spacing_mm:
        parts.append(f'<p class="note">{_LOOK}</p>')
    for name in plan.bones:
        picture = folder / f"preview_{name}.png"
        if picture.is_file():
            data = base64.b64encode(picture.read_bytes()).decode("ascii")
            source = f"data:image/png;base64,{data}"
            parts.append(f'<h2>{escape(name)}</h2><img alt="{escape(name)}" src="{source}">')
    body = "\n".join(parts)
    title = escape(plan.name or folder.name)
    return (
        f'<!doctype html><html lang="en"><meta charset="utf-8"><title>Plan {title}</title>'
        f"<style>{_STYLE}</style><body>{body}</body></html>\n"
    )


def _origin_rows(origin: PlanOrigin) -> list[tuple[str, str]]:
    rows: list[tuple[str, str]] = [("made from", origin.kind)]
    if origin.description:
        rows.append(("series", origin.description))
    if origin.spacing_mm:
        spacing = " x ".join(f"{step:.3g}" for step in origin.spacing_mm)
        rows.append(("voxels", f"{' x '.join(map(str, origin.size))} of {spacing} mm"))
    if origin.threshold_hu is not None:
        rows.append(("looked at as bone", f"above {origin.threshold_hu:g} HU"))
    if origin.cortex_hu is not None:
        rows.append(("density of cortex", f"{origin.cortex_hu:.0f} HU, found in this CT"))
    if origin.blur_mm:
        plane, axial = origin.blur_mm
        rows.append(
            ("blur of the scanner", f"{plane:.2f} mm in the slices, {axial:.2f} mm across (sd)")
        )
    return rows


def _bones(plan: Plan, origin: PlanOrigin) -> str:
    head = "<tr><th>bone</th><th>side</th><th>volume</th><th>size</th><th>vertices</th>"
    head += "<th>edge measured</th><th>moves a pose (sd)</th><th>cut end</th></tr>"
    rows = []
    for name, bone in plan.bones.items():
        share = origin.measured.get(name)
        cells = (
            name,
            bone.side or "unknown",
            f"{bone.mesh.volume_mm3() / 1000.0:.1f} cm3",
            " x ".join(f"{extent:.0f}" for extent in bone.mesh.size_mm) + " mm",
            str(len(bone.mesh.vertices_mm)),
            "-" if share is None else f"{100.0 * share:.0f} %",
            f"{bone.surface_sd_mm:.2f} mm" if bone.surface_sd_mm else "unknown",
            "yes" if np.any(bone.is_removed) else "no",
        )
        rows.append("<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in cells) + "</tr>")
    return f"<table>{head}{''.join(rows)}</table>"


def _table(rows: list[tuple[str, str]]) -> str:
    cells = "".join(
        f"<tr><th>{escape(name)}</th><td>{escape(value)}</td></tr>" for name, value in rows
    )
    return f"<table>{cells}</table>"
