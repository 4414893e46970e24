"""The summary of a plan as one HTML page."""

import base64
from html import escape
from pathlib import Path

from navapp.preop.plan_facts import make_bone_rows, make_origin_rows
from navapp.preop.plan_view import PlanView
from navapp.preop.summary_slices import SLICES_STYLE, make_slices_section

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
    "Look at the coloured lines: each must follow the outer rim of the bright cortex all the way, "
    "stop at the joint, and take in no part of another bone. Where it does not, give --seed, "
    "--region or a ready segmentation (--labels)."
)


def make_summary_page(view: PlanView, folder: Path) -> str:
    """The page, self-contained; pictures of the bones are those that lie in the folder already."""
    plan, origin = view.plan, view.origin
    warnings = "".join(f'<p class="warning">{escape(text)}</p>' for text in origin.warnings)
    parts = [
        f"<h1>Plan {escape(plan.name or folder.name)}</h1>",
        "<p>Research software, not for clinical use. Coordinates are LPS, lengths mm.</p>",
        warnings or "<p>No warnings.</p>",
        "<h2>Where it comes from</h2>",
        _table(make_origin_rows(view)),
        "<h2>Bones</h2>",
        _bones(view),
    ]
    if origin.spacing_mm:
        parts.append(f'<p class="note">{_LOOK}</p>')
    parts.append(make_slices_section(view))
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
        f"<style>{_STYLE}{SLICES_STYLE}</style><body>{body}</body></html>\n"
    )


def _bones(view: PlanView) -> str:
    rows = []
    heads: list[str] = []
    for name, bone in view.plan.bones.items():
        facts = make_bone_rows(bone, view.origin)
        heads = [head for head, _ in facts]
        cells = (name, *(value for _, value in facts))
        rows.append("<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in cells) + "</tr>")
    head = "".join(f"<th>{escape(text)}</th>" for text in ("bone", *heads))
    return f"<table><tr>{head}</tr>{''.join(rows)}</table>"


def _table(rows: list[tuple[str, str]]) -> str:
    cells = "".join(
        f"<tr><th>{escape(name)}</th><td>{escape(value)}</td></tr>" for name, value in rows
    )
    return f"<table>{cells}</table>"
