"""`navapp evaluate --stress`: one thing at a time made worse, until the judge refuses."""

import argparse
from typing import TYPE_CHECKING, Any

from navapp.cli.campaign_options import Counts, read_counts, run_and_write
from navapp.cli.diagnostics import Diagnostics
from navapp.errors import UsageError

if TYPE_CHECKING:
    from navapp.evaluation.stress.matrix import StressSettings

_KNEES, _FRAMES, _QUICK_FRAMES = 5, 20, 3


def add_stress_options(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the stress matrix."""
    group = parser.add_argument_group("a stress matrix instead of the tables")
    group.add_argument(
        "--stress",
        action="store_true",
        help="light, noise, blur, rig, plan and more, each made worse step by step",
    )
    group.add_argument(
        "--axes", nargs="+", metavar="NAME", help="only these (all; a wrong name lists them)"
    )


def run_stress(options: argparse.Namespace, diagnostics: Diagnostics) -> int:
    """Run the evaluation, and return the exit code."""
    from navapp.evaluation.stress.results import write_stress

    settings = _read_settings(options)
    content = run_and_write(
        settings, lambda folder: write_stress(folder, settings), "stress.json", options, diagnostics
    )
    if options.json != "-":
        _say(content["summary"], options.out, diagnostics)
    return 0


def _read_settings(options: argparse.Namespace) -> "StressSettings":
    from navapp.evaluation.stress.axes import AXES, FIRST_STRESS_SEED, MOST_KNEES
    from navapp.evaluation.stress.matrix import StressSettings

    usual = Counts(_KNEES, _FRAMES, FIRST_STRESS_SEED)
    counts = read_counts(options, usual, _QUICK_FRAMES, MOST_KNEES, "level")
    names = _read_axes(options.axes, tuple(AXES))
    return StressSettings(names, counts.tests, counts.frames, counts.first_seed, options.quick)


def _read_axes(asked: list[str] | None, known: tuple[str, ...]) -> tuple[str, ...]:
    if asked is None:
        return known
    unknown = [name for name in asked if name not in known]
    if unknown:
        raise UsageError(f"there is no axis '{unknown[0]}'", remedy=f"use {', '.join(known)}")
    return tuple(name for name in known if name in asked)


def _say(summary: dict[str, Any], out: str, diagnostics: Diagnostics) -> None:
    if summary["quick"]:
        diagnostics.say("a trial run, no results: one knee and a few frames a level")
    judged = summary["judged"]
    diagnostics.say(
        f"{judged['ok']} of {judged['frames']} frames OK, {judged['wrong_and_ok']} of them wrong "
        "beyond their bound, where pictures can show what is wrong"
    )
    if summary["wrong_and_ok_on"]:
        diagnostics.say(f"OK and wrong on: {', '.join(summary['wrong_and_ok_on'])}")
    diagnostics.say(f"tables, report and all frames: {out}")
