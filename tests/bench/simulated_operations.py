"""Accuracy on simulated operations, in the paper's four situations, printed as a table.

usage: python -m tests.bench.simulated_operations [--seeds N] [--first SEED] [--frames N]
                                                  [--only SITUATION]

Each knee lies 6 to 9 degrees and 6 to 10 mm off its nominal pose, from which it is registered; from
then on it is followed. Nothing but pictures, rig, bone and nominal pose reaches the tracker. A
registration succeeds when its first answer is OK and less than 1 mm off. When it does not succeed
in the first frame it is tried again in the next; frames before it are not counted.
"""

import argparse
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from navapp.evaluation import compute_mean_tre_mm
from navapp.tracking import Goal, TrackState, make_tracker
from navapp.values import BoneModel, Side, Status, TrackedFrame
from sim_devices.scenario import Scenario
from tests.knees import SimulatedKnee

# The paper's situations: motion of the leg, and what passes in front of it.
SITUATIONS = {
    "registration": ("still", "none"),
    "overlay": ("breathing", "none"),
    "patient moves": ("patient", "none"),
    "instrument moves": ("breathing", "sweep"),
}
FIRST_SEED = 301
_GOAL = Goal(np.empty((0, 3)), 2.0)
_SUCCESS_MM = 1.0


@dataclass(frozen=True)
class Answer:
    """One frame beside the truth; NaN without a pose."""

    status: Status
    tre_mm: float
    bound_mm: float


@dataclass(frozen=True)
class Operation:
    """What a tracker did in one simulated operation."""

    is_registered_at_once: bool
    answers: list[Answer]


def main() -> None:
    """Print a line for each situation, and one for all."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--first", type=int, default=FIRST_SEED)
    parser.add_argument("--frames", type=int, default=200)
    parser.add_argument("--only", choices=tuple(SITUATIONS), default=None)
    options = parser.parse_args()
    print("| situation | registered at once | frames | OK | TRE median | 95 % | worst OK | "
          "bound median | bound holds |")  # fmt: skip
    print("|---|---|---|---|---|---|---|---|---|")
    pooled: list[Operation] = []
    for name in [options.only] if options.only else SITUATIONS:
        seeds = range(options.first, options.first + options.seeds)
        operations = [operated(seed, name, options.frames) for seed in seeds]
        pooled += operations
        print(_row(name, operations), flush=True)
    print(_row("all", pooled))


def operated(seed: int, situation: str, n_frames: int) -> Operation:
    """Register and follow one knee."""
    side: Side = "left" if seed % 2 else "right"
    motion, instrument = SITUATIONS[situation]
    knee = SimulatedKnee(Scenario(seed=seed, side=side, motion=motion, instrument=instrument))
    tracker, state = make_tracker(knee.rig, knee.bone), None
    answers: list[Answer] = []
    is_at_once = False
    for number in range(n_frames):
        frame = knee.camera.read(1.0)
        if state is None:
            tracked = tracker.register(frame, knee.prior, _GOAL)[0]
        else:
            tracked, state = tracker.track(frame, state, _GOAL)
        answer = _answer(tracked, knee.truth(frame), knee.bone)
        if state is None and tracked.verdict.status is Status.OK:
            state = TrackState.at_rest(tracked.left_from_bone, frame.captured_ns)
            is_at_once = number == 0 and answer.tre_mm < _SUCCESS_MM
        if state is not None:
            answers.append(answer)
    knee.camera.close()
    return Operation(is_at_once, answers)


def _answer(tracked: TrackedFrame, true, bone: BoneModel) -> Answer:
    if tracked.left_from_bone is None:
        return Answer(tracked.verdict.status, float("nan"), float("nan"))
    error_mm = compute_mean_tre_mm(tracked.left_from_bone, true, bone, np.empty((0, 3)))
    return Answer(tracked.verdict.status, error_mm, tracked.verdict.predicted_tre_mm)


def _row(name: str, operations: list[Operation]) -> str:
    """Errors of all frames with a pose that is not lost; the worst and the bound of OK ones."""
    answers = list(_of(operations))
    ok = [one for one in answers if one.status is Status.OK]
    posed = [one for one in answers if one.status is not Status.LOST]
    n_at_once = sum(one.is_registered_at_once for one in operations)
    head = f"| {name} | {n_at_once} of {len(operations)} | {len(answers)} | {len(ok)} |"
    if not ok:
        return f"{head} - | - | - | - | - |"
    errors = np.array([one.tre_mm for one in posed])
    of_ok = np.array([(one.tre_mm, one.bound_mm) for one in ok])
    return (
        f"{head} {np.median(errors):.3f} | {np.percentile(errors, 95):.3f} | "
        f"{of_ok[:, 0].max():.3f} | {np.median(of_ok[:, 1]):.2f} | "
        f"{100 * np.mean(of_ok[:, 0] <= of_ok[:, 1]):.1f} % |"
    )


def _of(operations: list[Operation]) -> Iterator[Answer]:
    for operation in operations:
        yield from operation.answers


if __name__ == "__main__":
    main()
