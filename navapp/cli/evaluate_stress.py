"""`navapp evaluate --stress`: one thing at a time made worse, until the judge refuses."""

import argparse
import os
from typing import TYPE_CHECKING, Any

from navapp.cli.diagnostics import Diagnostics, check_writable, write_json
from navapp.errors import UsageError

if TYPE_CHECKING:
    from navapp.evaluation.stress_matrix import StressSettings

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


def check_no_stress(options: argparse.Namespace) -> None:
    """Refuse options of the stress matrix without it.

    Raises:
        UsageError: there is one.
    """
    if options.axes is not None:
        raise UsageError("--axes is of the stress matrix", remedy="add --stress")


def run_stress(options: argparse.Namespace, diagnostics: Diagnostics) -> int:
    """Do it; the exit code."""
    from navapp.evaluation.campaign import CampaignFolder, run_campaign
    from navapp.evaluation.stress_results import write_stress

    check_writable(options.json)
    settings = _read_settings(options)
    n_processes = options.processes or min(4, os.cpu_count() or 1)
    folder = CampaignFolder(options.out, settings)
    diagnostics.note(
        f"{len(settings.tests)} sequences, {n_processes} at a time, into {options.out}"
    )

    def tell(n_done: int, n_all: int, name: str) -> None:
        diagnostics.progress("stressing", n_done / n_all)
        diagnostics.detail(f"{n_done} of {n_all}: {name}")

    run_campaign(folder, settings, n_processes, tell)
    content = write_stress(folder, settings)
    write_json(str(folder.path / "stress.json"), "evaluate", content)
    write_json(options.json, "evaluate", content)
    if options.json != "-":
        _say(content["summary"], options.out, diagnostics)
    return 0


def _read_settings(options: argparse.Namespace) -> "StressSettings":
    from navapp.evaluation.stress_axes import AXES, FIRST_STRESS_SEED, MOST_KNEES
    from navapp.evaluation.stress_matrix import StressSettings

    if options.quick and (options.tests, options.frames) != (None, None):
        raise UsageError(
            f"--quick is one knee and {_QUICK_FRAMES} frames a level",
            remedy="leave out --tests and --frames",
        )
    names = _read_axes(options.axes, tuple(AXES))
    n_knees = 1 if options.quick else _or(options.tests, _KNEES)
    n_frames = _QUICK_FRAMES if options.quick else _or(options.frames, _FRAMES)
    seed = _or(options.seed, FIRST_STRESS_SEED)
    if not 1 <= n_knees <= MOST_KNEES:
        raise UsageError(f"--tests must be from 1 to {MOST_KNEES}")
    if n_frames < 1:
        raise UsageError("--frames must be at least 1")
    if options.processes is not None and options.processes < 1:
        raise UsageError("--processes must be at least 1")
    if seed < 0:
        raise UsageError("--seed must not be negative")
    return StressSettings(names, n_knees, n_frames, seed, options.quick)


def _read_axes(asked: list[str] | None, known: tuple[str, ...]) -> tuple[str, ...]:
    if asked is None:
        return known
    unknown = [name for name in asked if name not in known]
    if unknown:
        raise UsageError(f"there is no axis '{unknown[0]}'", remedy=f"use {', '.join(known)}")
    return tuple(name for name in known if name in asked)


def _or(given: int | None, usual: int) -> int:
    return usual if given is None else given


def _say(summary: dict[str, Any], out: str, diagnostics: Diagnostics) -> None:
    if summary["quick"]:
        diagnostics.say("a quick look, no results: one knee and a few frames a level")
    judged = summary["judged"]
    diagnostics.say(
        f"{judged['ok']} of {judged['frames']} frames OK, {judged['wrong_and_ok']} of them wrong "
        "beyond their bound, where pictures can show what is wrong"
    )
    if summary["wrong_and_ok_on"]:
        diagnostics.say(f"OK and wrong on: {', '.join(summary['wrong_and_ok_on'])}")
    diagnostics.say(f"tables, report and all frames: {out}")
