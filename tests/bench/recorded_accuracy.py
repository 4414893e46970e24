"""Accuracy on recorded operations with truth, printed as the table of docs/accuracy.md.

usage: python -m tests.bench.recorded_accuracy [FOLDER] [--method bimcc|icp]

FOLDER (default: NAVAPP_DATA) holds `phantom_*` folders with femur.ply, rig.yml and sequences that
have prior.json and truth.json.
"""

import argparse
import json
import os
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from navapp.cli.main import run
from navapp.evaluation import mean_tre_mm
from navapp.geometry.ply import read_ply
from navapp.geometry.transform import RigidTransform
from navapp.values import BoneModel

# Frames of these are unrelated poses: each is registered on its own.
_UNRELATED = ("registration",)


def main() -> int:
    """Replay every sequence and print one line for each."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "folder", nargs="?", default=os.environ.get("NAVAPP_DATA", "../shared/data")
    )
    parser.add_argument("--method", choices=("bimcc", "icp"), default="bimcc")
    options = parser.parse_args()
    print("| sequence | frames | OK | TRE median | TRE worst | bound median | bound holds | ms |")
    print("|---|---|---|---|---|---|---|---|")
    for phantom in sorted(Path(options.folder).glob("phantom_*")):
        bone = BoneModel("femur", read_ply(phantom / "femur.ply")[0])
        for truth in sorted(phantom.glob("*/truth.json")):
            if (truth.parent / "prior.json").is_file():
                frames = replayed(phantom, truth.parent, options.method)
                print(line(f"{phantom.name}/{truth.parent.name}", frames, truth, bone))
    return 0


def replayed(phantom: Path, sequence: Path, method: str) -> list[dict[str, Any]]:
    """Frames of `navapp replay`, started from the sequence's prior only."""
    with tempfile.TemporaryDirectory() as folder:
        plan, poses = f"{folder}/plan", f"{folder}/poses.json"
        run(["--quiet", "plan", "--surface", f"femur={phantom / 'femur.ply'}", "--out", plan])
        order = "each" if sequence.name in _UNRELATED else "forward"
        run([
            "--quiet", "replay", str(sequence), "--rig", str(phantom / "rig.yml"), "--plan", plan,
            "--prior", str(sequence / "prior.json"), "--order", order, "--method", method,
            "--json", poses,
        ])  # fmt: skip
        frames: list[dict[str, Any]] = json.loads(Path(poses).read_text())["frames"]
        return frames


def line(name: str, frames: list[dict[str, Any]], truth_path: Path, bone: BoneModel) -> str:
    """One row: errors of the frames that the judge calls OK."""
    truth = {
        entry["index"]: RigidTransform("left", "femur", entry["T_leftcam_from_ct"]["femur"])
        for entry in json.loads(truth_path.read_text())["frames"]
    }
    ok = [frame for frame in frames if frame["status"] == "OK"]
    head = f"| {name} | {len(frames)} | {len(ok)} |"
    if not ok:
        return f"{head} - | - | - | - | - |"
    errors = np.array([
        mean_tre_mm(
            RigidTransform("left", "femur", frame["camera_from_model"]),
            truth[frame["index"]],
            bone,
            np.empty((0, 3)),
        )
        for frame in ok
    ])  # fmt: skip
    bounds = np.array([frame["predicted_tre_mm"] for frame in ok])
    ms = np.median([frame["timing_ms"]["total"] for frame in frames])
    return (
        f"{head} {np.median(errors):.2f} | {errors.max():.2f} | {np.median(bounds):.2f} | "
        f"{100 * np.mean(errors <= bounds):.0f} % | {ms:.0f} |"
    )


if __name__ == "__main__":
    sys.exit(main())
