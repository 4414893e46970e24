"""The check on the patient: how often a wrong registration is found, and a right one passes.

usage: python -m tests.bench.patient_check [--trials N] [--seed N] [--pointer-mm S] [--tip-mm S]

Simulated knees, another one for every ten trials. The pointer's tip is off by S along each axis
(0.3 mm) in every touch, and by another error in all touches of a trial alike (0.05 mm). It touches
within 8 mm of where the check asks for, on what faces the cameras, until the check decides; or
landmark after landmark. The bone lies off its registered model by 1.5 mm (mean
over the targets): shifted, turned about the shaft, or with landmarks that are shifted against the
surface; or it is 2 % larger or smaller than its model.
"""

import argparse
import sys
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.tools.patient_check import (
    CheckAnswer,
    CheckResult,
    Touched,
    find_next_place,
    judge_touches,
)
from navapp.tools.surface_distance import SurfaceDistance
from sim_devices.scenario import Scenario
from sim_devices.world import World

# Not the seeds of any test or default, nor of the other benches.
FIRST_SEED = 7501
_LIMIT_MM, _OFF_MM, _SIZE = 1.0, 1.5, 0.02
_TRIALS_PER_KNEE, _HAND_MM, _LEAST_FACING = 10, 8.0, 0.35


@dataclass(frozen=True, eq=False)
class Knee:
    """A femur, what of it can be touched, and the points that matter."""

    surface: SurfaceDistance
    places_mm: FloatArray  # (N, 3) in sight
    normals: FloatArray  # (N, 3)
    targets_mm: FloatArray  # (M, 3) landmarks, which are the targets


@dataclass(frozen=True)
class Pointer:
    """Its errors, standard deviations along each axis."""

    each_mm: float  # of every touch on its own
    tip_mm: float  # of all touches of a trial alike


@dataclass(frozen=True, eq=False)
class Error:
    """How the bone really lies against its registered model."""

    motion: RigidTransform
    size: float = 1.0
    landmarks_mm: FloatArray | None = None  # (3,) shift of the landmarks against the surface

    def place(self, point_mm: FloatArray, middle_mm: FloatArray) -> FloatArray:
        """Where a point of the model really is."""
        grown = middle_mm + self.size * (point_mm - middle_mm)
        moved: FloatArray = self.motion.apply(grown)
        return moved


def main() -> int:
    """Print a row a kind of error."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--trials", type=int, default=100)
    parser.add_argument("--seed", type=int, default=FIRST_SEED)
    parser.add_argument("--pointer-mm", type=float, default=0.3)
    parser.add_argument("--tip-mm", type=float, default=0.05)
    options = parser.parse_args()
    pointer = Pointer(options.pointer_mm, options.tip_mm)
    print("| the registration is | by | passed | failed | cannot tell | points median | 95 % |")
    print("|---|---|---|---|---|---|---|")
    for name, (way, make) in KINDS.items():
        rng = np.random.default_rng([options.seed, len(name)])
        answers: Counter[CheckAnswer] = Counter()
        counts: list[int] = []
        for number in range(options.trials):
            knee = make_knee(options.seed + number // _TRIALS_PER_KNEE)
            result, n = way(knee, make(knee, rng), pointer, rng)
            answers[result.answer] += 1
            counts.append(n)
        touched = "landmarks" if way is touch_landmarks else "surface"
        print(
            f"| {name} | {touched} | {answers[CheckAnswer.PASSED]} | "
            f"{answers[CheckAnswer.FAILED]} | {answers[CheckAnswer.CANNOT_TELL]} | "
            f"{np.median(counts):.0f} | {np.percentile(counts, 95):.0f} |",
            flush=True,
        )
    return 0


@lru_cache(maxsize=12)
def make_knee(seed: int) -> Knee:
    """Of a seed, as it is seen at the beginning."""
    world = World(Scenario(seed=seed, side="left" if seed % 2 else "right", motion="still"))
    bone, pose = world.anatomy.bones["femur"], world.left_from_body("femur", 0)
    in_left = pose.apply(bone.vertices_mm)
    facing = -np.einsum("nj,nj->n", pose.rotate(bone.normals), in_left)
    is_seen = facing > _LEAST_FACING * np.linalg.norm(in_left, axis=1)
    pixels = np.rint(world.rig.left.project(in_left)).astype(int)
    size = (world.rig.width, world.rig.height)
    is_seen &= ((pixels >= 0) & (pixels < size)).all(axis=1)
    column, row = np.clip(pixels, 0, np.array(size) - 1).T
    depth_mm = world.depth("left", 0).depth_mm[row, column]
    is_seen &= np.abs(depth_mm - in_left[:, 2]) < 0.5
    targets = [
        point
        for name, point in world.anatomy.landmarks.items()
        if name.startswith("femur/")
        and np.linalg.norm(bone.vertices_mm - point, axis=1).min() < 5.0
    ]
    return Knee(
        SurfaceDistance(bone), bone.vertices_mm[is_seen], bone.normals[is_seen], np.array(targets)
    )


def touch_surface(
    knee: Knee, error: Error, pointer: Pointer, rng: np.random.Generator
) -> tuple[CheckResult, int]:
    """Touch near where the check asks, until it decides; the answer, and how many points."""
    middle, touches = knee.targets_mm.mean(axis=0), list[Touched]()
    tip_off = pointer.tip_mm * rng.standard_normal(3)
    wanted = int(rng.integers(len(knee.places_mm)))
    while True:
        away_mm = np.linalg.norm(knee.places_mm - knee.places_mm[wanted], axis=1)
        place = knee.places_mm[rng.choice(np.flatnonzero(away_mm < _HAND_MM))]
        tip = error.place(place, middle) + tip_off + pointer.each_mm * rng.standard_normal(3)
        distance_mm, foot, normal = knee.surface.find(tip)
        touches.append(Touched(foot, normal[None], np.array([distance_mm]), pointer.each_mm))
        result = judge_touches(touches, knee.targets_mm, _LIMIT_MM, pointer.tip_mm)
        if result.answer is not CheckAnswer.OPEN:
            return result, len(touches)
        wanted = find_next_place(
            touches, knee.targets_mm, knee.places_mm, knee.normals, pointer.each_mm
        )


def touch_landmarks(
    knee: Knee, error: Error, pointer: Pointer, rng: np.random.Generator
) -> tuple[CheckResult, int]:
    """Touch landmark after landmark, again and again, until the check decides."""
    middle, touches = knee.targets_mm.mean(axis=0), list[Touched]()
    tip_off = pointer.tip_mm * rng.standard_normal(3)
    shift = np.zeros(3) if error.landmarks_mm is None else error.landmarks_mm
    while True:
        for k in rng.permutation(len(knee.targets_mm)):
            point = knee.targets_mm[k]
            tip = error.place(point, middle) + shift + tip_off
            tip = tip + pointer.each_mm * rng.standard_normal(3)
            touches.append(Touched(point, np.eye(3), tip - point, pointer.each_mm))
            result = judge_touches(touches, knee.targets_mm, _LIMIT_MM, pointer.tip_mm)
            if result.answer is not CheckAnswer.OPEN:
                return result, len(touches)


def _still() -> RigidTransform:
    return RigidTransform.from_parts("femur", "femur", np.eye(3), np.zeros(3))


def _right(knee: Knee, rng: np.random.Generator) -> Error:
    return Error(_still())


def _shifted(knee: Knee, rng: np.random.Generator) -> Error:
    return Error(RigidTransform.from_parts("femur", "femur", np.eye(3), _any(rng)))


def _turned(knee: Knee, rng: np.random.Generator) -> Error:
    """About the shaft, which runs along z."""
    middle = knee.targets_mm.mean(axis=0)
    lever_mm = np.linalg.norm((knee.targets_mm - middle)[:, :2], axis=1).mean()
    turn = np.array([0.0, 0.0, rng.choice([-1.0, 1.0]) * _OFF_MM / lever_mm])
    return Error(_still().move(np.concatenate([np.zeros(3), turn]), middle))


def _landmarks(knee: Knee, rng: np.random.Generator) -> Error:
    return Error(_still(), landmarks_mm=_any(rng))


def _sized(knee: Knee, rng: np.random.Generator) -> Error:
    return Error(_still(), size=1.0 + rng.choice([-_SIZE, _SIZE]))


def _any(rng: np.random.Generator) -> NDArray[np.float64]:
    direction = rng.standard_normal(3)
    return _OFF_MM * direction / np.linalg.norm(direction)


KINDS: dict[
    str,
    tuple[
        Callable[[Knee, Error, Pointer, np.random.Generator], tuple[CheckResult, int]],
        Callable[[Knee, np.random.Generator], Error],
    ],
] = {
    "right": (touch_surface, _right),
    "shifted": (touch_surface, _shifted),
    "turned about the shaft": (touch_surface, _turned),
    "right, by landmarks": (touch_landmarks, _right),
    "its landmarks shifted": (touch_landmarks, _landmarks),
    "2 % off in size": (touch_surface, _sized),
}


if __name__ == "__main__":
    sys.exit(main())
