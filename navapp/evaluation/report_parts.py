"""How every evaluation writes lengths, shares, tables, pictures and frames."""

import base64
import csv
import io
from collections.abc import Iterable, Sequence
from html import escape

from navapp.evaluation.scores import LEVELS, FrameScore

_COLUMNS = (
    "index", "status", "tre_mm", "displacement_mm", "outline_mm", "bound_mm", "seen", "hidden",
    "total_ms", "is_search", "rms_ratio",
)  # fmt: skip
_CLAIMED_COLUMNS = tuple(f"claimed_{100.0 * level:.0f}_mm" for level in LEVELS)
_BUDGET_COLUMNS = ("limit_mm", "ideal_mm", "matched_mm", "reached_mm")
# The last line of what is told of a run.
SIMULATED_NOTE = "simulated devices; research software, not for clinical use"


def format_mm(value: float | None) -> str:
    """A length for a table; a dash where there is none."""
    if value is None:
        return "-"
    return f"{value:.3f}" if value < 10.0 else f"{value:.0f}"


def format_share(share: float | None) -> str:
    """Whole percent; only all is 100 %, and only nothing 0 %. A dash where there is none."""
    if share is None:
        return "-"
    if 0.0 < share < 0.01:
        return "< 1 %"
    return "> 99 %" if 0.99 < share < 1.0 else f"{100.0 * share:.0f} %"


def format_number(value: float | None, n_digits: int = 0) -> str:
    """With so many digits; a dash where there is none."""
    return "-" if value is None else f"{value:.{n_digits}f}"


def format_table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> list[str]:
    """A Markdown table, a line a row."""
    lines = [f"| {' | '.join(head)} |", "|---" * len(head) + "|"]
    return [*lines, *(f"| {' | '.join(cells)} |" for cells in rows)]


def make_quick_note(what: str) -> list[str]:
    """What the reports of a quick look begin with."""
    return [f"**A quick look: {what}. These figures are a trial, and no results.**", ""]


def render_markdown(text: str) -> str:
    """Markdown with tables as HTML."""
    from markdown_it import MarkdownIt

    rendered: str = MarkdownIt("commonmark").enable("table").render(text)
    return rendered


def make_picture(jpeg: bytes, caption: str) -> str:
    """A picture with its caption as HTML."""
    data, told = base64.b64encode(jpeg).decode("ascii"), escape(caption)
    return (
        f'<figure style="display:inline-block;margin:.5em"><img alt="{told}" '
        f'src="data:image/jpeg;base64,{data}"><figcaption>{told}</figcaption></figure>'
    )


def make_frames_csv(
    keys: Sequence[str], frames: Iterable[tuple[Sequence[object], FrameScore]]
) -> str:
    """Every frame as CSV.

    Args:
        keys: names of the columns that tell which frame it is.
        frames: the values of these columns, and the frame.
    """
    head = (*keys, *_COLUMNS, "reasons", *_CLAIMED_COLUMNS, *_BUDGET_COLUMNS)
    return make_csv(head, ((*values, *_list_cells(frame)) for values, frame in frames))


def make_csv(head: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """A table as CSV; an empty cell where there is no value."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(head)
    writer.writerows(rows)
    return out.getvalue()


def _list_cells(frame: FrameScore) -> list[object]:
    claimed = [None] * len(LEVELS) if frame.claimed_mm is None else [*frame.claimed_mm]
    return [
        *(getattr(frame, name) for name in _COLUMNS),
        "; ".join(frame.reasons),
        *claimed,
        *(getattr(frame.budget, name, None) for name in _BUDGET_COLUMNS),
    ]
