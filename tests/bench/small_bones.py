"""First registrations of patellas, with kernels as wide as a femur's and narrower ones.

usage: python -m tests.bench.small_bones [--knees N] [--first SEED] [--kernels SHARE ...]

Each simulated knee is registered from its rough pose in one frame, with the widest kernel as each
share of the model's radius. Prints how many are OK, how many of these are right (1 mm), how many
first answers are right whatever the judge says, and the time of a registration.
"""

import argparse
import time

import numpy as np

from navapp.config import Configuration
from navapp.config.camera_sections import CameraSection, SimulationSection
from navapp.evaluation import compute_mean_tre_mm
from navapp.evaluation.sequence import KnownSequence, render_room
from navapp.registration import model
from navapp.tracking import Goal, make_tracker
from navapp.values import Status

_RIGHT_MM = 1.0


def main() -> None:
    """Print a row a kernel, and a line for each first answer that is not right."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--knees", type=int, default=20)
    parser.add_argument("--first", type=int, default=2_100_000)
    parser.add_argument("--kernels", type=float, nargs="+", default=[2.0 / 3.0, 1.0 / 3.0])
    options = parser.parse_args()
    found: dict[float, list[tuple[Status, float | None, float]]] = {}
    for seed in range(options.first, options.first + options.knees):
        sequence = _render(seed)
        for share in options.kernels:
            model._KERNEL_PER_RADIUS = share
            status, tre_mm, seconds = _register(sequence)
            found.setdefault(share, []).append((status, tre_mm, seconds))
            if tre_mm is None or tre_mm > _RIGHT_MM:
                told = "no pose" if tre_mm is None else f"{tre_mm:.1f} mm"
                print(
                    f"{seed}, kernel {share:.2f} of the radius: {status.value}, {told}", flush=True
                )
    print("| kernel over radius | knees | OK | OK and right | right | s median | s 90 % |")
    print("|---|---|---|---|---|---|---|")
    for share, answers in found.items():
        ok = [tre_mm for status, tre_mm, _ in answers if status is Status.OK]
        seconds = [one for _, _, one in answers]
        print(
            f"| {share:.2f} | {len(answers)} | {len(ok)} | {_count_right(ok)} | "
            f"{_count_right([tre_mm for _, tre_mm, _ in answers])} | {np.median(seconds):.1f} | "
            f"{np.percentile(seconds, 90):.1f} |"
        )


def _render(seed: int) -> KnownSequence:
    settings = SimulationSection(
        seed=seed,
        side="left" if seed % 2 else "right",
        sex="male" if seed // 2 % 2 == 0 else "female",
        age_group="young" if seed // 4 % 2 == 0 else "middle",
        stepped=True,
    )
    return render_room(Configuration(camera=CameraSection(simulated=settings)), "patella", 1)


def _register(sequence: KnownSequence) -> tuple[Status, float | None, float]:
    """Status and TRE of the first answer, and how long it took."""
    bone = sequence.plan.bones[sequence.stage.bone]
    targets_mm = sequence.plan.targets_of(sequence.stage.targets)
    tracker = make_tracker(sequence.rig, bone)
    goal = Goal(targets_mm, sequence.stage.tolerance_mm)
    begun_s = time.perf_counter()
    answer = tracker.register(sequence.frames[0], sequence.prior, goal)[0]
    seconds = time.perf_counter() - begun_s
    pose, true = answer.left_from_bone, sequence.truth[0]
    tre_mm = None
    if pose is not None and true is not None:
        tre_mm = compute_mean_tre_mm(pose, true, bone, targets_mm)
    return answer.verdict.status, tre_mm, seconds


def _count_right(errors_mm: list[float | None]) -> int:
    return sum(one is not None and one <= _RIGHT_MM for one in errors_mm)


if __name__ == "__main__":
    main()
