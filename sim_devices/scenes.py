"""What is seen of an operation: bones in their state, tissue round them, instruments, cloths."""

from dataclasses import dataclass

import numpy as np

from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.transform import FloatArray, RigidTransform
from sim_devices.fitted_parts import FittedParts
from sim_devices.layout import select_side
from sim_devices.materials import MaterialId
from sim_devices.operated_bones import make_bone
from sim_devices.operation import State
from sim_devices.renderer import Part
from sim_devices.site import Site
from sim_devices.tissue import SKIN_BELOW_TOP_MM, Sheet, make_drape, make_tissue, trim
from sim_devices.tools import (
    hand_meshes,
    make_bloody_fingers,
    make_chuck_mesh,
    make_drill_mesh,
)

# How far from the joint line the surgeon laid the bones bare: for the drill, and for the saw.
_BARE_FEMUR_MM, _CLEARED_FEMUR_MM = 62.0, 78.0
_BARE_TIBIA_MM, _CLEARED_TIBIA_MM = 27.0, 62.0
# Middle of the wound, in the table's frame: further up to saw the femur, further down to saw the
# tibia, and between femur and patella when that lies beside it.
_WOUND_MM = {
    "opening": (0.0, 0.0, 0.0),
    "drilling": (0.0, 0.0, 0.0),
    "implant": (0.0, -14.0, 0.0),
    "patella": (-25.0, -14.0, 0.0),
    "spacer": (0.0, 6.0, 0.0),
}


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """A state of the operation as it is drawn, as for a right knee."""

    parts: tuple[Part, ...]
    tissue_top_mm: float  # z of the table's frame, of what is nearest to the cameras


def make_scene(site: Site, fitted: FittedParts, state: State) -> Scene:
    """All parts of a state."""
    femur_from_tibia = fitted.femur_from_tibia if state.is_made("spacer") else site.femur_from_tibia
    femur = site.table_from_femur
    laid = {"femur": femur, "tibia": femur @ femur_from_tibia}
    if state.stage == "patella":
        laid["patella"] = femur @ site.femur_from_patella
    bones = {name: make_bone(site, fitted, name, state.made_of(name)) for name in laid}
    tissue, drape = _lay_tissue(site, state.stage, bones, laid)
    glove, tool = hand_meshes()
    parts = (
        *bones["femur"],
        *(_drilling_machine() if state.stage == "drilling" else ()),
        *bones["tibia"],
        Part("tissue", tissue.mesh, MaterialId.TISSUE, tissue.mark, tissue.exposure),
        Part("drape", drape.mesh, MaterialId.DRAPE, drape.mark, drape.exposure),
        Part("hand", glove, MaterialId.GLOVE, mark=make_bloody_fingers(glove)),
        Part("hand", tool, MaterialId.STEEL),
        *bones.get("patella", ()),
    )
    return Scene(parts, float(tissue.mesh.vertices_mm[:, 2].min()))


def _drilling_machine() -> tuple[Part, Part]:
    return (
        Part("drill", make_drill_mesh(), MaterialId.STEEL),
        Part("chuck", make_chuck_mesh(), MaterialId.HANDLE),
    )


def _lay_tissue(
    site: Site,
    stage: str,
    bones: dict[str, tuple[Part, ...]],
    laid: dict[str, RigidTransform],
) -> tuple[Sheet, Sheet]:
    """Tissue and drape round the bones, in the table's frame."""
    middle = np.array(_WOUND_MM[stage])
    laid = {name: _shift(pose, -middle) for name, pose in laid.items()}
    on_table, exposed, freed = [], [], []
    for name, parts in bones.items():
        for mesh in _solid_meshes(site, name, parts):
            bare = _laid_bare(site, name, mesh, is_cleared=_is_sawn(parts)).transform(laid[name])
            on_table.append(mesh.transform(laid[name]))
            exposed.append(bare)
            # Of what is sawn, and of the patella, everything up to the rim is seen.
            freed += [bare] if _is_sawn(parts) or name == "patella" else []
    tissue = make_tissue(exposed, on_table, site.seed, freed)
    top = -min(float(mesh.vertices_mm[mesh.faces, 2].min()) for mesh in on_table)
    drape = make_drape(tissue, top - SKIN_BELOW_TOP_MM - 11.0, site.seed)
    return _move(trim(tissue), middle), _move(drape, middle)


def _is_sawn(parts: tuple[Part, ...]) -> bool:
    return any(part.material is MaterialId.SAWN_BONE for part in parts)


def _solid_meshes(site: Site, bone: str, parts: tuple[Part, ...]) -> list[TriangleMesh]:
    """What tissue lies against: of a bone that is not sawn all of it, hole or not."""
    return [part.mesh for part in parts] if _is_sawn(parts) else [site.bones[bone]]


def _laid_bare(site: Site, bone: str, mesh: TriangleMesh, *, is_cleared: bool) -> TriangleMesh:
    """What of a bone's part the surgeon has laid bare."""
    levels = site.bones[bone].vertices_mm[:, 2]
    if bone == "femur":
        bare_mm = _CLEARED_FEMUR_MM if is_cleared else _BARE_FEMUR_MM
        return select_side(mesh, float(levels.min()) + bare_mm, -1.0)
    if bone == "tibia":
        bare_mm = _CLEARED_TIBIA_MM if is_cleared else _BARE_TIBIA_MM
        return select_side(mesh, float(levels.max()) - bare_mm, 1.0)
    return mesh


def _shift(pose: RigidTransform, by_mm: FloatArray) -> RigidTransform:
    return RigidTransform.from_parts(
        pose.target, pose.source, pose.rotation, pose.translation_mm + by_mm
    )


def _move(sheet: Sheet, by_mm: FloatArray) -> Sheet:
    mesh = sheet.mesh
    moved = TriangleMesh(mesh.vertices_mm + by_mm, mesh.faces, mesh.normals)
    return Sheet(moved, sheet.mark, sheet.exposure)
