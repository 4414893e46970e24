"""Reads and writes plan folders: plan.json, a PLY file and a picture per bone."""

import hashlib
import json
import shutil
import tempfile
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from navapp.errors import InputError, PlanError
from navapp.geometry.directions import ViewCone
from navapp.geometry.transform import FloatArray
from navapp.preop.aspect_files import read_aspects, write_aspects
from navapp.preop.bone_files import read_bone, write_bone
from navapp.preop.bone_preview import draw_preview
from navapp.preop.plan_content_json import content_from_json, content_to_json
from navapp.preop.plan_integrity import make_damage_error, sha256_of
from navapp.preop.plan_origin import PlanOrigin, origin_from_json, origin_to_json
from navapp.preop.plan_place import PLAN_FILE, check_place, make_write_error, put_in_place
from navapp.preop.plan_summary import make_summary_page
from navapp.preop.plan_view import PlanView, make_plan_view
from navapp.preop.slice_volume import SliceVolume, read_slices, write_slices
from navapp.preop.slices import Picture
from navapp.values import AspectGraph, BoneModel, Plan, SurgicalContent

NO_SLICES: Mapping[str, Picture] = MappingProxyType({})
_SLICES_FILE = "slices.npz"
_CONVENTIONS = {"format": 1, "space": "LPS", "unit": "mm"}


def write_plan(
    folder: str | Path,
    plan: Plan,
    origin: PlanOrigin | None = None,
    slices: Mapping[str, Picture] = NO_SLICES,
    volume: SliceVolume | None = None,
) -> None:
    """Write a plan folder whole: it appears complete or not at all.

    An older plan at the same place is replaced; any other folder with something in it is refused.

    Args:
        folder: of the plan.
        plan: what is written.
        origin: where its surfaces come from; None for nothing known.
        slices: bone -> (h, w, 3) BGR of its contour in the volume, for its picture.
        volume: whose slices a person scrolls through; None: contours alone.

    Raises:
        PlanError: the place is taken by something that is not a plan, or cannot be written.
    """
    folder = Path(folder)
    if not plan.bones:
        raise PlanError("a plan needs at least one bone", remedy="give --surface femur=FILE")
    check_place(folder, may_replace=True)
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        temporary = Path(tempfile.mkdtemp(dir=folder.parent, prefix=f".{folder.name}."))
    except OSError as error:
        raise make_write_error(folder, error) from error
    try:
        _write_content(temporary, make_plan_view(plan, origin, volume), slices)
        temporary.chmod(0o755)
        put_in_place(temporary, folder)
    except OSError as error:
        raise make_write_error(folder, error) from error
    finally:
        shutil.rmtree(temporary, ignore_errors=True)


def read_plan(folder: str | Path) -> Plan:
    """Read a plan folder and check it against its own hashes.

    Raises:
        PlanError: missing, empty, half-written or changed since it was made.
    """
    folder = Path(folder)
    if not (folder / PLAN_FILE).is_file():
        raise PlanError(
            f"{folder} holds no plan",
            subject=str(folder),
            remedy="make one with `navapp plan --surface femur=FILE --out FOLDER`",
        )
    try:
        content = _read_content(folder)
        _check_slices(folder, content)
        bones = {name: _read_bone(folder, name, entry) for name, entry in content["bones"].items()}
        plan = Plan(
            bones,
            {name: _points(points) for name, points in content["targets"].items()},
            {name: _points(points) for name, points in content["curves"].items()},
            name=folder.name,
            content=_surgical(content, folder),
            aspects=_read_aspects(folder, content["bones"]),
            approaches={
                name: ViewCone.from_json(entry)
                for name, entry in content.get("approaches", {}).items()
            },
        )
    except (
        OSError,
        ValueError,
        KeyError,
        TypeError,
        AttributeError,
        OverflowError,
        InputError,
    ) as error:
        if isinstance(error, PlanError):
            raise
        raise make_damage_error(folder, str(error)) from error
    if not bones:
        raise PlanError(
            f"plan {folder} is empty: it has no bone",
            subject=str(folder),
            remedy="make it again with `navapp plan`",
        )
    if plan.digest != content.get("hash"):
        raise make_damage_error(folder, "its content does not match its hash")
    return plan


def read_origin(folder: str | Path) -> PlanOrigin:
    """Where the surfaces of a plan come from; nothing known of a plan without that entry.

    Raises:
        PlanError: missing or damaged.
    """
    folder = Path(folder)
    try:
        content = _read_content(folder)
        return origin_from_json(content["origin"]) if "origin" in content else PlanOrigin()
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise make_damage_error(folder, str(error)) from error


def read_plan_view(folder: str | Path, plan: Plan) -> PlanView:
    """What is needed to look at a plan that was read from a folder.

    Raises:
        PlanError: missing or damaged.
    """
    folder = Path(folder)
    origin = read_origin(folder)
    has_slices = "slices_sha256" in _read_content(folder)
    return make_plan_view(plan, origin, read_slices(folder / _SLICES_FILE) if has_slices else None)


def _check_slices(folder: Path, content: Mapping[str, Any]) -> None:
    """Plans from before there were any, and those of surfaces, have none."""
    path = folder / _SLICES_FILE
    if "slices_sha256" in content and (
        not path.is_file() or sha256_of(path) != content["slices_sha256"]
    ):
        raise make_damage_error(folder, f"{path.name} is missing or was changed")


def _read_aspects(folder: Path, bones: Mapping[str, Any]) -> dict[str, AspectGraph]:
    aspects = {}
    for name, entry in bones.items():
        if entry.get("aspects_sha256") is None:
            continue
        path = folder / f"aspects_{name}.npz"
        if not path.is_file() or sha256_of(path) != entry["aspects_sha256"]:
            raise make_damage_error(folder, f"{path.name} is missing or was changed")
        aspects[name] = read_aspects(path)
    return aspects


def _read_content(folder: Path) -> dict[str, Any]:
    content: dict[str, Any] = json.loads((folder / PLAN_FILE).read_text(encoding="utf-8"))
    if any(content[key] != value for key, value in _CONVENTIONS.items()):
        raise PlanError(
            f"plan {folder} is of another format",
            subject=str(folder),
            remedy="make it again with `navapp plan`",
        )
    if "file_hash" in content and content["file_hash"] != _hash_of(content):
        raise make_damage_error(folder, f"{PLAN_FILE} was edited")
    return content


def _write_content(folder: Path, view: PlanView, slices: Mapping[str, Picture]) -> None:
    plan = view.plan
    bones: dict[str, Any] = {}
    for name, bone in plan.bones.items():
        file = f"{name}.ply"
        write_bone(folder / file, bone)
        (folder / f"preview_{name}.png").write_bytes(draw_preview(bone.mesh, slices.get(name)))
        bones[name] = {
            "file": file,
            "sha256": sha256_of(folder / file),
            "side": bone.side,
            "version": bone.version,
            "removed": np.flatnonzero(bone.is_removed).tolist(),
            "surface_sd_mm": bone.surface_sd_mm,
            "aspects_sha256": _write_aspects(folder, plan, name),
        }
    content = {
        **_CONVENTIONS,
        "bones": bones,
        "targets": {name: points.tolist() for name, points in plan.targets.items()},
        "curves": {name: points.tolist() for name, points in plan.curves.items()},
        "approaches": {name: cone.to_json() for name, cone in plan.approaches.items()},
        "content": content_to_json(plan.content, folder),
        "origin": origin_to_json(view.origin),
        "hash": plan.digest,
    }
    # Not in the digest, which tells what is shown on the patient: these are pictures for a person,
    # and sessions recorded with a plan stay its sessions whether or not it has them.
    if view.has_pictures:
        write_slices(folder / _SLICES_FILE, view.volume)
        content["slices_sha256"] = sha256_of(folder / _SLICES_FILE)
    content["file_hash"] = _hash_of(content)
    (folder / PLAN_FILE).write_text(json.dumps(content, indent=1), encoding="utf-8")
    page = make_summary_page(view, folder)
    (folder / "summary.html").write_text(page, encoding="utf-8")


def _write_aspects(folder: Path, plan: Plan, name: str) -> str | None:
    if name not in plan.aspects:
        return None
    path = folder / f"aspects_{name}.npz"
    write_aspects(path, plan.aspects[name])
    return sha256_of(path)


def _hash_of(content: Mapping[str, Any]) -> str:
    """Of everything in plan.json but itself: no fact can be edited unseen."""
    rest = {key: value for key, value in content.items() if key != "file_hash"}
    text = json.dumps(rest, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode("utf-8")).hexdigest()


def _read_bone(folder: Path, name: str, entry: dict[str, Any]) -> BoneModel:
    path = folder / entry["file"]
    if not path.is_file():
        raise make_damage_error(folder, f"{entry['file']} is missing")
    if sha256_of(path) != entry["sha256"]:
        raise make_damage_error(folder, f"{entry['file']} was changed or cut short")
    mesh, cartilage_mm, cartilage_sd_mm = read_bone(path)
    is_removed = np.zeros(len(mesh.vertices_mm), dtype=bool)
    is_removed[np.array(entry["removed"], dtype=np.intp)] = True
    return BoneModel(
        name,
        mesh,
        entry["side"],
        cartilage_mm,
        cartilage_sd_mm,
        is_removed,
        version=int(entry["version"]),
        surface_sd_mm=float(entry.get("surface_sd_mm", 0.0)),
    )


def _surgical(content: dict[str, Any], folder: Path) -> SurgicalContent:
    """Plans from before there was any have none."""
    return (
        content_from_json(content["content"], folder) if "content" in content else SurgicalContent()
    )


def _points(rows: Any) -> FloatArray:
    return np.array(rows, dtype=np.float64).reshape(-1, 3)
