"""What the points that the paper's chains register cost, against 20,000: errors side by side.

usage: python -m tests.bench.paper_points [FOLDER] [--knees N]

FOLDER (default: NAVAPP_DATA) is one of `tests.bench.recorded_accuracy`; simulated knees, whose
patient moves, are added. The femur is registered from each sequence's rough pose and followed,
refused or not, as `navapp replay --follow-refused` does; and found in each frame from its true
pose, where no chain has lost it in frames before. Errors are those of all poses.
"""

import argparse
import os
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from navapp.cli.main import run
from navapp.control.prior_files import read_prior
from navapp.evaluation import compute_mean_tre_mm
from navapp.geometry.rig import StereoRig
from navapp.geometry.rig_files import read_rig
from navapp.geometry.transform import RigidTransform
from navapp.preop import read_plan
from navapp.registration.verdict import Goal
from navapp.tracking import TrackState
from navapp.tracking.icp_tracker import N_POINTS, IcpTracker
from navapp.tracking.paper_tracker import PaperTracker
from navapp.tracking.tracker import TrackerSettings
from navapp.values import AspectGraph, BoneModel, Prior, StereoPictures
from sim_devices.scenario import Scenario
from tests.knees import SimulatedKnee
from tests.pictures import Pictures
from tests.recorded import read_frames

_MANY = 20_000
_BONE, _SITUATIONS = "femur", ("patient", "instrument")
_PERIOD_NS = 66_000_000
_FIRST_SEED, _N_FRAMES = 321, 12
_GOAL = Goal(np.empty((0, 3)), 1.0)


@dataclass(frozen=True)
class Sequence:
    """Pictures of one bone, each with its true pose in the left camera."""

    rig: StereoRig
    bone: BoneModel
    aspects: AspectGraph | None
    prior: Prior
    frames: list[tuple[StereoPictures, RigidTransform]]


def main() -> int:
    """Print one line for each chain and way to begin."""
    parser = argparse.ArgumentParser(description=__doc__)
    default = os.environ.get("NAVAPP_DATA", "../shared/data")
    parser.add_argument("folder", nargs="?", default=default)
    parser.add_argument("--knees", type=int, default=20)
    options = parser.parse_args()
    sequences = list(recorded(Path(options.folder)))
    sequences += [simulated(_FIRST_SEED + k) for k in range(options.knees)]
    print(f"| chain | begun | frames | TRE median, {N_POINTS} points | {_MANY} points | ratio |")
    print("|---|---|---|---|---|---|")
    for kind in (PaperTracker, IcpTracker):
        for is_followed in (True, False):
            few, many = (
                np.concatenate([find(kind, one, n, is_followed=is_followed) for one in sequences])
                for n in (N_POINTS, _MANY)
            )
            print(
                f"| {kind.__name__} | {'followed' if is_followed else 'at the truth'} | "
                f"{len(few)} | {np.median(few):.3f} mm | {np.median(many):.3f} mm | "
                f"{np.median(few) / np.median(many):.2f} |",
                flush=True,
            )
    return 0


def recorded(folder: Path) -> Iterator[Sequence]:
    """The phantoms' sequences."""
    for phantom in sorted(folder.glob("phantom_*")):
        with tempfile.TemporaryDirectory() as made:
            surface = phantom / f"{_BONE}.ply"
            run(["--quiet", "plan", "--surface", f"{_BONE}={surface}", "--out", made])
            plan = read_plan(made)
        for situation in _SITUATIONS:
            yield Sequence(
                read_rig(phantom / "rig.yml"), plan.bones[_BONE], plan.aspects.get(_BONE),
                read_prior(phantom / situation / "prior.json"),
                [
                    (Pictures(one.left, one.right, k * _PERIOD_NS), one.truth)
                    for k, one in enumerate(read_frames(phantom / situation, _BONE))
                ],
            )  # fmt: skip


def simulated(seed: int) -> Sequence:
    """A knee that moves."""
    knee = SimulatedKnee(
        Scenario(seed=seed, side="left" if seed % 2 else "right", motion="patient")
    )
    frames = knee.frames(_N_FRAMES)
    knee.camera.close()
    return Sequence(
        knee.rig, knee.bone, None, knee.prior, [(frame, knee.truth(frame)) for frame in frames]
    )


def find(
    kind: type[IcpTracker], sequence: Sequence, n_points: int, *, is_followed: bool
) -> list[float]:
    """TRE of every frame of a sequence, mm."""
    settings = TrackerSettings(follows_refused=True)
    tracker = kind(sequence.rig, sequence.bone, settings, sequence.aspects, n_points)
    state, errors = None, []
    for pictures, true in sequence.frames:
        if not is_followed:
            state = TrackState.at_rest(true, pictures.captured_ns)
        elif state is None:
            (found,) = tracker.register(pictures, sequence.prior, _GOAL)
            assert found.left_from_bone is not None, "nothing was measured"
            state = TrackState.at_rest(found.left_from_bone, pictures.captured_ns)
        tracked, state = tracker.track(pictures, state, _GOAL)
        assert tracked.left_from_bone is not None, "nothing was measured"
        errors.append(
            compute_mean_tre_mm(tracked.left_from_bone, true, sequence.bone, np.empty((0, 3)))
        )
    return errors


if __name__ == "__main__":
    sys.exit(main())
