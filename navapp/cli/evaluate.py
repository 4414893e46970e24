"""`navapp evaluate`: the paper's tables on simulated knees, with three methods."""

import argparse
from typing import TYPE_CHECKING, Any

from navapp.cli.campaign_options import (
    Counts,
    choose_cases,
    choose_methods,
    read_counts,
    run_and_write,
)
from navapp.cli.diagnostics import Diagnostics
from navapp.cli.evaluate_ablation import add_ablation_options, run_ablation
from navapp.cli.evaluate_kinds import find_kind
from navapp.cli.evaluate_peers import add_peers_option, prepare_peers, run_peers, say_peers
from navapp.cli.evaluate_recording import add_options, run_recording
from navapp.cli.evaluate_stress import add_stress_options, run_stress

if TYPE_CHECKING:
    from navapp.evaluation.campaign import CampaignFolder
    from navapp.evaluation.paper.cases import CaseTest
    from navapp.evaluation.paper.settings import TableSettings

_EXAMPLE = """\
examples:
  navapp evaluate --quick --out look/            every case, one test of 5 frames: some minutes
  navapp evaluate --out tables/                  all of it: one to two hours on two cores
  navapp evaluate --stages opening --methods bimcc --tests 2 --out opening/
  navapp evaluate --peers --out tables/          other people's trackers beside them
  navapp evaluate --stress --out stress/         one thing at a time made worse: hours
  navapp evaluate --ablation --out parts/        bimcc without one of its parts at a time
  navapp evaluate --recording pairs/ --rig rig.yml --plan P --truth truth.json --out study/

3 samples x 5 stages x 4 situations x 3 methods, 5 tests each, every test another simulated knee,
registered once and then followed. The folder gets tables.md, report.html, evaluate.json and
frames.csv. Killed in the middle and started again with the same options, it goes on.
"""
_TESTS, _FRAMES, _QUICK_FRAMES = 5, 40, 5


def add_parser(subparsers: Any) -> None:
    """Declare the verb."""
    parser = subparsers.add_parser(
        "evaluate",
        help="the paper's tables: every stage and situation, three methods side by side",
        epilog=_EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    # The words, so that --help needs no heavy import; a test holds them against the tables.
    chosen = (
        ("--samples", "samples", ("man", "woman", "adult")),
        ("--stages", "stages", ("opening", "drilling", "implant", "patella", "spacer")),
        ("--situations", "situations", ("registration", "overlay", "patient", "instrument")),
        ("--methods", "methods", ("icp", "paper", "bimcc")),
    )
    for option, what, names in chosen:
        parser.add_argument(option, nargs="+", choices=names, help=f"{what} (all)")
    parser.add_argument("--tests", type=int, metavar="N", help=f"of each case ({_TESTS})")
    parser.add_argument(
        "--frames",
        type=int,
        metavar="N",
        help=f"of each test ({_FRAMES}; 90 at least with an instrument)",
    )
    parser.add_argument("--seed", type=int, metavar="N", help="of the first knee")
    parser.add_argument(
        "--quick", action="store_true", help="one test of 5 frames of each case: a trial run"
    )
    parser.add_argument(
        "--processes", type=int, metavar="N", help="at a time (the computer's cores, at most 4)"
    )
    add_peers_option(parser)
    add_stress_options(parser)
    add_ablation_options(parser)
    add_options(parser)
    parser.add_argument("--out", metavar="DIR", required=True, help="folder for the results")
    parser.add_argument("--json", metavar="FILE", help="result for programs (- is stdout)")


def run(options: argparse.Namespace, diagnostics: Diagnostics) -> int:
    """Run the evaluation that the options ask for, and return the exit code."""
    kind = find_kind(options)
    if kind == "recording":
        return run_recording(options, diagnostics)
    if kind == "stress":
        return run_stress(options, diagnostics)
    if kind == "ablation":
        return run_ablation(options, diagnostics)
    return _run_tables(options, diagnostics)


def _run_tables(options: argparse.Namespace, diagnostics: Diagnostics) -> int:
    from navapp.evaluation.paper.results import write_results

    if options.peers:
        prepare_peers()
    settings = _read_settings(options)

    def write(folder: "CampaignFolder[CaseTest]") -> dict[str, Any]:
        if options.peers:
            run_peers(folder.path, settings.tests, diagnostics)
            folder.check_code()
        return write_results(folder, settings)

    content = run_and_write(settings, write, "evaluate.json", options, diagnostics)
    if options.json != "-":
        if options.peers:
            say_peers(content["peers"], diagnostics)
        _say(content["summary"], options.out, diagnostics)
    return 0


def _read_settings(options: argparse.Namespace) -> "TableSettings":
    from navapp.evaluation.paper.cases import FIRST_SEED, MOST_TESTS
    from navapp.evaluation.paper.settings import TableSettings

    usual = Counts(_TESTS, _FRAMES, FIRST_SEED)
    counts = read_counts(options, usual, _QUICK_FRAMES, MOST_TESTS, "case")
    return TableSettings(
        choose_cases(options),
        choose_methods(options),
        counts.tests,
        counts.frames,
        counts.first_seed,
        options.quick,
    )


def _say(summary: dict[str, Any], out: str, diagnostics: Diagnostics) -> None:
    if summary["quick"]:
        diagnostics.say("a trial run, no results: one short test of each case")
    for method, one in summary["judged"].items():
        diagnostics.say(
            f"{method}: {one['ok']} of {one['frames']} frames OK, {one['wrong_and_ok']} of them "
            "wrong beyond their bound"
        )
    beside = summary["beside_the_paper"]
    if beside["cases"] and not summary["quick"]:
        diagnostics.say(
            f"bimcc beside the paper's own figures: nearer in {beside['nearer']}, faster in "
            f"{beside['faster']} of {beside['cases']} cases"
        )
    diagnostics.say(f"tables, report and all frames: {out}")
