"""What markups mean, by their names: `drill femur 8mm`, `resection femur distal`, `nerve tibial`.

The first word says what it is, the second may name the bone, a length at the end is the diameter
of a drill or the safety distance of a vessel; the rest is the name. Points are landmarks when their
label is `bone/name`. A name that says nothing is told and left out.
"""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from navapp.errors import PlanError
from navapp.geometry.transform import FloatArray
from navapp.preop.defects import paint_near, paint_within
from navapp.preop.markup_files import Markup, read_markup_file
from navapp.preop.planned_content import PlannedContent
from navapp.values import (
    FOLLOWED_BONES,
    BoneModel,
    Defect,
    DrillAxis,
    Landmark,
    ResectionPlane,
    RiskStructure,
    SurgicalContent,
)

_RISKS = ("nerve", "artery", "vein", "risk")
_LENGTH = re.compile(r"(?:^| )(\d+(?:\.\d+)?) ?mm$")
# Where a plane's points and its stored middle and normal may differ by rounding.
_SAME_MM, _SAME_COSINE = 0.1, 0.9999


@dataclass(frozen=True, slots=True, eq=False)
class _NamedMarkup:
    """A markup and what its name says."""

    markup: Markup
    word: str
    bone: str
    name: str
    length_mm: float | None
    file: Path

    def make_error(self, what: str, remedy: str) -> PlanError:
        """For a markup that cannot be used."""
        return PlanError(
            f"markup '{self.markup.name}' in {self.file} {what}",
            subject=self.markup.name,
            remedy=remedy,
        )


def read_markups(path: str | Path, bones: Mapping[str, BoneModel]) -> PlannedContent:
    """Read one markups file for the bones of a plan.

    Raises:
        PlanError: damaged, or a markup whose name and content do not go together.
    """
    warnings: list[str] = []
    found = PlannedContent()
    for markup in read_markup_file(path, warnings):
        named = _parse_name(markup, Path(path))
        reader = _READERS.get((named.word, markup.kind))
        if reader is not None and named.bone not in bones:
            raise named.make_error(
                f"is of the {named.bone}", f"the plan has no {named.bone}: add it"
            )
        one = reader(named, bones[named.bone]) if reader is not None else _landmarks(markup, bones)
        if one is None:
            warnings.append(f"{Path(path).name}: '{markup.name}' says nothing to a plan: left out")
        else:
            found = found.union(one)
    return found.union(PlannedContent(warnings=tuple(warnings)))


def _parse_name(markup: Markup, file: Path) -> _NamedMarkup:
    text = " ".join(markup.name.lower().replace("_", " ").split())
    length = _LENGTH.search(text)
    words = (text[: length.start()] if length else text).split(" ")
    word, rest = words[0], words[1:]
    bone = rest.pop(0) if rest and rest[0] in FOLLOWED_BONES else "femur"
    # Of a vessel, its kind is part of its name: it says the colour.
    name = "_".join([word, *rest] if word in _RISKS else rest) or bone
    return _NamedMarkup(markup, word, bone, name, float(length[1]) if length else None, file)


def _landmarks(markup: Markup, bones: Mapping[str, BoneModel]) -> PlannedContent | None:
    """Points whose labels are `bone/name`."""
    if markup.kind != "fiducial":
        return None
    found = {
        label: Landmark(point, None, "markups")
        for label, point in zip(markup.labels, markup.points_mm, strict=True)
        if label.partition("/")[0] in bones and label.partition("/")[2]
    }
    return PlannedContent(SurgicalContent(landmarks=found)) if found else None


def _drill(named: _NamedMarkup, bone: BoneModel) -> PlannedContent:
    """A line from the entry to the bottom."""
    points = named.markup.points_mm
    depth_mm = float(np.linalg.norm(points[1] - points[0])) if len(points) == 2 else 0.0
    if depth_mm == 0.0:
        raise named.make_error("is not two points", "place its entry, then its bottom")
    if not named.length_mm:
        raise named.make_error("names no diameter", f"call it 'drill {named.bone} 8mm'")
    axis = DrillAxis(bone.name, points[0], points[1] - points[0], depth_mm, named.length_mm)
    return PlannedContent(SurgicalContent(drills={named.name: axis}))


def _plane(named: _NamedMarkup, bone: BoneModel) -> PlannedContent:
    """A cut; turned so that the smaller part of the bone is what is removed."""
    point, normal = _place_of(named)
    beyond = ((bone.mesh.vertices_mm - point) @ normal > 0.0).mean()
    plane = ResectionPlane(bone.name, point, normal if beyond <= 0.5 else -normal)
    if named.markup.size_mm is not None:
        plane = ResectionPlane(bone.name, point, plane.normal, named.markup.size_mm)
    return PlannedContent(SurgicalContent(planes={named.name: plane}))


def _place_of(named: _NamedMarkup) -> tuple[FloatArray, FloatArray]:
    """Point and unit normal; from three points, from what the file stores, or both if they agree.

    Raises:
        PlanError: neither, or they disagree.
    """
    markup = named.markup
    centre, normal, points = markup.centre_mm, markup.normal, markup.points_mm
    drawn = np.cross(points[1] - points[0], points[2] - points[0]) if len(points) == 3 else None
    stored = normal if normal is not None else drawn
    if stored is None or not np.linalg.norm(stored) > 1e-9 or (centre is None and not len(points)):
        raise named.make_error("is no plane", "place its middle and normal, or three points")
    unit = stored / np.linalg.norm(stored)
    middle = centre if centre is not None else points.mean(axis=0)
    is_off = len(points) > 0 and bool((np.abs((points - middle) @ unit) > _SAME_MM).any())
    if drawn is not None and np.linalg.norm(drawn) > 1e-9:
        is_off |= bool(abs(drawn @ unit) < _SAME_COSINE * np.linalg.norm(drawn))
    if is_off:
        raise named.make_error("has points beside its own plane", "save it anew in 3D Slicer")
    return middle, unit


def _risk(named: _NamedMarkup, bone: BoneModel) -> PlannedContent:
    if len(named.markup.points_mm) < 2:
        raise named.make_error("has fewer than two points", "place more, or leave it out")
    warnings: tuple[str, ...] = ()
    if named.length_mm is None:
        warnings = (
            f"'{named.markup.name}' names no safety distance: 0 mm "
            f"(call it '{named.markup.name} 5mm')",
        )
    risk = RiskStructure(bone.name, named.length_mm or 0.0)
    return PlannedContent(
        SurgicalContent(risks={named.name: risk}),
        curves={named.name: named.markup.points_mm},
        warnings=warnings,
    )


def _target(named: _NamedMarkup, bone: BoneModel) -> PlannedContent:
    if len(named.markup.points_mm) == 0:
        raise named.make_error("has no points", "place some, or leave it out")
    return PlannedContent(targets={f"{bone.name}/{named.name}": named.markup.points_mm})


def _spots(named: _NamedMarkup, bone: BoneModel) -> PlannedContent:
    points = named.markup.points_mm
    if len(points) == 0:
        raise named.make_error("has no points", "place some, or leave it out")
    return _plan_defect(named, Defect(bone.name, paint_near(bone.mesh, points)))


def _outline(named: _NamedMarkup, bone: BoneModel) -> PlannedContent:
    points = named.markup.points_mm
    if len(points) < 3:
        raise named.make_error("has fewer than three points", "place more, or leave it out")
    return _plan_defect(named, Defect(bone.name, paint_within(bone.mesh, points)))


def _plan_defect(named: _NamedMarkup, defect: Defect) -> PlannedContent:
    if not len(defect.vertices):
        raise named.make_error(
            f"paints nothing of the {defect.bone}", "check its coordinate system"
        )
    return PlannedContent(SurgicalContent(defects={named.name: defect}))


_READERS: Mapping[tuple[str, str], Callable[[_NamedMarkup, BoneModel], PlannedContent]] = {
    ("drill", "line"): _drill,
    ("resection", "plane"): _plane,
    ("target", "fiducial"): _target,
    ("defect", "fiducial"): _spots,
    ("defect", "closedcurve"): _outline,
    **{(word, "curve"): _risk for word in _RISKS},
}
