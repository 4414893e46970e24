"""The report of an accuracy test: one HTML file with figures and a plot."""

from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from calibration.report.page import make_html, make_note
from calibration.report.plots import BLUE, ORANGE, draw_svg
from navapp.control.accuracy_test.states import TakenTip
from navapp.evaluation.accuracy_test.figures import PlaceFigures, Scatter, find_length_errors
from navapp.geometry.transform import FloatArray
from navapp.geometry.whole_files import write_whole

_MANNER = (
    "A localisation and tracking test in the manner of ASTM F2554: a single point in three "
    "orientations, rotations about three axes, and all distances of a divot plate, at five places "
    "of the working volume. The standard is cited for the manner; conformity is not claimed. "
    "Research software, not for clinical use."
)
_OF_POINTS = "Distances from their mean, mm; each place is the mean of 8 pairs of pictures at rest."
_HEAD = ("", "n", "mean", "span", "RMS", "maximum")


def write_localisation_report(
    path: str | Path,
    taken: Sequence[TakenTip],
    figures: Mapping[str, PlaceFigures],
    all_distances: Scatter | None,
    divots_mm: FloatArray,
    about: Mapping[str, str],
    truth_mm: Scatter | None = None,
) -> None:
    """Write it, whole or not at all.

    Args:
        path: of the file.
        taken: all tips.
        figures: by place.
        all_distances: of all places together.
        divots_mm: (N, 3) of the divot plate.
        about: software, rig, tool, day: names and values.
        truth_mm: of a simulated test: the tips against where they really were.
    """
    parts = ["<h1>Accuracy test</h1>", make_note(_MANNER), _table_about(about)]
    rows: list[tuple[str, Scatter | None]] = [
        (f"{place}: the middle divot, three orientations", one.point)
        for place, one in figures.items()
    ]
    parts += ["<h2>Single point</h2>", make_note(_OF_POINTS), _table(rows)]
    rows = [
        (f"{place}: leaned {axis}", scatter)
        for place, one in figures.items()
        for axis, scatter in one.rotations.items()
    ]
    parts += [
        "<h2>Rotations</h2>",
        make_note("Distances of single pairs from their mean, mm."),
        _table(rows),
    ]
    rows = [(place, one.distances) for place, one in figures.items()]
    rows.append(("all places", all_distances))
    note = "Measured less true, mm, between places that are means of 8 pairs; maximum without sign."
    parts += ["<h2>Distances between divots</h2>", make_note(note), _table(rows)]
    parts.append(_plot(taken, list(figures), divots_mm))
    if truth_mm is not None:
        note = "Simulated: distances of all tips from where they really were, mm."
        parts += ["<h2>Against the truth</h2>", make_note(note), _table([("all tips", truth_mm)])]
    write_whole(path, make_html("Accuracy test", parts).encode("utf-8"))


def _table_about(about: Mapping[str, str]) -> str:
    lines = "".join(f"<tr><th>{escape(a)}</th><td>{escape(b)}</td></tr>" for a, b in about.items())
    return f"<table>{lines}</table>"


def _table(rows: Sequence[tuple[str, Scatter | None]]) -> str:
    head = "".join(f"<th>{word}</th>" for word in _HEAD)
    lines = "".join(
        f"<tr><th>{escape(name)}</th>{''.join(f'<td>{one}</td>' for one in _cells(scatter))}</tr>"
        for name, scatter in rows
    )
    return f"<table><tr>{head}</tr>{lines}</table>"


def _cells(scatter: Scatter | None) -> tuple[str, ...]:
    if scatter is None:
        return ("0", "-", "-", "-", "-")
    lengths = (scatter.mean_mm, scatter.span_mm, scatter.rms_mm, scatter.max_mm)
    return (str(scatter.n), *(f"{one:.3f}" for one in lengths))


def _plot(taken: Sequence[TakenTip], places: Sequence[str], divots_mm: FloatArray) -> str:
    """Errors of distances by place."""
    errors = [
        find_length_errors([one for one in taken if one.task.place == place], divots_mm)
        for place in places
    ]

    def draw(figure: Any) -> None:
        axes = figure.add_subplot()
        for number, one in enumerate(errors):
            beside = np.random.default_rng(number).uniform(-0.2, 0.2, len(one))
            axes.plot(number + beside, one, ".", color=BLUE, markersize=3)
        axes.axhline(0.0, color=ORANGE, linewidth=0.8)
        axes.set_xticks(range(len(places)), places)
        axes.set_ylabel("distance, measured less true (mm)")

    return draw_svg(draw, (7.0, 3.0))
