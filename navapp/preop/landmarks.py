"""Landmarks of a plan's bones from their surfaces alone, each with its standard deviation."""

from collections.abc import Mapping

from navapp.preop.cut_ends import anatomy_of
from navapp.preop.femur_landmarks import estimate_femur_landmarks
from navapp.preop.tibia_landmarks import estimate_patella_landmarks, estimate_tibia_landmarks
from navapp.values import BoneModel, Landmark


def estimate_landmarks(bones: Mapping[str, BoneModel]) -> dict[str, Landmark]:
    """What the surfaces allow, keyed `bone/name`; what they do not allow is left out.

    The plan's z is taken for the leg's long axis: outermost points are those along the plan's axes.
    """
    found: dict[str, Landmark] = {}
    if "femur" in bones:
        found |= estimate_femur_landmarks(anatomy_of(bones["femur"]), bones["femur"].side)
    if "tibia" in bones:
        found |= estimate_tibia_landmarks(anatomy_of(bones["tibia"]), bones["tibia"].side)
    if "patella" in bones:
        found |= estimate_patella_landmarks(anatomy_of(bones["patella"]))
    return found
