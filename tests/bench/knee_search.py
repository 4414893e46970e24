"""The settings of the search for a tibia from its femur, varied on knees (docs/how/limb.md).

usage: python -m tests.bench.knee_search [--seeds N] [--first SEED] [--only TEXT]

One frame a knee, the femur at its true pose; one setting at a time differs from what is in force.
"""

import argparse
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any
from unittest.mock import patch

import numpy as np

from drivers.frames import StereoFrame
from navapp.evaluation import compute_mean_tre_mm
from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.transform import RigidTransform
from navapp.joint import KneeSearch, OccludedTracker
from navapp.limb import Hinge
from navapp.tracking import Goal, make_tracker
from navapp.tracking.bimcc_tracker import BimccTracker
from navapp.values import BoneModel, Status
from sim_devices.scenario import Scenario
from tests.knees import SimulatedKnee

_GOAL = Goal(np.empty((0, 3)), 2.0)
# Name, module, and the module's constants.
_VARIATIONS: tuple[tuple[str, str, dict[str, Any]], ...] = (
    ("in force", "navapp.limb.flexion", {}),
    ("play at most 6 mm, 6 deg", "navapp.limb.flexion",
     {"_MOST_PLAY_MM": 6.0, "_MOST_PLAY_DEG": 6.0}),
    ("play at most 15 mm, 15 deg", "navapp.limb.flexion",
     {"_MOST_PLAY_MM": 15.0, "_MOST_PLAY_DEG": 15.0}),
    ("play of any size", "navapp.limb.flexion",
     {"_MOST_PLAY_MM": 1e3, "_MOST_PLAY_DEG": 179.0}),
    ("no rim", "navapp.joint.occluded_tracker", {"_RIM_PX": 0}),
    ("rim of 8 px", "navapp.joint.occluded_tracker", {"_RIM_PX": 8}),
    ("3 places", "navapp.joint.knee_search", {"_N_PLACES": 3}),
    ("20 places", "navapp.joint.knee_search", {"_N_PLACES": 20}),
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class Knee:
    """A frame of a simulated knee, and the truth."""

    frame: StereoFrame
    tracker: BimccTracker
    femur: TriangleMesh
    true: dict[str, RigidTransform]


def main() -> int:
    """Print a row a variation."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=12)
    parser.add_argument("--first", type=int, default=1501)
    parser.add_argument("--only", default="", help="variations whose name contains this")
    options = parser.parse_args()
    knees = [_make_knee(options.first + k) for k in range(options.seeds)]
    print("| setting | knees | found (1 mm) | OK | worst OK | bound holds | s |")
    print("|---|---|---|---|---|---|---|")
    for name, module, constants in _VARIATIONS:
        if options.only in name:
            with _in_force(module, constants):
                print(_row(name, [_search(knee) for knee in knees]), flush=True)
    return 0


def _make_knee(seed: int) -> Knee:
    side = "left" if seed % 2 else "right"
    knee = SimulatedKnee(Scenario(seed=seed, side=side, motion="patient"))
    meshes = {
        name: TriangleMesh(mesh.vertices_mm, mesh.faces)
        for name, mesh in knee.world.anatomy.bones.items()
    }
    frame = knee.frames(8)[-1]
    true = {
        name: knee.oracle.left_from_body(name, frame.captured_ns) for name in ("femur", "tibia")
    }
    tracker = make_tracker(knee.rig, BoneModel("tibia", meshes["tibia"], side))
    assert isinstance(tracker, BimccTracker)
    return Knee(frame, tracker, meshes["femur"], true)


@contextmanager
def _in_force(module: str, constants: dict[str, Any]) -> Iterator[None]:
    if not constants:
        yield
        return
    with patch.multiple(module, **constants):
        yield


def _search(knee: Knee) -> tuple[bool, float, float, float]:
    """Whether it is OK, its error, its bound, and the time in s."""
    hidden = OccludedTracker(knee.tracker, knee.femur, knee.true["femur"])
    search = KneeSearch(Hinge.of(knee.femur))
    tracked = search.find(hidden, knee.frame, knee.true["femur"], _GOAL).tracked
    pose, bound_mm = tracked.left_from_bone, tracked.verdict.predicted_tre_mm
    took_s = tracked.timings.total_ms / 1e3
    if pose is None or bound_mm is None:
        return False, np.inf, np.nan, took_s
    bone = knee.tracker.model.bone
    error_mm = compute_mean_tre_mm(pose, knee.true["tibia"], bone, _GOAL.targets_mm)
    return tracked.verdict.status is Status.OK, error_mm, bound_mm, took_s


def _row(name: str, found: list[tuple[bool, float, float, float]]) -> str:
    is_ok, error_mm, bound_mm, took_s = (np.array(one) for one in zip(*found, strict=True))
    head = f"| {name} | {len(found)} | {np.count_nonzero(error_mm < 1.0)} | "
    if not is_ok.any():
        return f"{head}0 | - | - | {np.median(took_s):.1f} |"
    return (
        f"{head}{np.count_nonzero(is_ok)} | {error_mm[is_ok].max():.3f} mm | "
        f"{np.count_nonzero(error_mm[is_ok] <= bound_mm[is_ok])} of {np.count_nonzero(is_ok)} | "
        f"{np.median(took_s):.1f} |"
    )


if __name__ == "__main__":
    raise SystemExit(main())
