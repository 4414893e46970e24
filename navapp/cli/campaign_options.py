"""What tables, stress matrix and ablation of `navapp evaluate` share: counts, running, results."""

import argparse
import os
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from navapp.cli.campaign_progress import CampaignProgress
from navapp.cli.diagnostics import Diagnostics, check_writable, write_json
from navapp.errors import InputError, UsageError

if TYPE_CHECKING:
    from navapp.evaluation.campaign import Campaign, CampaignFolder
    from navapp.evaluation.paper.cases import Case
    from navapp.tracking import Method


@dataclass(frozen=True, slots=True)
class Counts:
    """How much is run."""

    tests: int  # knees of a case, or of a level
    frames: int  # of each, after the one that is registered in
    first_seed: int


def read_counts(
    options: argparse.Namespace, usual: Counts, quick_frames: int, most_tests: int, what: str
) -> Counts:
    """Read --tests, --frames, --seed and --quick.

    Args:
        options: of the command line.
        usual: what counts where an option is left out.
        quick_frames: of a quick look, with one test.
        most_tests: that have seeds of their own.
        what: has that test, for messages: `case`, `level`.

    Raises:
        UsageError: a number that cannot be, or --quick beside it.
    """
    if options.quick and (options.tests, options.frames) != (None, None):
        raise UsageError(
            f"--quick is one knee and {quick_frames} frames a {what}",
            remedy="leave out --tests and --frames",
        )
    tests = 1 if options.quick else _or(options.tests, usual.tests)
    frames = quick_frames if options.quick else _or(options.frames, usual.frames)
    seed = _or(options.seed, usual.first_seed)
    if not 1 <= tests <= most_tests:
        raise UsageError(f"--tests must be from 1 to {most_tests}")
    if frames < 1:
        raise UsageError("--frames must be at least 1")
    if options.processes is not None and options.processes < 1:
        raise UsageError("--processes must be at least 1")
    if seed < 0:
        raise UsageError("--seed must not be negative")
    return Counts(tests, frames, seed)


def choose_cases(
    options: argparse.Namespace, usual_samples: list[str] | None = None
) -> "tuple[Case, ...]":
    """Cases that --samples, --stages and --situations choose, in the order of the tables.

    Args:
        options: of the command line.
        usual_samples: where --samples is left out; None: all.
    """
    from navapp.evaluation.paper.cases import ALL_CASES

    samples = usual_samples if options.samples is None else options.samples
    return tuple(
        case
        for case in ALL_CASES
        if _is_chosen(case.sample, samples)
        and _is_chosen(case.stage, options.stages)
        and _is_chosen(case.situation, options.situations)
    )


def choose_methods(options: argparse.Namespace) -> "tuple[Method, ...]":
    """Methods that --methods chooses, in the order of the tables."""
    from navapp.evaluation.methods import METHODS

    return tuple(name for name in METHODS if _is_chosen(name, options.methods))


def _is_chosen(name: str, chosen: list[str] | None) -> bool:
    """Whether an option names it; all are chosen where the option is left out."""
    return chosen is None or name in chosen


def run_and_write(
    settings: "Campaign[Any]",
    write: "Callable[[CampaignFolder[Any]], dict[str, Any]]",
    file_name: str,
    options: argparse.Namespace,
    diagnostics: Diagnostics,
) -> dict[str, Any]:
    """Run a campaign in its folder, and write what it has found; the content for programs.

    Args:
        settings: of the campaign.
        write: tables and reports, from what is in the folder.
        file_name: of the content in the folder.
        options: of the command line.
        diagnostics: told how far it is.
    """
    from navapp.evaluation.campaign import CampaignFolder, run_campaign

    check_writable(options.json)
    n_processes = options.processes or min(4, os.cpu_count() or 1)
    folder: CampaignFolder[Any] = CampaignFolder(options.out, settings)
    n_tests, n_timed = len(settings.tests), len(settings.timed_tests)
    alone = f", then {n_timed} alone for their times" if n_timed else ""
    diagnostics.note(f"{n_tests} tests, {n_processes} at a time{alone}, into {options.out}")
    progress = CampaignProgress(n_tests, n_processes, diagnostics)
    run_campaign(folder, settings, n_processes, progress.tell)
    folder.check_code()
    try:
        content = write(folder)
    except OSError as error:
        raise InputError(
            f"the results cannot be written ({error.strerror})",
            subject=str(folder.path),
            remedy="make room or give access there, and run again: what is done is kept",
        ) from error
    write_json(str(folder.path / file_name), "evaluate", content)
    write_json(options.json, "evaluate", content)
    return content


def _or(given: int | None, usual: int) -> int:
    return usual if given is None else given
