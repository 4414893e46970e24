"""What 3,000 registered points cost the paper's chains, against 20,000: errors side by side.

usage: python -m tests.bench.paper_points [FOLDER]

FOLDER (default: NAVAPP_DATA) is one of `tests.bench.recorded_accuracy`. The femur is registered
from each sequence's prior and followed, refused or not, as `navapp replay --follow-refused` does;
and found in each frame from its true pose, where no chain has lost it in frames before. Errors are
those of all poses.
"""

import argparse
import json
import os
import sys
import tempfile
from pathlib import Path

import numpy as np

from navapp.cli.main import run
from navapp.control.prior_files import read_prior
from navapp.evaluation import compute_mean_tre_mm
from navapp.geometry.rig_files import read_rig
from navapp.geometry.transform import RigidTransform
from navapp.preop import read_plan
from navapp.registration.verdict import Goal
from navapp.tracking import TrackState
from navapp.tracking.icp_tracker import N_POINTS, IcpTracker
from navapp.tracking.paper_tracker import PaperTracker
from navapp.tracking.tracker import TrackerSettings
from navapp.values import Plan
from tests.pictures import Pictures

_MANY = 20_000
_BONE, _SITUATIONS = "femur", ("patient", "instrument")
_PERIOD_NS = 66_000_000


def main() -> int:
    """Print one line for each chain."""
    parser = argparse.ArgumentParser(description=__doc__)
    default = os.environ.get("NAVAPP_DATA", "../shared/data")
    parser.add_argument("folder", nargs="?", default=default)
    phantoms = sorted(Path(parser.parse_args().folder).glob("phantom_*"))
    print(f"| chain | begun | frames | TRE median, {N_POINTS} points | {_MANY} points | ratio |")
    print("|---|---|---|---|---|---|")
    for kind in (PaperTracker, IcpTracker):
        for begun in ("followed", "at the truth"):
            few, many = (
                find_all(kind, phantoms, n, is_followed=begun == "followed")
                for n in (N_POINTS, _MANY)
            )
            print(
                f"| {kind.__name__} | {begun} | {len(few)} | {np.median(few):.3f} mm | "
                f"{np.median(many):.3f} mm | {np.median(few) / np.median(many):.2f} |",
                flush=True,
            )
    return 0


def find_all(
    kind: type[IcpTracker], phantoms: list[Path], n_points: int, *, is_followed: bool
) -> list[float]:
    """TRE of every frame, mm."""
    errors: list[float] = []
    for phantom in phantoms:
        surface = phantom / f"{_BONE}.ply"
        with tempfile.TemporaryDirectory() as folder:
            run(["--quiet", "plan", "--surface", f"{_BONE}={surface}", "--out", folder])
            plan = read_plan(folder)
        for situation in _SITUATIONS:
            errors += find(kind, phantom / situation, plan, n_points, is_followed=is_followed)
    return errors


def find(
    kind: type[IcpTracker], sequence: Path, plan: Plan, n_points: int, *, is_followed: bool
) -> list[float]:
    """TRE of every frame of a sequence, mm."""
    import cv2

    bone, rig = plan.bones[_BONE], read_rig(sequence.parent / "rig.yml")
    settings = TrackerSettings(follows_refused=True)
    tracker = kind(rig, bone, settings, plan.aspects.get(_BONE), n_points)
    prior, goal = read_prior(sequence / "prior.json"), Goal(np.empty((0, 3)), 1.0)
    state, errors = None, []
    for number, entry in enumerate(json.loads((sequence / "truth.json").read_text())["frames"]):
        left, right = (
            cv2.imread(str(sequence / f"{eye}_{entry['index']:04d}.jpg"))
            for eye in ("left", "right")
        )
        pictures = Pictures(left, right, number * _PERIOD_NS)
        true = RigidTransform("left", _BONE, entry["T_leftcam_from_ct"][_BONE])
        if not is_followed:
            state = TrackState.at_rest(true, pictures.captured_ns)
        elif state is None:
            (found,) = tracker.register(pictures, prior, goal)
            assert found.left_from_bone is not None, "nothing was measured"
            state = TrackState.at_rest(found.left_from_bone, 0)
        tracked, state = tracker.track(pictures, state, goal)
        pose = tracked.left_from_bone
        assert pose is not None, "nothing was measured"
        errors.append(compute_mean_tre_mm(pose, true, bone, np.empty((0, 3))))
    return errors


if __name__ == "__main__":
    sys.exit(main())
