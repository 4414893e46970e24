"""Simulated knees as bones of a plan: the landmarks of the simulator judge ours."""

from collections.abc import Sequence
from functools import cache

import numpy as np

from navapp.geometry.mesh import TriangleMesh
from navapp.values import BoneModel
from sim_devices.anatomy import KneeAnatomy, KneeSpec, make_knee
from tests.geometry.shapes import sphere

SEEDS = range(1, 11)


SPECS = [
    KneeSpec(seed, side, ("female", "male")[seed % 2], ("young", "middle", "old")[seed % 3])
    for seed in SEEDS
    for side in ("right", "left")
]


class Knees(Sequence[KneeAnatomy]):
    """Made when they are looked at: one takes a second."""

    def __len__(self) -> int:
        return len(SPECS)

    def __getitem__(self, index):
        if isinstance(index, slice):
            return [knee_of(spec) for spec in SPECS[index]]
        return knee_of(SPECS[index])


@cache
def knee_of(spec: KneeSpec) -> KneeAnatomy:
    return make_knee(spec)


def knees() -> Knees:
    """Ten people, both knees of each: women and men, young, middle and old."""
    return Knees()


def bones_of(knee: KneeAnatomy) -> dict[str, BoneModel]:
    return {name: BoneModel(name, mesh, knee.spec.side) for name, mesh in knee.bones.items()}


def fibula_of(knee: KneeAnatomy) -> TriangleMesh:
    """Outward and behind the tibia, below its plateau, where a fibula's head is."""
    outward = -1.0 if knee.spec.side == "right" else 1.0
    head = knee.bones["tibia"].centroid_mm + np.array([30.0 * outward, 20.0, 0.0])
    ball = sphere(9.0, 10)
    return TriangleMesh(ball.vertices_mm * np.array([1.0, 1.0, 4.0]) + head, ball.faces)


def obliquely_cut(knee: KneeAnatomy, is_capped: bool) -> dict[str, BoneModel]:
    """Shafts cut 25 deg off their axis; closed flat, or with a dome that is marked as removed."""
    bones = bones_of(knee)
    for name, sign in (("femur", 1.0), ("tibia", -1.0)):
        mesh = knee.bones[name]
        across = np.array([np.sin(np.radians(25.0)), 0.0, sign * np.cos(np.radians(25.0))])
        beyond = np.maximum(mesh.vertices_mm @ across - 88.0, 0.0)
        squeezed = mesh.vertices_mm - (1.0 if is_capped else 0.5) * beyond[:, None] * across
        cut = TriangleMesh(squeezed, mesh.faces)
        is_removed = (beyond > 0.0) & (not is_capped)
        bones[name] = BoneModel(name, cut, knee.spec.side, is_removed=is_removed)
    return bones


def turned(mesh: TriangleMesh, signs: tuple[int, int, int]) -> TriangleMesh:
    """With axes reversed: two of them turn the bone round, one or three mirror it."""
    faces = mesh.faces if np.prod(signs) > 0 else mesh.faces[:, ::-1]
    return TriangleMesh(mesh.vertices_mm * np.array(signs, dtype=float), faces)
