"""How much of a shift the matcher finds in noisy pictures.

usage: python -m tests.bench.noisy_matches [--knees N] [--first SEED] [--shift MM]

The femur's model is expected further away than it is, and matched there. Prints, by the electrons
of a full pixel, the median disparity that is found over the one that is really there, and the share
of the model that is matched. An unbiased matcher finds all of it.
"""

import argparse

import numpy as np

from navapp.config import Configuration
from navapp.config.camera_sections import CameraSection, SimulationSection
from navapp.evaluation.sequence import render_room
from navapp.tracking import make_tracker
from navapp.tracking.surface_meter import NEAR_BOX

_FULL_WELLS_E = (100.0, 200.0, 500.0, 2000.0, 20000.0)


def main() -> None:
    """Print a row a noise."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--knees", type=int, default=3)
    parser.add_argument("--first", type=int, default=2_500_001)
    parser.add_argument("--shift", type=float, default=1.0, help="mm along the view")
    options = parser.parse_args()
    print("| full pixel, e | shift found of the true one | matched |\n|---|---|---|")
    for full_well_e in _FULL_WELLS_E:
        seeds = range(options.first, options.first + options.knees)
        found = np.array([measure(seed, full_well_e, options.shift) for seed in seeds])
        share, matched = found.mean(axis=0)
        print(f"| {full_well_e:g} | {100.0 * share:.0f} % | {100.0 * matched:.0f} % |", flush=True)


def measure(seed: int, full_well_e: float, shift_mm: float) -> tuple[float, float]:
    """Share of the shift that is found, and of the model that is matched, of one pair."""
    side = "left" if seed % 2 else "right"
    settings = SimulationSection(seed=seed, side=side, stepped=True, full_well_e=full_well_e)
    sequence = render_room(Configuration(camera=CameraSection(simulated=settings)), "opening", 1)
    tracker = make_tracker(sequence.rig, sequence.plan.bones["femur"])
    true = sequence.truth[0]
    if true is None:
        raise AssertionError("a simulated bone's pose is known")
    frame = tracker.begin(sequence.frames[0], true)
    off = frame.start.move((0.0, 0.0, shift_mm, 0.0, 0.0, 0.0), np.zeros(3))
    expected = tracker.meter.render(frame.pair, off, NEAR_BOX)
    if expected is None:
        raise AssertionError("a simulated bone is in view")
    measured = tracker.meter.measure_on_model(expected)
    disparity, geometry = measured.disparity, tracker.meter.geometry
    step_px = (disparity.disparity_px - expected.support_px)[disparity.is_matched]
    depth_mm = expected.view.depth_mm[disparity.is_matched]
    true_px = geometry.disparity_map_px(depth_mm - shift_mm) - geometry.disparity_map_px(depth_mm)
    return float(np.median(step_px) / np.median(true_px)), measured.matched_fraction


if __name__ == "__main__":
    main()
