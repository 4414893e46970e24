"""What fits on the model leave beyond noise, printed as the table of docs/measurements.md.

usage: python -m tests.bench.correlated_residuals [--seeds N] [--first SEED]

One frame of each of N simulated knees, femur and tibia, fitted from next to the truth: how much
residuals show of the noise that they claim, and the pose's error beside its bound, as the points
alone tell it and with what they leave. The truth only starts and scores.
"""

import argparse
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from navapp.evaluation import compute_mean_tre_mm
from navapp.geometry.mesh import TriangleMesh
from navapp.registration.verdict import Evidence, decide
from navapp.tracking.frame import NOISE_VARIANCE_RATIO, TOLERATED_VARIANCE_RATIO
from navapp.values import BoneModel, Reason
from sim_devices.scenario import Scenario
from sim_devices.sensor import SensorModel
from sim_devices.world import World
from tests.bench.tracker_parts import TrackerParts

_BONES = ("femur", "tibia")
_START_OFF_MM, _START_OFF_DEG, _STARTS = 0.5, 0.5, 3
_NO_TARGETS = np.empty((0, 3))


@dataclass(frozen=True)
class Answer:
    """One fit: the ratio that its residuals show, whether that is a misfit, its error, bounds."""

    ratio: float
    is_misfit: bool
    error_mm: float
    points_bound_mm: float
    bound_mm: float


def main() -> None:
    """Print a row for each bone."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--first", type=int, default=901)
    options = parser.parse_args()
    found: dict[str, list[Answer]] = {bone: [] for bone in _BONES}
    for seed in range(options.first, options.first + options.seeds):
        for bone in _BONES:
            found[bone] += fitted(seed, bone)
    print("| bone | fits | shown of claimed | 95 % | largest | misfits | worst of them | "
          "TRE median | worst | bound of the points | holds | bound | holds |")  # fmt: skip
    print("|---|---|---|---|---|---|---|---|---|---|---|---|---|")
    for bone, answers in found.items():
        print(_row(bone, answers))


def fitted(seed: int, name: str) -> Iterator[Answer]:
    """Fits of one bone of one knee, from starts next to the truth."""
    side = "left" if seed % 2 else "right"
    world = World(Scenario(seed=seed, side=side, motion="patient"))
    sensor, rng = SensorModel(seed=seed), np.random.default_rng([seed, 4])
    time_ns = int(rng.uniform(0.0, 6e9))
    left, right = (sensor.picture(world.render(eye, time_ns), eye, 0) for eye in ("left", "right"))
    mesh = world.anatomy.bones[name]
    bone = BoneModel(name, TriangleMesh(mesh.vertices_mm, mesh.faces), side)
    parts = TrackerParts(world.rig, bone)
    true = parts.rectify_pose(world.left_from_body(name, time_ns))
    near = parts.frame(left, right, true)
    for _ in range(_STARTS):
        off = rng.normal(0.0, np.repeat([_START_OFF_MM, np.radians(_START_OFF_DEG)], 3))
        # One pair of pictures, rectified around the truth, for every start.
        frame = replace(near, start=true.move(off, true.apply(parts.model.centre_mm)))
        fit = parts.find(frame)
        if fit is None or fit.measured.rendered is None:
            continue
        noise_variance_ratio = NOISE_VARIANCE_RATIO if parts.lies_open(frame, fit) else 1.0
        shown = parts.with_outline(frame, fit, noise_variance_ratio).with_correlated_residuals(
            noise_variance_ratio
        )
        fit = parts.with_outline(frame, fit)
        targets = bone.mesh.vertices_mm[bone.mesh.visible_vertices(fit.pose)]
        bounds_mm = (
            one.estimate.predict_tre_mm(
                parts.model.centre_mm, targets[:: max(1, len(targets) // 200)]
            )
            for one in (fit, shown)
        )
        error_mm = compute_mean_tre_mm(fit.pose, true, bone, _NO_TARGETS)
        evidence = Evidence(correlated_ratio=shown.variance_ratio / TOLERATED_VARIANCE_RATIO)
        is_misfit = Reason.SURFACE_MISFIT in decide(evidence).reasons
        ratio = shown.variance_ratio**0.5
        yield Answer(ratio, is_misfit, error_mm, *bounds_mm)


def _row(bone: str, answers: list[Answer]) -> str:
    """Errors and bounds of what is no misfit."""
    ratio = np.array([one.ratio for one in answers])
    good = [one for one in answers if not one.is_misfit]
    error, points, bound = np.array(
        [(one.error_mm, one.points_bound_mm, one.bound_mm) for one in good]
    ).T
    worst_mm = max((one.error_mm for one in answers if one.is_misfit), default=0.0)
    return (
        f"| {bone} | {len(answers)} | {np.median(ratio):.2f} | {np.percentile(ratio, 95):.2f} | "
        f"{ratio.max():.2f} | {len(answers) - len(good)} | {worst_mm:.2f} mm | "
        f"{np.median(error):.3f} mm | {error.max():.3f} mm | "
        f"{np.median(points):.2f} mm | {100 * np.mean(error <= points):.0f} % | "
        f"{np.median(bound):.2f} mm | {100 * np.mean(error <= bound):.0f} % |"
    )


if __name__ == "__main__":
    main()
