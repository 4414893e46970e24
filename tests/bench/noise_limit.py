"""What keeps poses from the least error that noise allows: pictures are changed, and the model.

usage: python -m tests.bench.noise_limit [--seeds N] [--first SEED] [--stage NAME]

Some frames each of simulated knees whose plans and rigs are exact, followed by bimcc. Root mean
square errors over targets and OK frames, step by step as in `navapp evaluate`
(docs/evaluation.md): on pictures as they usually are, without noise, without highlights, without
both, with twice the texture besides, with a saw that misses nothing, and as usual with a model
whose surface is trusted to 0.01 mm instead of 0.1 mm. The limit is always that of the usual noise,
and so is the choice of the pixels that obey the model. What is left without noise has another
cause.
"""

import argparse
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import islice
from typing import Any

import numpy as np

from navapp.config import Configuration
from navapp.config.camera_sections import CameraSection, SimulationSection
from navapp.control.stages import STAGES
from navapp.evaluation.following import follow
from navapp.evaluation.noise_limit.frame import measure_budget
from navapp.evaluation.sequence import render_room
from navapp.geometry.rectification import rectifier_of
from navapp.registration import RegistrationModel
from sim_devices.sensor import SensorModel

FIRST_SEED = 640
_N_FRAMES = 4
_NOISELESS = {"full_well_e": 1e9, "read_noise_e": 0.0}
_MATT = {"highlights": 0.0}
# Pictures, and standard deviation of the model's surface, mm.
VARIANTS: dict[str, tuple[dict[str, float], float]] = {
    "usual": ({}, RegistrationModel.SURFACE_SIGMA_MM),
    "no noise": (_NOISELESS, RegistrationModel.SURFACE_SIGMA_MM),
    "matt": (_MATT, RegistrationModel.SURFACE_SIGMA_MM),
    "matt, no noise": (_NOISELESS | _MATT, RegistrationModel.SURFACE_SIGMA_MM),
    "matt, no noise, twice the texture": (
        _NOISELESS | _MATT | {"contrast": 0.1},
        RegistrationModel.SURFACE_SIGMA_MM,
    ),
    "cuts exactly as planned": ({"misses": 0.0}, RegistrationModel.SURFACE_SIGMA_MM),
    "usual, surface to 0.01 mm": ({}, 0.01),
}


def main() -> None:
    """Print a line for each variant."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=8)
    parser.add_argument("--first", type=int, default=FIRST_SEED)
    parser.add_argument("--stage", choices=[stage.name for stage in STAGES], default="opening")
    options = parser.parse_args()
    print("| pictures | frames | limit | ideal | matched | reached, mm |")
    print("|---|---|---|---|---|---|")
    for name, (changes, surface_sd_mm) in VARIANTS.items():
        seeds = range(options.first, options.first + options.seeds)
        with _trusting(surface_sd_mm):
            found = [one for seed in seeds for one in _measure(seed, options.stage, changes)]
        roots = np.sqrt(np.mean(np.square(found), axis=0))
        print(f"| {name} | {len(found)} | " + " | ".join(f"{one:.4f}" for one in roots) + " |")


@contextmanager
def _trusting(surface_sd_mm: float) -> Iterator[None]:
    usual = RegistrationModel.SURFACE_SIGMA_MM
    RegistrationModel.SURFACE_SIGMA_MM = surface_sd_mm
    try:
        yield
    finally:
        RegistrationModel.SURFACE_SIGMA_MM = usual


def _measure(seed: int, stage: str, changes: dict[str, Any]) -> Iterator[tuple[float, ...]]:
    """Limit, ideal, matched and reached of the OK frames of one knee."""
    settings = SimulationSection(seed=seed, stepped=True, **changes)
    sequence = render_room(
        Configuration(camera=CameraSection(simulated=settings)), stage, _N_FRAMES
    )
    answers = follow(sequence, "bimcc")
    centre_mm = sequence.plan.bones[sequence.stage.bone].mesh.centroid_mm
    targets_mm = sequence.plan.targets_of(sequence.stage.targets)
    answered = zip(sequence.frames, answers.frames, sequence.truth, strict=True)
    for frame, one, true in islice(answered, 1, None):
        if not one.is_ok or one.pose is None or true is None:
            continue
        budget = measure_budget(
            frame, one.pose, true, answers.surface, centre_mm, targets_mm,
            rectifier_of(sequence.rig), SensorModel(seed=seed),
        )  # fmt: skip
        if budget is not None:
            yield budget.limit_mm, budget.ideal_mm, budget.matched_mm, budget.reached_mm


if __name__ == "__main__":
    main()
