"""How smooth pictures are in and out of focus, beside the limit of PICTURES_DEFOCUSED.

usage: python -m tests.bench.defocus [--knees N] [--first SEED]

One pair of each simulated knee, at each blur (standard deviation, px) of both eyes; usual pictures,
noisy ones, such with a faint texture or none, matt ones, near and far ones. Prints the least and
the largest smoothness (`stereo.PictureHealth`) of the less sharp picture around the stage's bone.
"""

import argparse
from typing import Any

import numpy as np

from navapp.config import Configuration
from navapp.config.camera_sections import CameraSection, SimulationSection
from navapp.control.stages import STAGES
from navapp.evaluation.sequence import render_room
from navapp.stereo import measure_health
from navapp.tracking import make_tracker
from navapp.tracking.surface_meter import NEAR_BOX

_BLURS_PX = (0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 6.0)
_PICTURES: tuple[dict[str, Any], ...] = (
    {}, {"full_well_e": 500.0}, {"contrast": 0.01}, {"contrast": 0.0}, {"highlights": 0.0},
    {"distance_mm": 300.0}, {"distance_mm": 550.0},
)  # fmt: skip


def main() -> None:
    """Print a row a blur."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--knees", type=int, default=2)
    parser.add_argument("--first", type=int, default=2_400_001)
    options = parser.parse_args()
    print("| blur, px | " + " | ".join(stage.name for stage in STAGES) + " |")
    print("|---" * (len(STAGES) + 1) + "|")
    for blur_px in _BLURS_PX:
        cells = []
        for stage in STAGES:
            found = [
                measure(stage.name, options.first + number, {**pictures, "defocus_px": blur_px})
                for number in range(options.knees)
                for pictures in _PICTURES
            ]
            cells.append(f"{min(found):.2f} to {max(found):.2f}")
        print(f"| {blur_px:g} | " + " | ".join(cells) + " |", flush=True)


def measure(stage: str, seed: int, changes: dict[str, Any]) -> float:
    """Smoothness of the less sharp picture of a knee, around the bone where it really is."""
    side = "left" if seed % 2 else "right"
    settings = SimulationSection(seed=seed, side=side, stepped=True, **changes)
    sequence = render_room(Configuration(camera=CameraSection(simulated=settings)), stage, 1)
    tracker = make_tracker(sequence.rig, sequence.plan.bones[sequence.stage.bone])
    true = sequence.truth[0]
    if true is None:
        raise AssertionError("a simulated bone's pose is known")
    frame = tracker.begin(sequence.frames[0], true)
    expected = tracker.meter.render(frame.pair, frame.start, NEAR_BOX)
    if expected is None:
        raise AssertionError("a simulated bone is in view")
    found = tracker.meter.measure_on_model(expected).disparity
    centre_mm = frame.start.apply(tracker.model.centre_mm)
    disparity_px = tracker.meter.geometry.disparity_px(float(centre_mm[2]))
    health = measure_health(frame.pair, found, disparity_px)
    return float(np.fmax(health.left.smoothness, health.right.smoothness))


if __name__ == "__main__":
    main()
