"""A parametric knee: femur, tibia and patella with landmarks and the vessels behind them."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from types import MappingProxyType
from typing import Literal, get_args

import numpy as np

from navapp.errors import UsageError
from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.transform import FloatArray
from sim_devices.bone_shapes import (
    PATELLA_Z_MM,
    ShapeDraws,
    compute_patella_back,
    compute_plateau_height,
    draw_shape,
    make_femur,
    make_patella,
    make_tibia,
)
from sim_devices.implicit import Below, Field, Rough, Scaled, project
from sim_devices.relief import Bumps, make_waves
from sim_devices.surface_nets import mesh_solid

Side = Literal["left", "right"]
Sex = Literal["female", "male"]
AgeGroup = Literal["young", "middle", "old"]

CELL_MM = 1.25
JOINT_GAP_MM = 4.0
RELIEF_RMS_MM = {"young": 0.10, "middle": 0.15, "old": 0.22}
MIRROR = np.array([-1.0, 1.0, 1.0])


@dataclass(frozen=True, slots=True)
class KneeSpec:
    """Which knee: equal specs give equal knees.

    Raises:
        UsageError: a negative seed, or a side, sex or age group that there is not.
    """

    seed: int = 1
    side: Side = "right"
    sex: Sex = "female"
    age_group: AgeGroup = "middle"

    def __post_init__(self) -> None:
        if self.seed < 0:
            raise UsageError("the seed of a knee is negative", remedy="give 0 or more")
        for value, kind in ((self.side, Side), (self.sex, Sex), (self.age_group, AgeGroup)):
            if value not in get_args(kind):
                known = ", ".join(get_args(kind))
                raise UsageError(f"there is no knee {value!r}", remedy=f"use one of {known}")


@dataclass(frozen=True, slots=True, eq=False)
class KneeAnatomy:
    """A knee in extension; LPS mm, the origin in the middle between the femur's epicondyles."""

    spec: KneeSpec  # what it was made from
    bones: Mapping[str, TriangleMesh]  # "femur", "tibia", "patella": closed surfaces
    # "bone/name" to (3,); on the surface, except "patella/centre".
    landmarks: Mapping[str, FloatArray]
    curves: Mapping[str, FloatArray]  # name to (N, 3) polyline beside the bones
    solids: Mapping[str, Field]  # the implicit function of each bone, whose zero level is the mesh
    # (3,) factors from the proportions of `bone_shapes`; x negative for a left knee.
    scale: FloatArray
    shape: ShapeDraws  # the random part of the proportions


@lru_cache(maxsize=8)
def make_knee(spec: KneeSpec = KneeSpec()) -> KneeAnatomy:
    """The knee of a spec: deterministic; a left knee is the mirrored right one."""
    if spec.side == "left":
        return _mirror_knee(make_knee(replace(spec, side="right")))
    rng = np.random.default_rng([spec.seed, 1])
    shape = draw_shape(rng)
    scale = _draw_scale(rng, spec.sex)
    solids, bones = _right_bones(spec, shape, scale)
    return KneeAnatomy(
        spec,
        MappingProxyType(bones),
        MappingProxyType(_landmarks(solids, bones, scale)),
        MappingProxyType(_curves(scale)),
        MappingProxyType(solids),
        scale,
        shape,
    )


def _mirror_knee(knee: KneeAnatomy) -> KneeAnatomy:
    """The left knee of a right one."""
    still = np.zeros(3)
    return KneeAnatomy(
        replace(knee.spec, side="left"),
        MappingProxyType({name: mirror_mesh(mesh) for name, mesh in knee.bones.items()}),
        MappingProxyType({name: point * MIRROR for name, point in knee.landmarks.items()}),
        MappingProxyType({name: curve * MIRROR for name, curve in knee.curves.items()}),
        MappingProxyType({name: Scaled(f, MIRROR, still) for name, f in knee.solids.items()}),
        knee.scale * MIRROR,
        knee.shape,
    )


def mirror_mesh(mesh: TriangleMesh) -> TriangleMesh:
    """The mesh of the other side of the body, its normals still outward."""
    return TriangleMesh(mesh.vertices_mm * MIRROR, mesh.faces[:, ::-1], mesh.normals * MIRROR)


def _draw_scale(rng: np.random.Generator, sex: Sex) -> FloatArray:
    """(3,) size factors: 4 % between people, men larger and relatively longer front to back."""
    size = 1.0 + 0.04 * float(np.clip(rng.standard_normal(), -1.2, 1.2))
    aspect = 1.0 + 0.02 * np.clip(rng.standard_normal(3), -1.5, 1.5)
    mean = np.array([1.0, 0.93, 1.0]) if sex == "female" else np.array([1.1, 0.98, 1.08])
    factors: FloatArray = size * mean * np.array([1.0, aspect[1], aspect[2]])
    return factors


def _right_bones(
    spec: KneeSpec, shape: ShapeDraws, scale: FloatArray
) -> tuple[dict[str, Field], dict[str, TriangleMesh]]:
    """Solids and meshes; tibia and patella are set off from the femur by the joint gaps."""
    solids: dict[str, Field] = {}
    bones: dict[str, TriangleMesh] = {}

    def add(name: str, proportions: Field, lower: list[float], upper: list[float]) -> None:
        rng = np.random.default_rng([spec.seed, 2, len(solids)])
        solid = Scaled(proportions, scale, np.zeros(3))
        solids[name] = _add_relief(solid, name, spec, rng, scale)
        bones[name] = mesh_solid(
            solids[name], np.array(lower) * scale, np.array(upper) * scale, CELL_MM
        )
        if name != "femur":
            away = np.array([0.0, 0.0, -1.0] if name == "tibia" else [0.0, -1.0, 0.0])
            move = _settling_mm(bones["femur"], bones[name], away) * away
            mesh = bones[name]
            bones[name] = TriangleMesh(mesh.vertices_mm + move, mesh.faces, mesh.normals)
            solids[name] = Scaled(solids[name], np.ones(3), move)

    add("femur", make_femur(shape), [-48.0, -40.0, -34.0], [48.0, 48.0, 104.0])
    around = bones["femur"].vertices_mm / scale
    medial, lateral = _plateau_levels(shape, around)
    z = 0.5 * (medial + lateral)
    proportions = make_tibia(shape, medial, lateral)
    add("tibia", proportions, [-46.0, -32.0, z - 114.0], [46.0, 42.0, z + 16.0])
    y, z = _ridge_y(shape, around), PATELLA_Z_MM
    proportions = make_patella(shape, y)
    add("patella", proportions, [-34.0, y - 28.0, z - 30.0], [34.0, y + 6.0, z + 30.0])
    return solids, bones


def _settling_mm(femur: TriangleMesh, bone: TriangleMesh, away: FloatArray) -> float:
    """How far the bone must move in the direction `away` to be a joint gap from the femur."""
    from scipy.spatial import cKDTree

    tree = cKDTree(femur.vertices_mm)
    distances = np.asarray(tree.query(bone.vertices_mm, distance_upper_bound=12.0)[0])
    near = bone.vertices_mm[distances < 12.0]
    move = 0.0
    for _ in range(4):
        move += JOINT_GAP_MM - float(np.min(tree.query(near + move * away)[0]))
    return move


def _add_relief(
    solid: Field, name: str, spec: KneeSpec, rng: np.random.Generator, scale: FloatArray
) -> Field:
    """The solid with relief, and with osteophytes when old."""
    relief = make_waves(rng, RELIEF_RMS_MM[spec.age_group], (6.0, 25.0))
    if spec.age_group != "old":
        return Rough(solid, relief)
    rims = project(solid, _rim_points(name, rng) * scale)
    bumps = Bumps(rims, rng.uniform(1.8, 3.2, len(rims)), rng.uniform(1.0, 2.6, len(rims)))
    return Rough(Rough(solid, relief), bumps)


def _rim_points(name: str, rng: np.random.Generator) -> FloatArray:
    """(M, 3) places near the rims of the joint surfaces, in the proportions of `bone_shapes`."""
    if name == "femur":
        angle = rng.uniform(-0.3, 2.6, 12)
        side = np.where(np.arange(12) % 2 == 0, 34.0, -34.0)
        y, z = 4.0 - 28.0 * np.sin(angle - 0.9), -2.0 - 20.0 * np.cos(angle - 0.9)
        return np.stack([side, y, z], axis=1)
    if name == "tibia":
        angle = rng.uniform(0.0, 2.0 * np.pi, 12)
        return np.stack(
            [36.0 * np.cos(angle), 6.0 + 25.0 * np.sin(angle), np.full(12, -33.0)], axis=1
        )
    angle = rng.uniform(0.0, np.pi, 6)
    return np.stack(
        [22.0 * np.cos(angle), np.full(6, -38.0), PATELLA_Z_MM + 20.0 * np.sin(angle)], axis=1
    )


def _plateau_levels(shape: ShapeDraws, femur_vertices: FloatArray) -> tuple[float, float]:
    """Levels at which the medial and the lateral plateau just keep the gap from the femur."""
    levels = []
    for sign in (1.0, -1.0):
        above = femur_vertices[(sign * femur_vertices[:, 0] > 10.0) & (femur_vertices[:, 2] < 0.0)]
        levels.append(
            _clear_level(
                lambda p: compute_plateau_height(shape, 0.0, 0.0, p), above, 2, JOINT_GAP_MM
            )
        )
    return levels[0], levels[1]


def _ridge_y(shape: ShapeDraws, femur_vertices: FloatArray) -> float:
    """Where the patella's ridge lies so that the gap to the trochlea is kept."""
    near = femur_vertices[
        (np.abs(femur_vertices[:, 0]) < 26.0)
        & (np.abs(femur_vertices[:, 2] - PATELLA_Z_MM) < 22.0)
        & (femur_vertices[:, 1] < 0.0)
    ]
    return _clear_level(lambda p: compute_patella_back(shape, p), near, 1, JOINT_GAP_MM)


def _clear_level(height_mm: Field, points: FloatArray, axis: int, gap_mm: float) -> float:
    """By how much a height field may be raised until it is a gap short of the nearest point."""
    clearance = points[:, axis] - height_mm(points)
    distance = Below(height_mm, axis)(points)
    steepness = clearance / np.where(distance == 0.0, 1.0, distance)
    return float((clearance - gap_mm * steepness).min())


def _landmarks(
    solids: Mapping[str, Field], bones: Mapping[str, TriangleMesh], scale: FloatArray
) -> dict[str, FloatArray]:
    """Extreme points of the meshes where they are defined so, projected guesses elsewhere."""
    femur, tibia = (bones[name].vertices_mm for name in ("femur", "tibia"))
    level = np.abs(femur[:, 2]) < 12.0
    medial, lateral = femur[:, 0] > 0.0, femur[:, 0] < 0.0
    found = {
        "femur/medial_epicondyle": _extreme(femur, level, 0, 1.0),
        "femur/lateral_epicondyle": _extreme(femur, level, 0, -1.0),
        "femur/medial_condyle": _extreme(femur, medial, 2, -1.0),
        "femur/lateral_condyle": _extreme(femur, lateral, 2, -1.0),
        "femur/medial_posterior_condyle": _extreme(femur, medial, 1, 1.0),
        "femur/lateral_posterior_condyle": _extreme(femur, lateral, 1, 1.0),
        "tibia/tubercle": _extreme(tibia, tibia[:, 2] < tibia[:, 2].max() - 30.0, 1, -1.0),
        "tibia/eminence": _extreme(tibia, np.abs(tibia[:, 0]) < 12.0, 2, 1.0),
        "patella/centre": bones["patella"].centroid_mm,
    }
    plateau_z = float(found["femur/medial_condyle"][2] / scale[2]) - 5.0
    guesses = {
        "femur/notch": [0.0, 4.0, -18.0],
        "femur/trochlea": [-2.0, -20.0, 4.0],
        "femur/anterior_cortex": [0.0, -24.0, 50.0],
        "tibia/medial_plateau": [20.0, 6.0, plateau_z],
        "tibia/lateral_plateau": [-20.0, 6.0, plateau_z],
        "patella/ridge": [0.0, float(found["patella/centre"][1] / scale[1]) + 11.0, PATELLA_Z_MM],
    }
    for name, guess in guesses.items():
        solid = solids[name.split("/")[0]]
        found[name] = project(solid, np.array([guess]) * scale, iterations=12)[0]
    return found


def _extreme(
    vertices: FloatArray,
    among: np.ndarray[tuple[int, ...], np.dtype[np.bool_]],
    axis: int,
    sign: float,
) -> FloatArray:
    """The vertex that lies furthest along sign * axis among the marked ones."""
    candidates = vertices[among]
    result: FloatArray = candidates[int(np.argmax(sign * candidates[:, axis]))].copy()
    return result


def _curves(scale: FloatArray) -> dict[str, FloatArray]:
    """Vessels and nerves in the hollow of the knee."""
    z = np.linspace(90.0, -110.0, 41)
    bend = np.exp(-((z / 45.0) ** 2))
    artery = np.stack([2.0 + 5.0 * np.tanh(z / 60.0), 26.0 + 22.0 * bend, z], axis=1)
    vein = artery + np.array([-3.0, 6.0, 0.0])
    nerve = np.stack([-2.0 - 2.0 * np.tanh(z / 60.0), 40.0 + 22.0 * bend, z], axis=1)
    peroneal = np.stack(
        [-20.0 - 20.0 * (1.0 - z / 90.0) / 2.2, 44.0 - 8.0 * (1.0 - bend), z], axis=1
    )
    curves = {
        "popliteal_artery": artery,
        "popliteal_vein": vein,
        "tibial_nerve": nerve,
        "common_peroneal_nerve": peroneal,
    }
    return {name: curve * scale for name, curve in curves.items()}
