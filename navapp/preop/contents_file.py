"""Reads a contents file: the planned operation in TOML, coordinates LPS, mm."""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TypeVar

import numpy as np

from navapp.config import read_toml, validate
from navapp.errors import ConfigurationError, PlanError
from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.ply import read_ply
from navapp.geometry.transform import RigidTransform, rotation_from_vector
from navapp.preop.contents_file_tables import (
    CentreTable,
    ContentsTables,
    DefectTable,
    PartTable,
    RiskTable,
)
from navapp.preop.defects import paint_near, paint_within
from navapp.preop.planned_content import PlannedContent
from navapp.preop.surface_import import convert_to_lps
from navapp.values import (
    ANKLE_CENTRE,
    HIP_CENTRE,
    BoneModel,
    Defect,
    Landmark,
    Part,
    RiskStructure,
    Shape,
    SurgicalContent,
)
from navapp.values.contents import PartKind

T = TypeVar("T")


def read_contents(path: str | Path, bones: Mapping[str, BoneModel]) -> PlannedContent:
    """Read a contents file for the bones of a plan; file names in it are relative to its folder.

    Raises:
        PlanError: missing, not TOML, an unknown key, a wrong value, a name given twice, a bone
            that the plan does not have; one sentence with the key's path.
        InputError: a surface that it names is missing or damaged.
    """
    path = Path(path)
    tables = _tables(path)
    _check_bones(tables, bones, path)
    warnings: list[str] = []
    kinds: tuple[tuple[PartKind, tuple[PartTable, ...]], ...] = (
        ("implant", tables.implant),
        ("spacer", tables.spacer),
    )
    parts = [(one.name, _part(kind, one, path, warnings)) for kind, some in kinds for one in some]
    risks = [(one.name, _risk(one, path, warnings)) for one in tables.risk]
    defects = [(one.name, _defect(one, bones[one.bone], path)) for one in tables.defect]
    content = SurgicalContent(
        planes=_index_by_name(path, "plane", [(one.name, one.value()) for one in tables.plane]),
        drills=_index_by_name(path, "drill", [(one.name, one.value()) for one in tables.drill]),
        parts=_index_by_name(path, "part", parts),
        risks=_index_by_name(path, "risk", risks),
        landmarks=_index_by_name(path, "landmark", _landmarks(tables)),
        defects=_index_by_name(path, "defect", defects),
        stages={name: one.value() for name, one in tables.stage if one is not None},
    )
    return PlannedContent(
        content,
        _index_by_name(
            path, "target", [(one.name, np.array(one.points_mm)) for one in tables.target]
        ),
        {one.name: np.array(one.curve_mm) for one in tables.risk if one.curve_mm is not None},
        tuple(name for name, centre in _centres(tables) if centre is not None and centre.absent),
        tuple(warnings),
    )


def _tables(path: Path) -> ContentsTables:
    try:
        return validate(ContentsTables, read_toml(path, "contents file"), str(path))
    except ConfigurationError as error:
        # It is an input like a surface is, and no configuration.
        raise PlanError(error.problem, subject=error.subject, remedy=error.remedy) from error


def _check_bones(tables: ContentsTables, bones: Mapping[str, BoneModel], path: Path) -> None:
    """Refuse what belongs to a bone that the plan does not have."""
    for kind in ("plane", "drill", "implant", "spacer", "risk", "defect"):
        for number, one in enumerate(getattr(tables, kind)):
            if one.bone not in bones:
                raise PlanError(
                    f"{path}: {kind}.{number}.bone: the plan has no {one.bone}",
                    subject=f"{kind}.{number}.bone",
                    remedy=f"give its surface, or leave '{one.name}' out",
                )


def _index_by_name(path: Path, kind: str, entries: Iterable[tuple[str, T]]) -> dict[str, T]:
    """By name, each once."""
    found: dict[str, T] = {}
    for name, value in entries:
        if name in found:
            raise PlanError(
                f"{path}: {kind} '{name}' is given twice",
                subject=name,
                remedy="give each a name of its own",
            )
        found[name] = value
    return found


def _centres(tables: ContentsTables) -> tuple[tuple[str, CentreTable | None], ...]:
    return ((HIP_CENTRE, tables.hip), (ANKLE_CENTRE, tables.ankle))


def _landmarks(tables: ContentsTables) -> list[tuple[str, Landmark]]:
    centres = [(name, None if one is None else one.value()) for name, one in _centres(tables)]
    return [
        *((one.name, one.value()) for one in tables.landmark),
        *((name, centre) for name, centre in centres if centre is not None),
    ]


def _part(kind: PartKind, table: PartTable, path: Path, warnings: list[str]) -> Part:
    shape: Shape
    if table.shape is not None:
        shape = table.shape.value()
    else:
        shape = _surface(path.parent / (table.file or ""), warnings, is_own_frame=True)
    rotation = rotation_from_vector(np.radians(table.rotation_deg))
    return Part(
        kind, shape, RigidTransform.from_parts(table.bone, table.name, rotation, table.position_mm)
    )


def _risk(table: RiskTable, path: Path, warnings: list[str]) -> RiskStructure:
    mesh = None if table.file is None else _surface(path.parent / table.file, warnings)
    return RiskStructure(table.bone, table.safety_mm, mesh)


def _surface(path: Path, warnings: list[str], *, is_own_frame: bool = False) -> TriangleMesh:
    """A surface in LPS; one in a frame of its own is taken as it is."""
    mesh, header = read_ply(path)
    if not len(mesh.faces):
        raise PlanError(f"{path} holds no triangles", subject=str(path), remedy="export a surface")
    return mesh if is_own_frame else convert_to_lps(mesh, header, path, warnings)


def _defect(table: DefectTable, bone: BoneModel, path: Path) -> Defect:
    painted = (
        paint_near(bone.mesh, np.array(table.points_mm))
        if table.outline_mm is None
        else paint_within(bone.mesh, np.array(table.outline_mm))
    )
    if not len(painted):
        raise PlanError(
            f"{path}: defect '{table.name}' paints nothing of the {table.bone}",
            subject=table.name,
            remedy="give it in the bone's coordinates: LPS, mm",
        )
    return Defect(table.bone, painted)
