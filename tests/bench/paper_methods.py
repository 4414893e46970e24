"""The paper's two chains beside ours on recorded operations: the table of docs/measurements.md.

usage: python -m tests.bench.paper_methods [FOLDER] [--bone femur|tibia] [--only NAME]

FOLDER (default: NAVAPP_DATA) is one of `tests.bench.recorded_accuracy`. Every sequence is replayed
as it is, from its prior, with `--follow-refused`: errors are those of all poses, whatever the judge
says of them.
"""

import argparse
import os
import sys
import tempfile
from collections import Counter
from pathlib import Path

import numpy as np

from navapp.cli.main import run
from tests.bench.recorded_accuracy import find_sequences, replayed, score_frames

METHODS = ("icp", "paper", "bimcc")
_SITUATIONS = ("patient", "instrument")


def main() -> int:
    """Replay every sequence with every method, and print one line for each."""
    parser = argparse.ArgumentParser(description=__doc__)
    default = os.environ.get("NAVAPP_DATA", "../shared/data")
    parser.add_argument("folder", nargs="?", default=default)
    parser.add_argument("--bone", choices=("femur", "tibia"), default="femur")
    parser.add_argument("--only", default="", help="sequences whose name contains this")
    options = parser.parse_args()
    print(
        "| sequence | method | frames | poses | OK, DEGRADED, LOST | TRE median | TRE worst | ms |"
    )
    print("|---|---|---|---|---|---|---|---|")
    for phantom in sorted(Path(options.folder).glob("phantom_*")):
        surface = phantom / f"{options.bone}.ply"
        with tempfile.TemporaryDirectory() as plan:
            run(["--quiet", "plan", "--surface", f"{options.bone}={surface}", "--out", plan])
            for sequence in find_sequences(phantom, options.only):
                if sequence.name not in _SITUATIONS:
                    continue
                for method in METHODS:
                    words = "--method", method, "--follow-refused"
                    frames = replayed(phantom, sequence, plan, "forward", options.bone, *words)
                    scored = list(score_frames(frames, sequence, options.bone, surface))
                    errors = np.array([one.tre_mm for one in scored])
                    says = Counter(one.status for one in scored)
                    ms = np.median([one.total_ms for one in scored])
                    print(
                        f"| {phantom.name}/{sequence.name} | {method} | {len(scored)} | "
                        f"{np.isfinite(errors).sum()} | {says['OK']}, {says['DEGRADED']}, "
                        f"{says['LOST']} | {np.nanmedian(errors):.3f} mm | "
                        f"{np.nanmax(errors):.3f} mm | {ms:.0f} |",
                        flush=True,
                    )
    return 0


if __name__ == "__main__":
    sys.exit(main())
