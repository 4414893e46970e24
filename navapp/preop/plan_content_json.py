"""Surgical content inside a plan folder: plain JSON, and one PLY file for every surface in it."""

from collections.abc import Callable, Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.ply import read_ply, write_ply
from navapp.geometry.transform import RigidTransform
from navapp.preop.plan_integrity import make_damage_error, sha256_of
from navapp.values import (
    Box,
    Cylinder,
    Defect,
    DrillAxis,
    Landmark,
    Part,
    ResectionPlane,
    RiskStructure,
    Shape,
    Sphere,
    StageContent,
    SurgicalContent,
)

_SHAPES: Mapping[str, type[Box | Cylinder | Sphere]] = {
    "box": Box,
    "cylinder": Cylinder,
    "sphere": Sphere,
}

T = TypeVar("T")


def content_to_json(content: SurgicalContent, folder: Path) -> dict[str, Any]:
    """The content as JSON; its surfaces are written beside as `content_<number>.ply`."""
    written: list[Path] = []

    def plain(value: Any) -> Any:
        if isinstance(value, TriangleMesh):
            written.append(folder / f"content_{len(written) + 1}.ply")
            write_ply(written[-1], value)
            return {"file": written[-1].name, "sha256": sha256_of(written[-1])}
        if isinstance(value, RigidTransform):
            return {
                "target": value.target,
                "source": value.source,
                "matrix": value.matrix.tolist(),
            }
        if isinstance(value, Box | Cylinder | Sphere):
            return {"kind": type(value).__name__.lower(), **_fields(value, plain)}
        if isinstance(value, Mapping):
            return {key: plain(item) for key, item in value.items()}
        if is_dataclass(value):
            return _fields(value, plain)
        return value.tolist() if isinstance(value, np.ndarray) else value

    result: dict[str, Any] = plain(content)
    return result


def content_from_json(entries: Mapping[str, Any], folder: Path) -> SurgicalContent:
    """The content of a plan folder.

    Raises:
        PlanError: a surface is missing or was changed.
        KeyError, TypeError, ValueError: not what `content_to_json` writes.
    """
    return SurgicalContent(
        planes=_each(entries["planes"], ResectionPlane),
        drills=_each(entries["drills"], DrillAxis),
        parts={name: _part(entry, folder) for name, entry in entries["parts"].items()},
        risks={name: _risk(entry, folder) for name, entry in entries["risks"].items()},
        landmarks=_each(entries["landmarks"], Landmark),
        defects=_each(entries["defects"], Defect),
        stages=_each(entries["stages"], StageContent),
    )


def _fields(value: Any, plain: Callable[[Any], Any]) -> dict[str, Any]:
    return {one.name: plain(getattr(value, one.name)) for one in fields(value)}


def _each(entries: Mapping[str, Mapping[str, Any]], kind: Callable[..., T]) -> dict[str, T]:
    return {name: kind(**entry) for name, entry in entries.items()}


def _part(entry: Mapping[str, Any], folder: Path) -> Part:
    shape = dict(entry["shape"])
    read: Shape = (
        _surface(shape, folder) if "file" in shape else _SHAPES[shape.pop("kind")](**shape)
    )
    return Part(entry["kind"], read, RigidTransform(**entry["bone_from_part"]))


def _risk(entry: Mapping[str, Any], folder: Path) -> RiskStructure:
    mesh = None if entry["mesh"] is None else _surface(entry["mesh"], folder)
    return RiskStructure(entry["bone"], entry["safety_mm"], mesh)


def _surface(entry: Mapping[str, Any], folder: Path) -> TriangleMesh:
    path = folder / entry["file"]
    if not path.is_file() or sha256_of(path) != entry["sha256"]:
        raise make_damage_error(folder, f"{entry['file']} is missing, changed or cut short")
    return read_ply(path)[0]
