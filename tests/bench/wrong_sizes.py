"""Simulated bones whose plan has another size: what is called OK, and how far off that is.

usage: python -m tests.bench.wrong_sizes [--stage STAGE] [--knees N] [--frames N] [--first SEED]
                                          [--highlights X] [--sizes S ...] [--frame-rows]

Each frame is followed from the true pose. Targets grow with the plan, as they would in pictures of
a scanner that is off by so much; the error is their distance from where they are in the bone.
`--highlights 0` makes the bones matt. The seeds are those of all choices (tests.bench.bounds).
"""

import argparse
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from navapp.control.stages import stage_by_name
from navapp.evaluation.sequence import KnownSequence
from navapp.registration.verdict import Goal
from navapp.resection.cut_bone import CutBone
from navapp.tracking import TrackState
from navapp.tracking.bimcc_tracker import BimccTracker
from navapp.values import BoneModel, Status, TrackedFrame
from tests.bench.bounds import FIRST_SEED, render_knee
from tests.bench.wrong_bones import stretch_bone, stretch_points

_SIZES = (0.97, 0.98, 0.985, 0.99, 1.0, 1.01, 1.015, 1.02, 1.03)


@dataclass(frozen=True, slots=True)
class SizedFrame:
    """An answer, and how far it is off at the targets."""

    tracked: TrackedFrame
    error_mm: float  # NaN without a pose

    @property
    def is_ok(self) -> bool:
        """Whether it would be shown."""
        return self.tracked.verdict.status is Status.OK

    @property
    def bound_mm(self) -> float:
        """NaN without one."""
        bound_mm = self.tracked.verdict.predicted_tre_mm
        return float("nan") if bound_mm is None else bound_mm


def main() -> None:
    """Print a row for each size."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--stage", default="patella")
    parser.add_argument("--knees", type=int, default=6)
    parser.add_argument("--frames", type=int, default=3)
    parser.add_argument("--first", type=int, default=FIRST_SEED)
    parser.add_argument("--highlights", type=float, default=1.0, help="times the usual area")
    parser.add_argument("--sizes", type=float, nargs="+", default=_SIZES)
    parser.add_argument("--frame-rows", action="store_true", help="a line for each frame as well")
    options = parser.parse_args()
    stage = stage_by_name(options.stage).name
    sequences = [
        render_knee(stage, "overlay", number, options.first, options.frames, options.highlights)
        for number in range(options.knees)
    ]
    print("| size | frames | OK | worst OK mm | beyond the bound | error over bound | reason |")
    print("|---|---|---|---|---|---|---|")
    for size in options.sizes:
        frames = []
        for number, sequence in enumerate(sequences):
            for frame in track_sized(sequence, size):
                frames.append(frame)
                if options.frame_rows:
                    print(_line(size, options.first + number, frame), flush=True)
        print(_row(size, frames), flush=True)


def find_bone_as_made(sequence: KnownSequence) -> BoneModel:
    """The stage's bone with the cuts and holes that are made before it."""
    name, steps = sequence.stage.bone, sequence.plan.content.steps
    made = {one: steps[one] for one in sequence.made_steps if steps[one].bone == name}
    return CutBone(sequence.plan.bones[name], made).model


def track_sized(sequence: KnownSequence, size: float) -> Iterator[SizedFrame]:
    """Frames of a sequence, each followed from the true pose with a model of another size."""
    stage = sequence.stage
    targets_mm = sequence.plan.targets_of(stage.targets)
    own = find_bone_as_made(sequence)
    bone, sized_mm = stretch_bone(own, size), stretch_points(targets_mm, own.mesh, size)
    tracker = BimccTracker(sequence.rig, bone)
    goal = Goal(sized_mm, stage.tolerance_mm)
    for frame, true in zip(sequence.frames, sequence.truth, strict=True):
        if true is None:
            raise AssertionError("simulated frames have a truth")
        state = TrackState.at_rest(true, frame.captured_ns)
        tracked, _ = tracker.track(frame, state, goal)
        pose = tracked.left_from_bone
        error_mm = float("nan")
        if pose is not None:
            off_mm = np.linalg.norm(pose.apply(sized_mm) - true.apply(targets_mm), axis=1)
            error_mm = float(off_mm.mean())
        yield SizedFrame(tracked, error_mm)


def _line(size: float, seed: int, frame: SizedFrame) -> str:
    verdict = frame.tracked.verdict
    said = ", ".join(one.value for one in verdict.reasons) or "-"
    rms = (verdict.rms_mm or np.nan) / (verdict.expected_rms_mm or np.nan)
    return (
        f"  {size:g} seed {seed}: {verdict.status.value} {frame.error_mm:.2f} mm, bound "
        f"{frame.bound_mm:.2f}, spread {verdict.spread_ratio:.2f}, rms {rms:.2f}, "
        f"matte {frame.tracked.is_matte}, {said}"
    )


def _row(size: float, frames: list[SizedFrame]) -> str:
    ok = [one for one in frames if one.is_ok]
    reasons = Counter(one for frame in frames for one in frame.tracked.verdict.reasons)
    said = reasons.most_common(1)[0][0].value if reasons else "-"
    if not ok:
        return f"| {size:g} | {len(frames)} | 0 | | | | {said} |"
    errors = np.array([one.error_mm for one in ok])
    over = errors / np.array([one.bound_mm for one in ok])
    return (
        f"| {size:g} | {len(frames)} | {len(ok)} | {errors.max():.2f} | {np.sum(over > 1)} | "
        f"{over.max():.1f} | {said} |"
    )


if __name__ == "__main__":
    main()
