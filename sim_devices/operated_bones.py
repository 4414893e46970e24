"""The bones as they are after the steps that have been made, with their components."""

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.mesh_sections import clip_below
from navapp.geometry.transform import FloatArray
from sim_devices.drilled_hole import HOLE_DEPTH_MM, HOLE_RADIUS_MM, drill_hole
from sim_devices.fitted_parts import FittedParts
from sim_devices.materials import MaterialId
from sim_devices.planned_cuts import Cut
from sim_devices.renderer import Part
from sim_devices.sawn_bone import cut_skin, make_sawn_face
from sim_devices.site import Site
from sim_devices.tools import across


# Three bones, now and before the last step, which has changed one of them.
@lru_cache(maxsize=6)
def make_bone(
    site: Site, fitted: FittedParts, bone: str, made: tuple[str, ...]
) -> tuple[Part, ...]:
    """The parts of a bone: its skin first, the hole, the faces of its cuts, its component.

    Args:
        site: of the operation.
        fitted: its components.
        bone: which.
        made: names of the steps of that bone that have been made.
    """
    cuts = [site.made[name] for name in made if name in site.made]
    if "femoral_implant" in made:
        cuts += fitted.rasped
    has_hole = "femoral_guide" in made
    intact = site.bones[bone]
    skin, walls = intact, []
    if has_hole:
        skin, wall, depth_mm = drill_hole(intact, *site.made_hole)
        walls = [_make_wall(wall, depth_mm, site, cuts)]
    skin = cut_skin(skin, cuts)
    # Faces are cut, vertices only added: the first ones are those of the intact bone.
    mark = np.zeros(len(skin.vertices_mm))
    if bone == "femur":
        mark[: len(site.worn)] = site.worn
    whole = Part(bone, skin, skin_material(site), mark=mark if bone == "femur" else None)
    faces = _make_faces(intact, bone, cuts, site.made_hole if has_hole else None)
    return (whole, *walls, *faces, *_make_component(fitted, bone, made))


def skin_material(site: Site) -> MaterialId:
    """What the surface of the bones is made of."""
    return MaterialId.CARTILAGE if site.is_covered else MaterialId.BONE


def _make_component(fitted: FittedParts, bone: str, made: tuple[str, ...]) -> tuple[Part, ...]:
    if "femoral_implant" in made:
        return (Part(bone, fitted.femoral_component, MaterialId.METAL),)
    if "patellar_implant" in made:
        return (Part(bone, fitted.patellar_button, MaterialId.PLASTIC),)
    if "spacer" in made:
        tray, insert = fitted.tray_and_insert
        return Part(bone, tray, MaterialId.METAL), Part(bone, insert, MaterialId.PLASTIC)
    return ()


def _make_faces(
    intact: TriangleMesh,
    bone: str,
    cuts: Sequence[Cut],
    hole: tuple[FloatArray, FloatArray] | None,
) -> list[Part]:
    """The faces of the cuts, open where the hole is."""
    parts = []
    for cut in cuts:
        face = make_sawn_face(intact, cut, [other for other in cuts if other is not cut])
        if face is None:
            continue
        mesh, cortex = face.mesh, face.cortex
        if hole is not None:
            mesh = clip_below(mesh, _within_hole_mm(mesh.vertices_mm, *hole))
            cortex = np.append(cortex, np.zeros(len(mesh.vertices_mm) - len(cortex)))
        parts.append(Part(bone, mesh, MaterialId.SAWN_BONE, mark=cortex))
    return parts


def _within_hole_mm(points_mm: FloatArray, entry_mm: FloatArray, axis: FloatArray) -> FloatArray:
    """(N,) how far points lie within the hole's wall; negative outside and below its bottom."""
    offset = points_mm - entry_mm
    u, v = across(axis)
    within = HOLE_RADIUS_MM - np.hypot(offset @ u, offset @ v)
    return np.where(offset @ axis < HOLE_DEPTH_MM, within, -1.0)


def _make_wall(wall: TriangleMesh, depth_mm: FloatArray, site: Site, cuts: Sequence[Cut]) -> Part:
    """The wall of the hole where the bone is left, darker towards its bottom."""
    for cut in cuts:
        wall = clip_below(wall, cut.heights_mm(wall.vertices_mm))
    entry_mm, axis = site.made_hole
    added_mm = np.maximum((wall.vertices_mm[len(depth_mm) :] - entry_mm) @ axis, 0.0)
    depth_mm = np.append(depth_mm, added_mm)
    return Part(
        "femur",
        wall,
        MaterialId.SPONGY_BONE,
        mark=np.clip(depth_mm / HOLE_DEPTH_MM, 0.0, 1.0),
        exposure=1.0 / (1.0 + (depth_mm / 7.0) ** 2),
    )
