"""Simulated tibias, half buried in tissue, registered from a rough pose (docs/measurements.md).

usage: python -m tests.bench.buried_bone [--seeds N] [--first SEED]

One frame a knee; the start is 9 mm and 8 degrees off, anywhere. The truth starts and scores.
"""

import argparse
import time

import numpy as np

from navapp.evaluation import compute_mean_tre_mm
from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.transform import RigidTransform
from navapp.tracking import Goal, Tracker, make_tracker
from navapp.values import BoneModel, Prior, Status
from sim_devices.scenario import Scenario
from sim_devices.world import World
from tests.knees import SimulatedKnee

_GOAL = Goal(np.empty((0, 3)), 2.0)
_OFF_MM, _OFF_DEG = 9.0, 8.0


def main() -> int:
    """Print a row a knee."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=12)
    parser.add_argument("--first", type=int, default=961)
    options = parser.parse_args()
    print("| seed | status | TRE | bound | s | reasons |")
    print("|---|---|---|---|---|---|")
    n_ok, worst_mm, n_held = 0, 0.0, 0
    for seed in range(options.first, options.first + options.seeds):
        side = "left" if seed % 2 else "right"
        knee = SimulatedKnee(World(Scenario(seed=seed, side=side, motion="patient")))
        mesh = knee.world.anatomy.bones["tibia"]
        bone = BoneModel("tibia", TriangleMesh(mesh.vertices_mm, mesh.faces), side)
        frame, tracker = knee.frames(1)[0], make_tracker(knee.rig, bone)
        true = knee.oracle.left_from_body("tibia", frame.captured_ns)
        started = time.perf_counter()
        prior = Prior({"tibia": off(true, tracker, seed)})
        tracked = tracker.register(frame, prior, _GOAL)[0]
        took_s = time.perf_counter() - started
        pose, verdict = tracked.left_from_bone, tracked.verdict
        error = "-"
        if pose is not None:
            error_mm = compute_mean_tre_mm(pose, true, bone, np.empty((0, 3)))
            error = f"{error_mm:.3f} mm"
            if verdict.status is Status.OK:
                n_ok, worst_mm = n_ok + 1, max(worst_mm, error_mm)
                n_held += error_mm <= (verdict.predicted_tre_mm or 0.0)
        bound = verdict.predicted_tre_mm
        told = "-" if bound is None else f"{bound:.2f} mm"
        reasons = ", ".join(reason.value for reason in verdict.reasons) or "-"
        print(f"| {seed} | {verdict.status.name} | {error} | {told} | {took_s:.1f} | {reasons} |",
              flush=True)  # fmt: skip
    print(f"\n{n_ok} of {options.seeds} OK, worst {worst_mm:.3f} mm, {n_held} within their bound")
    return 0


def off(true: RigidTransform, tracker: Tracker, seed: int) -> RigidTransform:
    """A rough pose."""
    rng = np.random.default_rng([seed, 9])
    axis, shift = (one / np.linalg.norm(one) for one in rng.normal(size=(2, 3)))
    twist = np.concatenate([_OFF_MM * shift, np.radians(_OFF_DEG) * axis])
    return true.move(twist, true.apply(tracker.model.centre_mm))


if __name__ == "__main__":
    raise SystemExit(main())
