"""Surgical content of a plan for the simulated knee, constructed from its landmarks."""

from collections.abc import Mapping

import numpy as np

from navapp.devices.simulated_room import Simulation
from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.values import (
    ANKLE_CENTRE,
    HIP_CENTRE,
    Defect,
    DrillAxis,
    Landmark,
    Part,
    ResectionPlane,
    RiskStructure,
    StageContent,
    SurgicalContent,
)
from navapp.values.contents import PartKind

_DRILL_DIAMETER_MM, _DRILL_DEPTH_MM = 9.0, 25.0
_SAFETY_MM = 5.0
# Lengths of a thigh and a shank, by way of the knee's own size.
_HIP_ABOVE, _ANKLE_BELOW = 5.4, 4.6

_UP = np.array([0.0, 0.0, 1.0])


def make_built_in_content(simulation: Simulation) -> SurgicalContent:
    """All that a plan can hold, of the simulated patient."""
    points = {name: np.asarray(point) for name, point in simulation.targets.items()}
    planes = {
        name: ResectionPlane(cut.bone, cut.point_mm, cut.normal, cut.extent_mm)
        for name, cut in simulation.planned_cuts.items()
    }
    entry = DrillAxis(
        "femur",
        simulation.drill_entry_mm,
        simulation.drill_direction,
        _DRILL_DEPTH_MM,
        _DRILL_DIAMETER_MM,
    )
    return SurgicalContent(
        planes=planes,
        drills={"femoral_guide": entry},
        parts=_parts(simulation, planes),
        risks={name: RiskStructure("femur", _SAFETY_MM) for name in simulation.curves},
        landmarks=_landmarks(points),
        defects={"worn_medial": Defect("femur", simulation.worn_vertices)},
        stages={
            "opening": StageContent("femur", risks=tuple(simulation.curves)),
            "drilling": StageContent(
                "femur", drills=("femoral_guide",), risks=tuple(simulation.curves)
            ),
            "implant": _stage(planes, "femur", "femoral_implant"),
            "patella": _stage(planes, "patella", "patellar_implant"),
            "spacer": _stage(planes, "tibia", "spacer"),
        },
    )


def _stage(planes: Mapping[str, ResectionPlane], bone: str, part: str) -> StageContent:
    """All cuts of a bone, and the component that covers them."""
    names = tuple(name for name, plane in planes.items() if plane.bone == bone)
    return StageContent(bone, planes=names, parts=(part,))


def _parts(simulation: Simulation, planes: Mapping[str, ResectionPlane]) -> dict[str, Part]:
    """The components, each in the frame of the cut that it sits on."""
    seats: dict[str, tuple[PartKind, str]] = {
        "femoral_implant": ("implant", "femur_distal"),
        "patellar_implant": ("implant", "patella"),
        "spacer": ("spacer", "tibia_proximal"),
    }
    parts = {}
    for name, (kind, plane) in seats.items():
        bone_from_part = _on(planes[plane], name)
        shape = simulation.planned_parts[name].transform(bone_from_part.inverse())
        parts[name] = Part(kind, shape, bone_from_part)
    return parts


def _on(plane: ResectionPlane, name: str) -> RigidTransform:
    """`bone_from_part`: its origin in the middle of the cut, its z along the plane's normal."""
    rotation = np.column_stack([*plane.axes, plane.normal])
    return RigidTransform.from_parts(plane.bone, name, rotation, plane.point_mm)


def _landmarks(points: Mapping[str, FloatArray]) -> dict[str, Landmark]:
    """The simulator's own are exact; the far joints are where a leg of that size has them."""
    width_mm = float(
        np.linalg.norm(points["femur/medial_epicondyle"] - points["femur/lateral_epicondyle"])
    )
    middle = 0.5 * (points["tibia/medial_plateau"] + points["tibia/lateral_plateau"])
    centres = {
        HIP_CENTRE: points["femur/notch"] + _HIP_ABOVE * width_mm * _UP,
        ANKLE_CENTRE: middle - _ANKLE_BELOW * width_mm * _UP,
    }
    return {name: Landmark(p, 0.0, "simulation") for name, p in {**points, **centres}.items()}
