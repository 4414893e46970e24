"""How many pairs a guided capture needs until it stops, and what the rig is then worth.

Simulated rigs, marks with noise instead of pictures; the board reaches every wanted view as nearly
as the simulated hand does. The true error is that of triangulated points of the working volume.

    python -m tests.bench.guided_capture [--rigs 10] [--noise-px 0.06] [--stop-mm 0.15]
"""

import argparse
from dataclasses import dataclass

import numpy as np

from calibration.rig.rig_solution import solve_rig
from calibration.targets.seen_pairs import SeenPair
from navapp.control.capture.next_view import plan_next_view
from navapp.geometry.rig import StereoRig
from navapp.geometry.transform import RigidTransform
from navapp.geometry.triangulation import triangulate_mm
from tests.calibration.marks import BOARD, HEIGHT, WIDTH, drawn_rig, seen_pair

SIZE, DEPTH_MM = (WIDTH, HEIGHT), (350.0, 550.0)
# As the simulated hand reaches a pose, and the shutter's condition.
OFF_MM, OFF_RAD, FEWEST_COMMON = 2.0, 0.02, 12
FEWEST_PAIRS, MOST_PAIRS = 8, 80


@dataclass(frozen=True)
class Captured:
    """One rig: pairs needed, bounds of capture and solve, true errors of the volume."""

    n_pairs: int
    stopped_mm: float
    bounds_mm: np.ndarray
    errors_mm: np.ndarray
    is_accepted: bool
    model: str


def captured(seed: int, noise_px: float, stop_mm: float) -> Captured:
    rng = np.random.default_rng([seed, 16])
    true = drawn_rig(rng)
    pairs: list[SeenPair] = []
    next_view = plan_next_view(BOARD, pairs, SIZE, DEPTH_MM)
    while len(pairs) < MOST_PAIRS:
        pairs.append(reached(len(pairs), true, next_view.left_from_board, rng, noise_px))
        next_view = plan_next_view(BOARD, pairs, SIZE, DEPTH_MM, next_view)
        is_known = next_view.bound_mm is not None and next_view.bound_mm <= stop_mm
        if len(pairs) >= FEWEST_PAIRS and is_known:
            break
    found = solve_rig(BOARD, pairs, SIZE)
    points_mm = found.points_mm
    left = true.left.project(points_mm)
    right = true.right.project(true.right_from_left.apply(points_mm))
    errors = np.linalg.norm(triangulate_mm(found.rig, left, right) - points_mm, axis=1)
    is_accepted = found.rig.quality is not None and found.rig.quality.is_accepted
    model = found.solved.model.name
    return Captured(
        len(pairs), next_view.bound_mm or np.inf, found.bounds_mm, errors, is_accepted, model
    )


def reached(
    index: int, true: StereoRig, wanted: RigidTransform, rng: np.random.Generator, noise_px: float
) -> SeenPair:
    """The hand goes there until both cameras see enough."""
    for _ in range(100):
        off = rng.normal(0.0, 1.0, 6) * np.repeat((OFF_MM, OFF_RAD), 3)
        held = wanted.move(off, wanted.apply(BOARD.points_mm.mean(axis=0)))
        pair = seen_pair(index, true, held, rng, noise_px=noise_px)
        if len(pair.common()[0]) >= FEWEST_COMMON:
            return pair
    raise RuntimeError("a wanted view is not seen by both cameras")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rigs", type=int, default=10)
    parser.add_argument("--noise-px", type=float, default=0.06)
    parser.add_argument("--stop-mm", type=float, default=0.15)
    options = parser.parse_args()
    print("| rig | pairs | bound at the stop | bound of the solve | true error | p95 | model |")
    print("|---|---|---|---|---|---|---|")
    results = []
    for seed in range(options.rigs):
        one = captured(seed, options.noise_px, options.stop_mm)
        results.append(one)
        print(
            f"| {seed} | {one.n_pairs} | {one.stopped_mm:.3f} | {np.median(one.bounds_mm):.3f} | "
            f"{np.median(one.errors_mm):.3f} | {np.quantile(one.errors_mm, 0.95):.3f} | "
            f"{one.model}{'' if one.is_accepted else ', not accepted'} |",
            flush=True,
        )
    medians = np.array([np.median(one.errors_mm) for one in results])
    pairs = [one.n_pairs for one in results]
    held = np.mean(np.concatenate([one.errors_mm < one.bounds_mm for one in results]))
    print(
        f"\npairs {min(pairs)} to {max(pairs)}; true error at most {options.stop_mm:g} mm in "
        f"{(medians <= options.stop_mm).sum()} of {len(results)}, worst {medians.max():.3f} mm; "
        f"{100 * held:.0f} % of points within the predicted bound"
    )


if __name__ == "__main__":
    main()
