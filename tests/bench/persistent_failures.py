"""Simulated operations with a plan or a camera that is wrong for good: no frame may be OK.

usage: python -m tests.bench.persistent_failures [--seeds N] [--frames N] [--only NAME]

The plan's femur is that of another person, of the other side, or of another size; or left and right
are swapped. Each is registered, and followed from what came out of it however bad that is; once
more registered and followed from the true pose, where a wrong plan fits best. 2 % of size is what a
segmentation may be off by: those rows are there to be seen.
"""

import argparse
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from navapp.evaluation import compute_mean_tre_mm
from navapp.geometry.mesh import TriangleMesh
from navapp.tracking import TrackState, make_tracker
from navapp.values import BoneModel, Prior, Status, TrackedFrame
from sim_devices.anatomy import KneeSpec, make_knee
from sim_devices.scenario import Scenario
from sim_devices.sensor import SensorModel
from sim_devices.world import World
from tests.bench.provoked import GOAL
from tests.bench.wrong_bones import OTHER_SIDE, move_onto, stretch_bone
from tests.knees import femur_of, stepped_camera

# Not the seeds of any test or default, nor of the other benches.
FIRST_SEED = 161
# So many are rendered; the leg goes there and back, with other noise each time.
_RENDERED = 20
_RATE_HZ = 15.0


@dataclass(frozen=True)
class Room:
    """A knee whose pictures are rendered once, and the right plan of it."""

    world: World
    bone: BoneModel

    @classmethod
    def of(cls, seed: int) -> "Room":
        """The knee of a seed, moving."""
        side = "left" if seed % 2 else "right"
        world = World(Scenario(seed=seed, side=side, motion="patient"))
        return cls(world, femur_of(world))


class Loop:
    """A world that goes there and back in time, its pictures remembered."""

    def __init__(self, world: World) -> None:
        self.rig = world.rig
        self.world = world
        self._rendered: dict[tuple[str, int], np.ndarray] = {}

    def world_ns(self, time_ns: int) -> int:
        """Moment of the world that is shown at a time."""
        number = round(time_ns * 1e-9 * _RATE_HZ) % (2 * _RENDERED - 2)
        return round(min(number, 2 * _RENDERED - 2 - number) * 1e9 / _RATE_HZ)

    def render(self, eye: str, time_ns: int, *how: Any) -> np.ndarray:
        """As the world's."""
        key = (eye, self.world_ns(time_ns))
        if key not in self._rendered:
            self._rendered[key] = self.world.render(eye, key[1], *how)
        return self._rendered[key]


def _right(room: Room) -> BoneModel:
    return room.bone


def _other_person(room: Room) -> BoneModel:
    scenario = room.world.scenario
    other = make_knee(KneeSpec(scenario.seed + 1000, scenario.side, scenario.sex, "middle"))
    return _moved_onto(room.bone, other.bones["femur"])


def _other_side(room: Room) -> BoneModel:
    return stretch_bone(room.bone, OTHER_SIDE)


def _tibia(room: Room) -> BoneModel:
    return _moved_onto(room.bone, room.world.anatomy.bones["tibia"])


def _sized(size: float) -> Callable[[Room], BoneModel]:
    return lambda room: stretch_bone(room.bone, size)


def _moved_onto(own: BoneModel, other: TriangleMesh) -> BoneModel:
    return BoneModel("femur", move_onto(other, own.mesh), own.side)


PLANS: dict[str, Callable[[Room], BoneModel]] = {
    "right plan": _right,
    "left and right swapped": _right,
    "another person": _other_person,
    "other side": _other_side,
    "tibia for femur": _tibia,
    "size x 0.95": _sized(0.95),
    "size x 0.98": _sized(0.98),
    "size x 1.02": _sized(1.02),
    "size x 1.05": _sized(1.05),
}


def followed(
    loop: Loop, bone: BoneModel, n_frames: int, *, is_swapped: bool, from_truth: bool
) -> Iterator[tuple[TrackedFrame, float]]:
    """Answers, and how far they are off."""
    world = loop.world
    camera = stepped_camera(loop, SensorModel(seed=world.scenario.seed), _RATE_HZ)
    tracker, own = make_tracker(world.rig, bone), femur_of(world)
    state: TrackState | None = None
    for _ in range(n_frames):
        frame = camera.read(1.0)
        if is_swapped:
            frame = replace(frame, left=frame.right, right=frame.left)
        truth = world.left_from_body(
            "femur", loop.world_ns(camera.world_time_ns(frame.captured_ns))
        )
        if state is None:
            start = truth if from_truth else world.nominal_left_from_femur
            tracked = tracker.register(frame, Prior({"femur": start}), GOAL)[0]
            found = None if from_truth else tracked.left_from_bone
            state = TrackState.at_rest(found or start, frame.captured_ns, tracked.verdict.cause)
        else:
            tracked, state = tracker.track(frame, state, GOAL)
        pose = tracked.left_from_bone
        yield (
            tracked,
            np.nan if pose is None else compute_mean_tre_mm(pose, truth, own, np.empty((0, 3))),
        )


def main() -> int:
    """Print a row a wrong plan, seed and start."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=2)
    parser.add_argument("--frames", type=int, default=200)
    parser.add_argument("--only", default="", help="plans whose name contains this")
    options = parser.parse_args()
    print("| plan | seed | from | frames | OK | worst OK | DEGRADED | LOST | reasons |")
    print("|---|" + "---|" * 8)
    for seed in range(FIRST_SEED, FIRST_SEED + options.seeds):
        room = Room.of(seed)
        loop = Loop(room.world)
        for name, make in PLANS.items():
            if options.only not in name:
                continue
            for from_truth in (False, True):
                answers = list(
                    followed(
                        loop, make(room), options.frames,
                        is_swapped="swapped" in name, from_truth=from_truth,
                    )
                )  # fmt: skip
                start = "truth" if from_truth else "register"
                print(f"| {name} | {seed} | {start} | {_figures(answers)} |", flush=True)
    return 0


def _figures(answers: list[tuple[TrackedFrame, float]]) -> str:
    verdicts = [tracked.verdict for tracked, _ in answers]
    counts = Counter(verdict.status for verdict in verdicts)
    reasons = Counter(verdict.reasons[0].value for verdict in verdicts if verdict.reasons)
    said = ", ".join(f"{reason} ({n})" for reason, n in reasons.most_common(3))
    worst_mm = max(
        (tre_mm for tracked, tre_mm in answers if tracked.verdict.status is Status.OK),
        default=np.nan,
    )
    return (
        f"{len(answers)} | {counts[Status.OK]} | {worst_mm:.2f} mm | {counts[Status.DEGRADED]} | "
        f"{counts[Status.LOST]} | {said or '-'}"
    )


if __name__ == "__main__":
    sys.exit(main())
