"""The parts of a report's page."""

from collections.abc import Sequence
from html import escape

_STYLE = """
body { font: 15px/1.45 system-ui, sans-serif; color: #1a202c; max-width: 62em; margin: 2em auto;
  padding: 0 1em; }
h1 { font-size: 1.5em; } h2 { font-size: 1.15em; margin-top: 2em; }
table { border-collapse: collapse; } td, th { padding: .2em .9em .2em 0; text-align: left;
  vertical-align: top; border-bottom: 1px solid #e2e8f0; }
.verdict { padding: .7em 1em; border-left: .5em solid; background: #f7fafc; }
.good { border-color: #2f855a; } .bad { border-color: #c53030; }
svg { max-width: 100%; height: auto; } p.note { color: #4a5568; max-width: 48em; }
"""


def make_html(title: str, parts: Sequence[str]) -> str:
    """One file without anything from elsewhere; the title is escaped already."""
    return (
        f'<!DOCTYPE html><html lang="en"><head><meta charset="utf-8"><title>{title}</title>'
        f"<style>{_STYLE}</style></head><body>{''.join(parts)}</body></html>\n"
    )


def make_verdict(is_accepted: bool, praise: str, reasons: Sequence[str] = ()) -> str:
    """Accepted, with a sentence; or not, with the reasons."""
    if is_accepted:
        return f'<p class="verdict good"><b>Accepted.</b> {praise}</p>'
    items = "".join(f"<li>{escape(reason)}</li>" for reason in reasons)
    return f'<div class="verdict bad"><b>Not accepted.</b><ul>{items}</ul></div>'


def make_table(rows: Sequence[tuple[str, str, str]]) -> str:
    """Rows of a name, a value and a remark."""
    lines = "".join(f"<tr><th>{a}</th><td>{b}</td><td>{c}</td></tr>" for a, b, c in rows)
    return f"<table>{lines}</table>"


def make_note(text: str) -> str:
    """A paragraph that explains."""
    return f'<p class="note">{text}</p>'
