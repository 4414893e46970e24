"""Default targets: points on the joint's surfaces at which the registration error is judged."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.transform import FloatArray
from navapp.preop.cut_ends import anatomy_of
from navapp.preop.femur_landmarks import condyles_of
from navapp.preop.tibia_landmarks import EMINENCE_HALF_MM, find_tibial_end
from navapp.values import BoneModel, StageContent

# Points a region: 12 on 20 x 30 mm stand 7 mm apart.
POINTS_A_REGION = 12

# Where an extended femur bears weight its surface looks down; 10 mm beside the notch begin the
# condyles. The trochlea looks forward, above them, 20 mm to both sides.
_LOOKS_THERE = 0.7
_BESIDE_NOTCH_MM, _TROCHLEA_HALF_MM, _TROCHLEA_LEVELS_MM = 10.0, 20.0, (8.0, 35.0)
# What the patella glides on looks back.
_LOOKS_BACK = 0.5

_BONE_OF_STAGE = {
    "opening": "femur",
    "drilling": "femur",
    "implant": "femur",
    "patella": "patella",
    "spacer": "tibia",
}


def make_default_targets(bones: Mapping[str, BoneModel]) -> dict[str, FloatArray]:
    """Points keyed `bone/name`, of the regions that the surfaces show; the same every time."""
    found: dict[str, FloatArray] = {}
    if "femur" in bones:
        found |= _of_femur(anatomy_of(bones["femur"]))
    if "tibia" in bones:
        found |= _of_tibia(anatomy_of(bones["tibia"]))
    if "patella" in bones:
        mesh = anatomy_of(bones["patella"])
        found["patella/back"] = _spread(mesh.vertices_mm, mesh.normals[:, 1] > _LOOKS_BACK)
    return {name: points for name, points in found.items() if len(points)}


def with_defaults(
    bones: Mapping[str, BoneModel],
    targets: Mapping[str, FloatArray],
    stages: Mapping[str, StageContent],
) -> tuple[dict[str, FloatArray], dict[str, StageContent]]:
    """Targets and stages, with default targets for the bones that have none.

    A stage that names no targets is judged by its bone's default ones; where targets of the bone
    are given, it stays as it is.
    """
    given = {name.partition("/")[0] for name in targets}
    spread = make_default_targets({name: bone for name, bone in bones.items() if name not in given})
    filled = dict(stages)
    for stage, usual in _BONE_OF_STAGE.items():
        planned = stages.get(stage, StageContent(usual))
        own = tuple(name for name in spread if name.startswith(f"{planned.bone}/"))
        if own and not planned.targets:
            filled[stage] = replace(planned, targets=own)
    return {**targets, **spread}, filled


def _of_femur(mesh: TriangleMesh) -> dict[str, FloatArray]:
    condyles = condyles_of(mesh)
    if condyles is None:
        return {}
    points, normals = mesh.vertices_mm, mesh.normals
    beside = points[:, 0] - condyles.notch_x_mm
    above = points[:, 2] - condyles.vertices_mm[:, 2].min()
    looks_down = normals[:, 2] < -_LOOKS_THERE
    is_low = above < _TROCHLEA_LEVELS_MM[1]
    bearing = [
        _spread(points, is_low & looks_down & (sign * beside > _BESIDE_NOTCH_MM))
        for sign in (1.0, -1.0)
    ]
    is_trochlea = (
        is_low
        & (above > _TROCHLEA_LEVELS_MM[0])
        & (normals[:, 1] < -_LOOKS_THERE)
        & (np.abs(beside) < _TROCHLEA_HALF_MM)
    )
    return {
        "femur/weight_bearing": np.concatenate(bearing),
        "femur/trochlea": _spread(points, is_trochlea),
    }


def _of_tibia(mesh: TriangleMesh) -> dict[str, FloatArray]:
    end = find_tibial_end(mesh)
    if end is None:
        return {}
    across = end.vertices_mm[:, 0] - end.middle_mm[0]
    halves = [
        _spread(end.vertices_mm, end.is_plateau & (sign * across > EMINENCE_HALF_MM))
        for sign in (1.0, -1.0)
    ]
    return {"tibia/plateau": np.concatenate(halves)}


def _spread(points_mm: FloatArray, among: NDArray[np.bool_]) -> FloatArray:
    """Up to 12 vertices: the one nearest the middle, then always the one furthest from all."""
    region = points_mm[among]
    if len(region) == 0:
        return np.empty((0, 3))
    chosen = [int(np.argmin(((region - region.mean(axis=0)) ** 2).sum(axis=1)))]
    distance = ((region - region[chosen[0]]) ** 2).sum(axis=1)
    while len(chosen) < min(POINTS_A_REGION, len(region)):
        chosen.append(int(np.argmax(distance)))
        distance = np.minimum(distance, ((region - region[chosen[-1]]) ** 2).sum(axis=1))
    return region[chosen]
