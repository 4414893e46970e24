"""Cartilage on the joint surfaces: what a camera sees and a CT does not."""

import numpy as np

from navapp.errors import UsageError
from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.transform import FloatArray
from sim_devices.anatomy import KneeAnatomy
from sim_devices.bone_shapes import PATELLA_Z_MM
from sim_devices.relief import make_waves
from sim_devices.textures import make_smooth_noise

MAXIMUM_MM = 3.2
MAXIMUM_MEAN_MM = 2.6


def smoothstep(low: float, high: float, value: FloatArray) -> FloatArray:
    """0 at `low`, 1 at `high` (which may be the smaller one), smooth between."""
    t = np.clip((value - low) / (high - low), 0.0, 1.0)
    result: FloatArray = t * t * (3.0 - 2.0 * t)
    return result


def compute_articular_weight(anatomy: KneeAnatomy, bone: str) -> FloatArray:
    """(V,) 1 on the bone's joint surface, 0 elsewhere, smooth at its border.

    Raises:
        UsageError: the anatomy has no such bone.
    """
    if bone not in anatomy.bones:
        known = ", ".join(anatomy.bones)
        raise UsageError(f"no bone is named {bone!r}", subject=bone, remedy=f"use one of {known}")
    mesh = anatomy.bones[bone]
    place = mesh.vertices_mm / anatomy.scale
    normals = mesh.normals * np.sign(anatomy.scale)
    if bone == "femur":
        return _femur_weight(place, normals)
    if bone == "tibia":
        rim = float(anatomy.landmarks["tibia/medial_plateau"][2] / anatomy.scale[2])
        upwards = smoothstep(0.6, 0.85, normals[:, 2]) * smoothstep(-9.0, -6.0, place[:, 2] - rim)
        beside: FloatArray = upwards * smoothstep(5.0, 10.0, np.abs(place[:, 0]))
        return beside
    backwards = smoothstep(0.5, 0.8, normals[:, 1])
    result: FloatArray = backwards * smoothstep(-12.0, -8.0, place[:, 2] - PATELLA_Z_MM)
    return result


def _femur_weight(place: FloatArray, normals: FloatArray) -> FloatArray:
    """Trochlea, distal and posterior condyles; not the sides, the notch and the shaft."""
    x, y, z = place.T
    tread = smoothstep(0.85, 0.6, np.abs(normals[:, 0]))
    away = np.stack([y - 3.0, z - 4.0], axis=1)
    away /= np.linalg.norm(away, axis=1, keepdims=True)
    outward = smoothstep(0.1, 0.4, np.einsum("ij,ij->i", away, normals[:, 1:]))
    upper_end = 15.0 - 5.0 * smoothstep(0.0, 15.0, y)
    below = smoothstep(2.0, -2.0, z - upper_end)
    in_notch = smoothstep(10.0, 7.5, np.abs(x + 1.0)) * smoothstep(-2.0, 3.0, y)
    result: FloatArray = tread * outward * below * (1.0 - in_notch)
    return result


def make_cartilage_thickness_mm(
    anatomy: KneeAnatomy, bone: str, mean_mm: float, seed: int
) -> FloatArray:
    """(V,) thickness per vertex: `mean_mm` over the joint surface, varying by some 30 % there.

    Raises:
        UsageError: an unknown bone, or a mean outside 0 to 2.6 mm.
    """
    if not 0.0 <= mean_mm <= MAXIMUM_MEAN_MM:
        raise UsageError(
            f"a mean cartilage thickness of {mean_mm} mm is not possible",
            remedy=f"give 0 to {MAXIMUM_MEAN_MM} mm",
        )
    weight = compute_articular_weight(anatomy, bone)
    vertices = anatomy.bones[bone].vertices_mm
    variation = make_waves(np.random.default_rng([seed, 3]), 0.3, (30.0, 80.0))
    thickness = weight * np.clip(1.0 + variation(vertices), 0.3, 1.7) * mean_mm
    articular = weight > 0.5
    for _ in range(8 if mean_mm > 0.0 else 0):
        thickness *= mean_mm / thickness[articular].mean()
        thickness = np.minimum(thickness, MAXIMUM_MM)
    return thickness


def wear_patch(
    mesh: TriangleMesh, thickness_mm: FloatArray, centre_mm: FloatArray, radius_mm: float
) -> FloatArray:
    """(V,) thickness with a bare patch of the given radius, sloping at its border."""
    distance = np.linalg.norm(mesh.vertices_mm - centre_mm, axis=1)
    result: FloatArray = thickness_mm * smoothstep(0.8 * radius_mm, 1.2 * radius_mm, distance)
    return result


def make_worn_patch(femur: TriangleMesh, centre_mm: FloatArray, radius_mm: float) -> FloatArray:
    """(V,) 0 to 1: an irregular worn patch round a point of the surface."""
    offset = femur.vertices_mm - centre_mm
    ragged = 1.0 + 0.25 * make_smooth_noise(femur.vertices_mm, 13.0, 5)
    distance = np.linalg.norm(offset * (1.0, 0.7, 0.7), axis=1) / (radius_mm * ragged)
    worn: FloatArray = np.clip((1.25 - distance) / 0.5, 0.0, 1.0)
    return worn


def with_cartilage(mesh: TriangleMesh, thickness_mm: FloatArray) -> TriangleMesh:
    """The surface of the cartilage: vertices moved outwards along their normals."""
    if not np.any(thickness_mm):
        return mesh
    return TriangleMesh(mesh.vertices_mm + thickness_mm[:, None] * mesh.normals, mesh.faces)


def with_defect(
    mesh: TriangleMesh, thickness_mm: FloatArray, centre_mm: FloatArray, radius_mm: float
) -> TriangleMesh:
    """The surface of cartilage that is worn off around a point of the bone."""
    return with_cartilage(mesh, wear_patch(mesh, thickness_mm, centre_mm, radius_mm))
