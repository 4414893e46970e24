"""Accuracy on recorded operations with truth, printed as the tables of docs/measurements.md.

usage: python -m tests.bench.recorded_accuracy [FOLDER] [--bone femur|tibia] [--only NAME]
                                               [--order ORDER ...] [--frames]

FOLDER (default: NAVAPP_DATA) holds `phantom_*` folders with surfaces, rig.yml and sequences that
have prior.json and truth.json. Each sequence is replayed as it is, as one loop of 120 frames there
and back, and with each frame as the first; unrelated frames only one by one. With --frames every
frame has a line of its own.
"""

import argparse
import json
import os
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from navapp.cli.main import run
from navapp.evaluation import compute_mean_tre_mm
from navapp.geometry.ply import read_ply
from navapp.geometry.transform import RigidTransform, rotation_angle_deg
from navapp.values import BoneModel
from tests.recorded import read_true_poses

ORDERS = ("forward", "pingpong", "each")
# Frames of these are unrelated poses: each is registered on its own.
UNRELATED = ("registration",)
_LOOP_FRAMES = 120


@dataclass(frozen=True)
class Scored:
    """One replayed frame beside the truth; `tre_mm` and what follows are NaN without a pose."""

    index: int
    status: str
    reasons: tuple[str, ...]
    tre_mm: float
    rotation_deg: float
    bound_mm: float
    total_ms: float


def main() -> int:
    """Replay every sequence and print one line for each way."""
    options = _options()
    print("| sequence | order | frames | OK | TRE median | worst OK | rotation worst | "
          "bound median | bound holds | ms |")  # fmt: skip
    print("|---|---|---|---|---|---|---|---|---|---|")
    for phantom in sorted(Path(options.folder).glob("phantom_*")):
        surface = phantom / f"{options.bone}.ply"
        with tempfile.TemporaryDirectory() as plan:
            run(["--quiet", "plan", "--surface", f"{options.bone}={surface}", "--out", plan])
            for sequence in find_sequences(phantom, options.only):
                for order in _orders(sequence, options.order):
                    frames = replayed(phantom, sequence, plan, order, options.bone)
                    scored = list(score_frames(frames, sequence, options.bone, surface))
                    print(_row(f"{phantom.name}/{sequence.name}", order, scored), flush=True)
                    if options.frames:
                        _print_frames(scored)
    return 0


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "folder", nargs="?", default=os.environ.get("NAVAPP_DATA", "../shared/data")
    )
    parser.add_argument("--bone", choices=("femur", "tibia"), default="femur")
    parser.add_argument("--only", default="", help="sequences whose name contains this")
    parser.add_argument("--order", choices=ORDERS, nargs="+", default=list(ORDERS))
    parser.add_argument("--frames", action="store_true", help="a line for every frame as well")
    return parser.parse_args()


def find_sequences(phantom: Path, only: str) -> list[Path]:
    found = [truth.parent for truth in sorted(phantom.glob("*/truth.json"))]
    return [
        folder
        for folder in found
        if (folder / "prior.json").is_file() and only in f"{phantom.name}/{folder.name}"
    ]


def _orders(sequence: Path, asked: list[str]) -> list[str]:
    return ["each"] if sequence.name in UNRELATED else asked


def replayed(
    phantom: Path, sequence: Path, plan: str, order: str, bone: str, *words: str
) -> list[dict[str, Any]]:
    """Frames of `navapp replay` with further words, started from the sequence's prior only."""
    with tempfile.TemporaryDirectory() as folder:
        poses = f"{folder}/poses.json"
        command = [
            "--quiet", "replay", str(sequence), "--rig", str(phantom / "rig.yml"), "--plan", plan,
            "--prior", str(sequence / "prior.json"), "--order", order, "--bone", bone,
            "--json", poses, *words,
        ]  # fmt: skip
        run(command + (["--frames", str(_LOOP_FRAMES)] if order == "pingpong" else []))
        frames: list[dict[str, Any]] = json.loads(Path(poses).read_text())["frames"]
        return frames


def score_frames(
    frames: list[dict[str, Any]], sequence: Path, bone_name: str, surface: Path
) -> Iterator[Scored]:
    """Replayed frames beside the sequence's truth."""
    bone = BoneModel(bone_name, read_ply(surface)[0])
    truth = read_true_poses(sequence, bone_name)
    for frame in frames:
        tre_mm = turn_deg = float("nan")
        if frame["camera_from_model"] is not None:
            pose = RigidTransform("left", bone_name, frame["camera_from_model"])
            true = truth[frame["index"]]
            tre_mm = compute_mean_tre_mm(pose, true, bone, np.empty((0, 3)))
            turn_deg = rotation_angle_deg(pose, true)
        bound_mm = frame["predicted_tre_mm"]
        yield Scored(
            frame["index"], frame["status"], tuple(frame["reasons"]), tre_mm, turn_deg,
            float("nan") if bound_mm is None else bound_mm, frame["timing_ms"]["total"],
        )  # fmt: skip


def _row(name: str, order: str, scored: list[Scored]) -> str:
    """Errors of the frames that the judge calls OK."""
    ok = [one for one in scored if one.status == "OK"]
    head = f"| {name} | {order} | {len(scored)} | {len(ok)} |"
    if not ok:
        return f"{head} - | - | - | - | - | - |"
    errors = np.array([one.tre_mm for one in ok])
    bounds = np.array([one.bound_mm for one in ok])
    turns = np.array([one.rotation_deg for one in ok])
    ms = np.median([one.total_ms for one in scored])
    return (
        f"{head} {np.median(errors):.3f} | {errors.max():.3f} | {turns.max():.2f} | "
        f"{np.median(bounds):.2f} | {100 * np.mean(errors <= bounds):.0f} % | {ms:.0f} |"
    )


def _print_frames(scored: list[Scored]) -> None:
    for one in scored:
        print(
            f"  {one.index:3d} {one.status:8s} {one.tre_mm:7.3f} mm {one.rotation_deg:6.3f} deg "
            f"bound {one.bound_mm:5.2f} mm {one.total_ms:5.0f} ms  {'; '.join(one.reasons)}"
        )


if __name__ == "__main__":
    sys.exit(main())
