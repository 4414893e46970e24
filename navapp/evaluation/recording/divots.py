"""Errors at points of a bone that were touched with a pointer: no pose is known for them."""

from collections.abc import Sequence

import numpy as np

from navapp.evaluation.recording.truth_files import DivotTruth
from navapp.geometry.transform import RigidTransform


def measure_divots(
    poses: Sequence[RigidTransform | None], numbers: Sequence[int], truth: DivotTruth
) -> list[float | None]:
    """Mean distance, in each picture, of the touched points from where a pose puts them; mm.

    Args:
        poses: left camera from bone in each picture.
        numbers: of the pictures.
        truth: what was touched in them.

    Returns:
        None where nothing was touched, or no pose is known.
    """
    errors_mm: list[float | None] = []
    for pose, number in zip(poses, numbers, strict=True):
        off_mm = [
            float(np.linalg.norm(pose.apply(truth.divots_mm[touch.name]) - touch.left_mm))
            for touch in truth.touched
            if touch.number == number and pose is not None
        ]
        errors_mm.append(float(np.mean(off_mm)) if off_mm else None)
    return errors_mm
