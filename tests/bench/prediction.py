"""What carrying a pose on to the moment of light gains: error of guides when they are seen.

usage: python -m tests.bench.prediction [--seeds N] [--frames N]

Simulated legs are followed at 15 pictures a second. The pose of each frame is compared with where
the bone is when the light of its guides is seen, some time after the capture: as it was measured,
and as a session in the mirror carries it on (`control/bone_tracks.py: predict`). Distances are the
mean over the corners of the bone's box; of frames whose corners move by more than 5 mm until then
nothing is lit, and they count in neither column.
"""

import argparse

import numpy as np

from navapp.control.bone_tracks import FARTHEST_PREDICTED_MM
from navapp.tracking import Goal, TrackState, make_tracker
from navapp.values import Status
from sim_devices.scenario import Scenario
from tests.knees import SimulatedKnee

_FIRST_SEED = 9400
_DELAYS_MS = (50, 100, 150)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=4)
    parser.add_argument("--frames", type=int, default=120)
    options = parser.parse_args()
    print("| leg | capture to light ms | frames | dark | measured, median mm | 95 % "
          "| carried on, median mm | 95 % |")  # fmt: skip
    print("|---|" + "---|" * 7)
    for motion in ("breathing", "patient"):
        told = [follow(motion, _FIRST_SEED + k, options.frames) for k in range(options.seeds)]
        for k, delay_ms in enumerate(_DELAYS_MS):
            errors = np.concatenate([one[k] for one in told])
            is_lit = np.isfinite(errors[:, 1])
            measured, carried = errors[is_lit].T
            figures = (np.median(measured), np.quantile(measured, 0.95),
                       np.median(carried), np.quantile(carried, 0.95))  # fmt: skip
            words = " | ".join(f"{one:.2f}" for one in figures)
            print(f"| {motion} | {delay_ms} | {is_lit.sum()} | {(~is_lit).sum()} | {words} |",
                  flush=True)  # fmt: skip


def follow(motion: str, seed: int, n_frames: int) -> list[np.ndarray]:
    """For each delay (n, 2) mm as measured and as carried on; NaN where nothing is lit."""
    knee = SimulatedKnee(Scenario(seed=seed, motion=motion))
    tracker, goal = make_tracker(knee.rig, knee.bone), Goal(np.empty((0, 3)), 2.0)
    mesh_mm = knee.bone.mesh.vertices_mm
    low, high = mesh_mm.min(axis=0), mesh_mm.max(axis=0)
    corners_mm = np.array([[x, y, z] for x in (low[0], high[0])
                           for y in (low[1], high[1]) for z in (low[2], high[2])])  # fmt: skip
    errors: list[list[tuple[float, float]]] = [[] for _ in _DELAYS_MS]
    state: TrackState | None = None
    for frame in knee.frames(n_frames):
        if state is None:
            state = TrackState.at_rest(knee.truth(frame), frame.captured_ns)
        tracked, state = tracker.track(frame, state, goal)
        if tracked.verdict.status is not Status.OK:
            continue
        for k, delay_ms in enumerate(_DELAYS_MS):
            light_ns = frame.captured_ns + delay_ms * 1_000_000
            true_mm = knee.oracle.left_from_body("femur", light_ns).apply(corners_mm)
            measured_mm = state.left_from_bone.apply(corners_mm)
            carried_mm = state.predict(light_ns, corners_mm.mean(axis=0)).apply(corners_mm)
            moved_mm = np.linalg.norm(carried_mm - measured_mm, axis=1).max()
            off_mm = [float(np.linalg.norm(one - true_mm, axis=1).mean())
                      for one in (measured_mm, carried_mm)]  # fmt: skip
            is_lit = moved_mm <= FARTHEST_PREDICTED_MM
            errors[k].append((off_mm[0], off_mm[1] if is_lit else np.nan))
    return [np.array(one) for one in errors]


if __name__ == "__main__":
    main()
