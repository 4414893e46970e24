"""Writes what came of recordings: tables, one page with charts, and every frame as CSV."""

import os
from collections.abc import Iterator, Sequence
from html import escape
from pathlib import Path
from typing import Any

from calibration.report.page import make_html, make_note
from navapp.errors import InputError, UsageError
from navapp.evaluation.provenance import describe_origin
from navapp.evaluation.recording.charts import draw_errors_beside_bounds, draw_errors_over_frames
from navapp.evaluation.recording.rows import RecordingRow, make_rows
from navapp.evaluation.recording.study import Studied
from navapp.evaluation.recording.truth import describe_truth, truth_to_json
from navapp.evaluation.recording.truth_files import DivotTruth
from navapp.evaluation.report_parts import (
    format_mm,
    format_number,
    format_share,
    format_table,
    make_frames_csv,
    make_picture,
    render_markdown,
)
from navapp.evaluation.scores import FrameScore
from navapp.geometry.whole_files import write_whole

FILES = ("tables.md", "report.html", "frames.csv", "evaluate.json")
_HEAD = (
    "recording", "method", "frames", "with truth", "OK", "error mm: mean", "median", "95 %",
    "largest", "overlay mm", "outline mm", "within the bound", "OK and wrong", "fps",
)  # fmt: skip
_VERDICTS = "recording", "method", "verdict", "at most 1 mm", "more than 1 mm", "no pose"
_ABOUT = (
    "Errors: mean over the stage's targets (without any, over the bone's visible vertices), or "
    "over the touched points. Those of `bimcc` are of frames that its judge calls OK; `icp` and "
    "`paper`, carried on whatever our judge says, are measured in every frame with a pose. The "
    "first frame, which is registered in, is not counted. OK and wrong: more than 1 mm off, and "
    "more than the predicted bound; at touched points, to which the bound does not apply, more "
    "than 1 mm off. fps: one over the mean time of a frame in which the bone was followed. Frames "
    "of one recording are much alike: their number is no number of independent trials.\n"
)


def check_folder(folder: str | Path) -> Path:
    """A folder for the results.

    Raises:
        UsageError: it holds anything but results of this kind.
        InputError: nothing can be written there.
    """
    path = Path(folder)
    above = next(one for one in (path, *path.absolute().parents) if one.exists())
    if not above.is_dir() or not os.access(above, os.W_OK):
        raise InputError(
            f"{folder} cannot be written, because of {above}",
            subject=str(folder),
            remedy="name a folder for --out in one that you may write to",
        )
    if path.is_dir() and {one.name for one in path.iterdir()} <= set(FILES):
        return path
    if path.exists():
        raise UsageError(
            f"{folder} holds something else", subject=str(folder),
            remedy="choose a new folder for --out",
        )  # fmt: skip
    return path


def write_report(folder: Path, studied: Sequence[Studied]) -> dict[str, Any]:
    """Write `tables.md`, `report.html` and `frames.csv`; the content of `evaluate.json`."""
    rows = [row for one in studied for row in make_rows(one)]
    tables = _make_tables(studied, rows)
    folder.mkdir(parents=True, exist_ok=True)
    write_whole(folder / "tables.md", tables.encode())
    write_whole(folder / "report.html", _make_page(tables, studied).encode())
    write_whole(folder / "frames.csv", _make_csv(studied).encode())
    return {
        "origin": describe_origin(),
        "rows": [row.to_json() for row in rows],
        "summary": {"recordings": {one.name: {"truth": truth_to_json(one)} for one in studied}},
    }


def _make_tables(studied: Sequence[Studied], rows: Sequence[RecordingRow]) -> str:
    parts = ["# Evaluation on recordings", ""]
    parts += [
        f"- {describe_origin()}",
        "- research software, not for clinical use",
        "",
        "## Errors",
        "",
        _ABOUT,
        *format_table(_HEAD, (_format_row(row) for row in rows)),
        "",
        "## Verdicts",
        "",
        "Frames with a known truth, by the judge's word and by their error.",
        "",
        *format_table(_VERDICTS, (cells for row in rows for cells in _format_verdicts(row))),
        "",
        "## The truth",
        "",
    ]
    for one in studied:
        parts += [f"### {one.name}", "", *(f"- {line}" for line in describe_truth(one)), ""]
    return "\n".join(parts)


def _format_row(row: RecordingRow) -> tuple[str, ...]:
    counted = row.counted
    lengths_mm = (
        counted.mean_mm, *(counted.percentile_mm(q) for q in (50, 95, 100)),
        counted.mean_displacement_mm, counted.mean_outline_mm,
    )  # fmt: skip
    return (
        _escape(row.name), f"`{row.method}`", str(row.figures.n_frames), str(row.known.n_frames),
        str(row.figures.n_ok), *(format_mm(value) for value in lengths_mm),
        format_share(row.coverage), str(row.n_wrong), format_number(row.fps),
    )  # fmt: skip


def _format_verdicts(row: RecordingRow) -> list[tuple[str, ...]]:
    return [
        (
            _escape(row.name), f"`{row.method}`", status, str(one.n_near), str(one.n_far),
            str(one.n_without_pose),
        )
        for status, one in row.verdicts.items()
    ]  # fmt: skip


def _escape(name: str) -> str:
    return name.replace("|", "\\|")


def _make_page(tables: str, studied: Sequence[Studied]) -> str:
    parts = [render_markdown(tables)]
    for one in studied:
        name = escape(one.name)
        parts += [f"<h2>{name}: error over the pictures</h2>"]
        parts += [make_note("The line is at 1 mm."), draw_errors_over_frames(one)]
        if not isinstance(one.truth, DivotTruth):
            parts += [f"<h2>{name}: error against bound, and against what is hidden</h2>"]
            parts += [make_note("Above the line an error is larger than its predicted bound.")]
            parts += [draw_errors_beside_bounds(one, one.leading)]
        parts += [f"<h2>{name}: worst frames</h2>", *_show_worst(one)]
    return make_html("Evaluation on recordings", parts)


def _show_worst(one: Studied) -> list[str]:
    parts = [
        make_note(
            "The largest errors that the judge calls OK; of all poses where it calls none so. "
            "White is where the bone is, where that is known as a pose; green is where it is drawn."
        )
    ]
    for frame, picture in one.pictures:
        told = f"picture {frame.index}, {frame.status}: {format_mm(frame.tre_mm)} mm"
        parts.append(make_picture(picture, told))
    return parts


def _make_csv(studied: Sequence[Studied]) -> str:
    def list_frames() -> Iterator[tuple[Sequence[object], FrameScore]]:
        for one in studied:
            for method, scores in one.scores.items():
                for frame in scores.frames:
                    yield (one.name, method, frame.index in one.known), frame

    return make_frames_csv(("recording", "method", "has_truth"), list_frames())
