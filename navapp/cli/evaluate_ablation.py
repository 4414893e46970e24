"""`navapp evaluate --ablation`: our method without one of its parts at a time."""

import argparse
from typing import TYPE_CHECKING, Any

from navapp.cli.campaign_options import Counts, choose_cases, read_counts, run_and_write
from navapp.cli.diagnostics import Diagnostics

if TYPE_CHECKING:
    from navapp.evaluation.paper.settings import TableSettings

_SAMPLES, _TESTS, _FRAMES, _QUICK_FRAMES = ["man"], 2, 40, 5


def add_ablation_options(parser: argparse.ArgumentParser) -> None:
    """Declare the option of the ablation."""
    group = parser.add_argument_group("an ablation instead of the tables")
    group.add_argument(
        "--ablation",
        action="store_true",
        help="bimcc without one of its parts at a time, on the same pictures (by default sample "
        f"{_SAMPLES[0]}, {_TESTS} tests of each case)",
    )


def run_ablation(options: argparse.Namespace, diagnostics: Diagnostics) -> int:
    """Run the evaluation, and return the exit code."""
    from navapp.evaluation.ablation.results import write_ablation

    settings = _read_settings(options)
    content = run_and_write(
        settings,
        lambda folder: write_ablation(folder, settings),
        "ablation.json",
        options,
        diagnostics,
    )
    if options.json != "-":
        _say(content["summary"], options.out, diagnostics)
    return 0


def _read_settings(options: argparse.Namespace) -> "TableSettings":
    from navapp.evaluation.methods import VARIANTS
    from navapp.evaluation.paper.cases import FIRST_ABLATION_SEED, MOST_TESTS
    from navapp.evaluation.paper.settings import TableSettings

    usual = Counts(_TESTS, _FRAMES, FIRST_ABLATION_SEED)
    counts = read_counts(options, usual, _QUICK_FRAMES, MOST_TESTS, "case")
    cases, variants = choose_cases(options, _SAMPLES), tuple(VARIANTS)
    return TableSettings(
        cases, variants, counts.tests, counts.frames, counts.first_seed, options.quick
    )


def _say(summary: dict[str, Any], out: str, diagnostics: Diagnostics) -> None:
    if summary["quick"]:
        diagnostics.say("a trial run, no results: one short test of each case")
    for row in summary["variants"]:
        mean_mm, any_mm = (
            "-" if row[name] is None else f"{row[name]:.3f}" for name in ("tre_ok_mm", "tre_any_mm")
        )
        diagnostics.say(
            f"{row['variant']}: {row['n_ok']} of {row['n_frames']} frames OK, TRE mean {mean_mm} "
            f"mm, of all poses {any_mm} mm, OK and wrong: {row['n_wrong']}"
        )
    diagnostics.say(f"tables, report and all frames: {out}")
