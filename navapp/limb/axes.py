"""The mechanical axes of a leg and its bones' own frames, from the landmarks of a plan."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from navapp.geometry.transform import FloatArray
from navapp.values import ANKLE_CENTRE, HIP_CENTRE, Landmark

# The first that the plan has.
_KNEE_CENTRES = ("femur/knee_centre", "femur/notch")
_EPICONDYLES = "femur/medial_epicondyle", "femur/lateral_epicondyle"
_PLATEAUS = "tibia/medial_plateau", "tibia/lateral_plateau"


@dataclass(frozen=True, slots=True, eq=False)
class LimbAxes:
    """Columns of each: unit vectors to the patient's left, to the back and upwards, in plan mm.

    The third is the bone's mechanical axis: knee to hip centre of the femur, ankle to knee centre
    of the tibia. The first is the line through the epicondyles, or through the middles of the
    plateaus, laid across it.
    """

    femur: FloatArray  # (3, 3)
    tibia: FloatArray  # (3, 3)


def find_missing(landmarks: Mapping[str, Landmark]) -> str | None:
    """What the plan lacks for the axes, in words; None when it has all."""
    if not any(name in landmarks for name in _KNEE_CENTRES):
        return "no knee centre in the plan"
    asked = (HIP_CENTRE, ANKLE_CENTRE, *_EPICONDYLES, *_PLATEAUS)
    missing = next((name for name in asked if name not in landmarks), None)
    if missing is None:
        return None
    return f"no {missing.partition('/')[2].replace('_', ' ')} in the plan"


def find_limb_axes(landmarks: Mapping[str, Landmark]) -> LimbAxes | None:
    """The axes of a plan's landmarks (keyed `bone/name`); None when one is missing."""
    if find_missing(landmarks) is not None:
        return None
    points_mm = {name: one.point_mm for name, one in landmarks.items()}
    knee_mm = next(points_mm[name] for name in _KNEE_CENTRES if name in points_mm)
    plateau_mm = 0.5 * (points_mm[_PLATEAUS[0]] + points_mm[_PLATEAUS[1]])
    return LimbAxes(
        _frame(points_mm[HIP_CENTRE] - knee_mm, *(points_mm[name] for name in _EPICONDYLES)),
        _frame(plateau_mm - points_mm[ANKLE_CENTRE], *(points_mm[name] for name in _PLATEAUS)),
    )


def _frame(up_mm: FloatArray, medial_mm: FloatArray, lateral_mm: FloatArray) -> FloatArray:
    """(3, 3) columns: left, back, up."""
    up = up_mm / np.linalg.norm(up_mm)
    across = medial_mm - lateral_mm
    left = across * np.sign(across[0]) - (across * np.sign(across[0]) @ up) * up
    left /= np.linalg.norm(left)
    return np.column_stack([left, np.cross(up, left), up])
