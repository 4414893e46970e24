"""Plates that must not be taken for another: no face of a plate, no plate, at a wrong pose.

usage: python -m tests.bench.tool_faces [--frames N] [--seed N]

Pairs of pictures of a plate of three faces folded by 50 deg, at any pose, partly covered or not,
shining or not, and of another plate; each is looked at as either of both. A pose
that is accepted counts as wrong when it is more than 3 mm or 5 deg off, or of a plate that is not
there.
"""

import argparse
import sys
from collections import Counter
from functools import lru_cache
from typing import Any

import numpy as np

from navapp.devices.simulated_tool import make_shape
from navapp.geometry.transform import RigidTransform, rotation_angle_deg, rotation_from_vector
from navapp.tools.plate import Plate
from navapp.tools.plate_meter import PlateMeter, PlatePose
from sim_devices.held_tool import Cover, ToolInView
from sim_devices.rigs import make_default_rig
from sim_devices.sensor import SensorModel

# Not the seed of any test or other bench.
SEED = 7411
FOLDED = Plate(first_id=20, faces=3, fold_deg=50.0)
OTHER = Plate(first_id=32)
_WRONG_MM, _WRONG_DEG = 3.0, 5.0


class _Cluttered:
    """A still background with edges of its own."""

    def __init__(self, seed: int) -> None:
        self.rig = make_default_rig()
        rng = np.random.default_rng(seed)
        coarse = rng.uniform(0.02, 0.5, (6, 10)).astype(np.float32)
        picture = np.kron(coarse, np.ones((120, 128), np.float32))[:720, :1280]
        self._picture = np.repeat(picture[:, :, None], 3, axis=2)

    def render(self, eye: str, time_ns: int, *how: Any) -> np.ndarray:
        """(H, W, 3)."""
        return self._picture


def main() -> int:
    """Count; 1 when a wrong pose was accepted."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--frames", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=SEED)
    options = parser.parse_args()
    rng = np.random.default_rng(options.seed)
    behind, sensor = _Cluttered(options.seed), SensorModel(seed=options.seed, is_grey=True)
    meters = {plate: PlateMeter(plate, behind.rig) for plate in (FOLDED, OTHER)}
    counts: Counter[str] = Counter()
    for number in range(options.frames):
        shown = FOLDED if rng.uniform() < 0.8 else OTHER
        pose = _any_pose(rng)
        scene = _scene(behind, shown, options.seed + number % 12)
        scene.pose = pose
        left, right = (
            sensor.picture(scene.render(eye, 0), eye, number) for eye in ("left", "right")
        )
        meter = meters[FOLDED if rng.uniform() < 0.8 else OTHER]
        found = meter.measure((left, right))
        counts[_judge(found, pose, is_shown=meter.plate is shown)] += 1
        if number % 500 == 499:
            print(number + 1, dict(counts), file=sys.stderr, flush=True)
    print("| pairs | " + " | ".join(counts) + " |")
    print(f"| {options.frames} | " + " | ".join(str(n) for n in counts.values()) + " |")
    return 1 if counts["wrong"] else 0


class _Held(ToolInView):
    """A tool at whatever pose it is given."""

    pose: RigidTransform

    def __init__(self, behind: _Cluttered, plate: Plate, seed: int) -> None:
        rng = np.random.default_rng(seed)
        cover = Cover(rng.uniform(0, 2 * np.pi), rng.uniform(-5, 15)) if seed % 2 else None
        shape = make_shape("pointer", plate, seed)
        super().__init__(behind, shape, lambda _: self.pose, cover, rng.uniform(0, 2))


@lru_cache(maxsize=24)
def _scene(behind: _Cluttered, plate: Plate, seed: int) -> _Held:
    """Printed once."""
    return _Held(behind, plate, seed)


def _any_pose(rng: np.random.Generator) -> RigidTransform:
    """In view of both cameras, its first face turned towards them or not."""
    axis = rng.standard_normal(3)
    turn = rotation_from_vector(np.radians(rng.uniform(0, 80)) * axis / np.linalg.norm(axis))
    spin = rotation_from_vector((0.0, 0.0, rng.uniform(-np.pi, np.pi)))
    place = (rng.uniform(-60, 80), rng.uniform(-40, 40), rng.uniform(330, 520))
    return RigidTransform.from_parts("left", "tool", turn @ spin, place)


def _judge(found: PlatePose | str, pose: RigidTransform, *, is_shown: bool) -> str:
    if isinstance(found, str):
        return "refused, there" if is_shown else "refused, not there"
    if not is_shown:
        return "wrong"
    true = pose.rename("left", "plate")
    off_mm = float(np.linalg.norm(found.left_from_plate.translation_mm - true.translation_mm))
    is_off = off_mm > _WRONG_MM or rotation_angle_deg(found.left_from_plate, true) > _WRONG_DEG
    return "wrong" if is_off else "right"


if __name__ == "__main__":
    sys.exit(main())
