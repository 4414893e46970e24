"""How far off a pose may be for the follower's samples, printed as the table of docs/how/stereo.md.

usage: python -m tests.bench.follower_reach [--seeds N]

Simulated pairs; the true pose is shifted, and turned about the bone's middle so that both move the
surface by about as much. One round matches samples of the model there and fits to them. Off is the
mean displacement of the corners around the bone's surface.
"""

import argparse
from collections.abc import Iterator

import numpy as np

from navapp.registration import fit_bimcc
from navapp.tracking.frame import MODEL_SETTINGS
from navapp.tracking.surface_meter import NEAR_BOX
from navapp.values import BoneModel, Reason
from tests.bench.bone_scenes import Sequence, disturbed, simulated_sequence
from tests.bench.tracker_parts import TrackerParts

_SHIFTS_MM = (0.25, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0)
_SEQUENCES = ("opening", "drilling")


def main() -> None:
    """Print a line for each shift."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=20)
    n_seeds = parser.parse_args().seeds
    shown = [simulated_sequence(name) for name in _SEQUENCES]
    print("| off mm | samples that answer | left mm, median | 90 % | left / off, median |")
    print("|---|---|---|---|---|")
    for shift_mm in _SHIFTS_MM:
        rows = np.array([row for one in shown for row in rounds(one, shift_mm, n_seeds)])
        off_mm, share, left_mm = rows.T
        print(
            f"| {np.median(off_mm):.2f} | {100 * np.median(share):.0f} % | "
            f"{np.median(left_mm):.3f} | {np.quantile(left_mm, 0.9):.3f} | "
            f"{np.median(left_mm / off_mm):.2f} |",
            flush=True,
        )


def rounds(
    sequence: Sequence, shift_mm: float, n_seeds: int
) -> Iterator[tuple[float, float, float]]:
    """Off before, share of the samples that answer, off after; infinite without a fit."""
    parts = TrackerParts(sequence.rig, BoneModel("femur", sequence.mesh))
    model, meter = parts.model, parts.meter
    radius_mm = np.linalg.norm(model.hull_mm - parts.model.centre_mm, axis=1).mean()
    for scene in sequence.scenes:
        for seed in range(n_seeds):
            turn_deg = float(np.degrees(shift_mm / radius_mm))
            start = disturbed(scene.pose, parts.model.centre_mm, turn_deg, shift_mm, seed)
            expected = meter.render(scene.pair, start, NEAR_BOX)
            assert expected is not None
            measured = meter.measure_on_samples(expected)
            found = fit_bimcc(measured.scene, model, start, MODEL_SETTINGS)
            is_lost = Reason.TOO_FEW_POINTS in found.reasons
            pose = found.camera_from_bone
            left_mm = np.inf if is_lost else scene.pose.mean_motion_mm(pose, model.hull_mm)
            off_mm = scene.pose.mean_motion_mm(start, model.hull_mm)
            yield off_mm, measured.matched_fraction, left_mm


if __name__ == "__main__":
    main()
