"""`navapp evaluate --peers`: other people's trackers on the same frames."""

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from navapp.cli.diagnostics import Diagnostics

if TYPE_CHECKING:
    from navapp.evaluation.paper.cases import CaseTest


def add_peers_option(parser: argparse.ArgumentParser) -> None:
    """Declare the option."""
    parser.add_argument(
        "--peers",
        action="store_true",
        help="other people's trackers on the same frames, too (once before: make peers)",
    )


def prepare_peers() -> None:
    """Refuse --peers where they could not be run.

    Raises:
        UsageError: what the peers need is missing.
    """
    from navapp.evaluation.peers.program import check_peers

    check_peers()


def run_peers(folder: Path, tests: "Sequence[CaseTest]", diagnostics: Diagnostics) -> None:
    """Let the peers follow what they have not followed yet.

    Args:
        folder: of the evaluation, with what our methods have made of it.
        tests: all of it.
        diagnostics: told how far it is.
    """
    from navapp.evaluation.peers.program import run_program

    n_done = 0
    diagnostics.note(f"{len(tests)} tests for the peers, one at a time")

    def tell(name: str) -> None:
        nonlocal n_done
        n_done += 1
        diagnostics.progress("peers", n_done / len(tests))
        diagnostics.detail(f"{n_done} of {len(tests)} by the peers: {name}")

    run_program(folder, tell)


def say_peers(rows: Sequence[dict[str, Any]], diagnostics: Diagnostics) -> None:
    """A line for each tracker: the share of all frames that is within 1 mm."""
    for name in dict.fromkeys(row["tracker"] for row in rows):
        own = [row for row in rows if row["tracker"] == name]
        n_frames = sum(row["n_frames"] for row in own)
        n_within = sum(row["n_within"] for row in own)
        diagnostics.say(f"{name}: {n_within} of {n_frames} frames within 1 mm")
