"""After a loss: where else the bone may be, a part of it in every other frame.

A search around the last pose finds what moved by little. Further off, only some of the starts
around it lead to the bone, and a frame has no time for all of them: each other lost frame tries a
part that is spread over all directions, until every start had its turn.
"""

import numpy as np

from navapp.geometry.transform import RigidTransform
from navapp.registration import tilted_starts

# Steps along each axis, and the tilts of each: (mm, ((deg, how many), ...)).
_RINGS = (
    (20.0, ((15.0, 6), (28.0, 12))),
    (40.0, ((20.0, 6), (35.0, 8))),
)
_PARTS = 10


def starts_after_loss(
    last: RigidTransform, centre_mm: np.ndarray, n_lost: int
) -> list[RigidTransform]:
    """What to start from besides the last pose; nothing in every other frame.

    Args:
        last: pose of the bone when it was seen last.
        centre_mm: (3,) of the model, in bone coordinates.
        n_lost: frames lost before this one.
    """
    if n_lost % 2 == 0:
        return []
    part = n_lost // 2 % _PARTS
    return _all_starts(last, last.apply(centre_mm))[part::_PARTS]


def _all_starts(last: RigidTransform, place_mm: np.ndarray) -> list[RigidTransform]:
    """Tilts of the last pose where it was, and a step away along each axis."""
    axes = np.vstack([np.eye(3), -np.eye(3)])
    starts = []
    for number, (step_mm, tilts) in enumerate(_RINGS):
        steps_mm = [np.zeros(3)] * (number == 0) + list(step_mm * axes)
        for step in steps_mm:
            moved = last.moved(np.concatenate([step, np.zeros(3)]), place_mm)
            starts.append(moved)
            for tilt_deg, n_tilts in tilts:
                starts += tilted_starts(moved, place_mm + step, tilt_deg, n_tilts)[1:]
    return starts
