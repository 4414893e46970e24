"""The leg's two bones together: how the knee bends, its angles and its gaps."""

from navapp.limb.angles import LimbAngles
from navapp.limb.flexion import Hinge, Poses
from navapp.limb.gaps import Gap
from navapp.limb.limb_meter import FEMUR, TIBIA, BoneSurface, LimbMeasurement, LimbMeter

__all__ = [
    "FEMUR",
    "TIBIA",
    "BoneSurface",
    "Gap",
    "Hinge",
    "LimbAngles",
    "LimbMeasurement",
    "LimbMeter",
    "Poses",
]
