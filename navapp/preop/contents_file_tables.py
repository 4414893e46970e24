"""Pydantic models of the tables of a contents file; unknown keys are refused."""

from typing import Annotated, Literal, Self

import numpy as np
from pydantic import AfterValidator, Field, StringConstraints, model_validator

from navapp.config import Section
from navapp.values import (
    FOLLOWED_BONES,
    Box,
    Cylinder,
    DrillAxis,
    FollowedBone,
    Landmark,
    ResectionPlane,
    Sphere,
    StageContent,
)

Millimetres = Annotated[float, Field(gt=0.0)]
PointMm = tuple[float, float, float]
Name = Annotated[str, StringConstraints(min_length=1)]


def _with_length(value: PointMm) -> PointMm:
    if sum(part * part for part in value) < 1e-12:
        raise ValueError("a direction needs a length")
    return value


def _of_a_bone(value: str) -> str:
    bone, slash, name = value.partition("/")
    if bone not in FOLLOWED_BONES or not slash or not name:
        raise ValueError("write bone/name, with femur, tibia or patella as the bone")
    return value


Direction = Annotated[PointMm, AfterValidator(_with_length)]
BoneName = Annotated[str, AfterValidator(_of_a_bone)]


class PlaneTable(Section):
    """A resection plane; the normal looks out of the bone that stays."""

    name: Name
    bone: FollowedBone
    point_mm: PointMm
    normal: Direction
    extent_mm: tuple[Millimetres, Millimetres] = (80.0, 60.0)

    def value(self) -> ResectionPlane:
        """As a plan has it."""
        return ResectionPlane(
            self.bone, np.array(self.point_mm), np.array(self.normal), self.extent_mm
        )


class DrillTable(Section):
    """A drill axis; the direction looks into the bone."""

    name: Name
    bone: FollowedBone
    entry_mm: PointMm
    direction: Direction
    depth_mm: Millimetres
    diameter_mm: Millimetres

    def value(self) -> DrillAxis:
        """As a plan has it."""
        return DrillAxis(
            self.bone,
            np.array(self.entry_mm),
            np.array(self.direction),
            self.depth_mm,
            self.diameter_mm,
        )


class ShapeTable(Section):
    """A primitive about the part's origin; a cylinder lies along its z."""

    kind: Literal["box", "cylinder", "sphere"]
    size_mm: tuple[Millimetres, Millimetres, Millimetres] | None = None
    diameter_mm: Millimetres | None = None
    length_mm: Millimetres | None = None

    @model_validator(mode="after")
    def _has_its_own_keys(self) -> Self:
        needs = {
            "box": {"size_mm"},
            "cylinder": {"diameter_mm", "length_mm"},
            "sphere": {"diameter_mm"},
        }[self.kind]
        if self.model_fields_set - {"kind"} != needs:
            raise ValueError(f"a {self.kind} is given by {' and '.join(sorted(needs))}, no more")
        return self

    def value(self) -> Box | Cylinder | Sphere:
        """As a plan has it: exactly its own sizes are given."""
        if self.size_mm is not None:
            return Box(self.size_mm)
        diameter_mm = self.diameter_mm or 0.0
        if self.length_mm is not None:
            return Cylinder(diameter_mm, self.length_mm)
        return Sphere(diameter_mm)


class PartTable(Section):
    """An implant or a spacer: a primitive or a surface file, and its place in bone coordinates."""

    name: Name
    bone: FollowedBone
    shape: ShapeTable | None = None
    file: Name | None = None
    position_mm: PointMm
    rotation_deg: PointMm = (0.0, 0.0, 0.0)
    """Rotation vector: its direction is the axis, its length the angle."""

    @model_validator(mode="after")
    def _is_one_or_the_other(self) -> Self:
        if (self.shape is None) is (self.file is None):
            raise ValueError("give either shape or file")
        return self


class RiskTable(Section):
    """A vessel or a nerve, as a polyline or a surface file."""

    name: Name
    bone: FollowedBone
    safety_mm: Annotated[float, Field(ge=0.0)]
    curve_mm: Annotated[tuple[PointMm, ...], Field(min_length=2)] | None = None
    file: Name | None = None

    @model_validator(mode="after")
    def _is_one_or_the_other(self) -> Self:
        if (self.curve_mm is None) is (self.file is None):
            raise ValueError("give either curve_mm or file")
        return self


class LandmarkTable(Section):
    """A point of the anatomy."""

    name: BoneName
    point_mm: PointMm
    sd_mm: Annotated[float, Field(ge=0.0)] | None = None

    def value(self) -> Landmark:
        """As a plan has it."""
        return Landmark(np.array(self.point_mm), self.sd_mm, "contents")


class CentreTable(Section):
    """Of the hip or the ankle: a point, or said to be absent."""

    point_mm: PointMm | None = None
    sd_mm: Annotated[float, Field(ge=0.0)] | None = None
    absent: bool = False

    @model_validator(mode="after")
    def _is_there_or_absent(self) -> Self:
        if self.absent is (self.point_mm is not None):
            raise ValueError("give either point_mm or absent = true")
        return self

    def value(self) -> Landmark | None:
        """As a plan has it; None when it is absent."""
        if self.point_mm is None:
            return None
        return Landmark(np.array(self.point_mm), self.sd_mm, "contents")


class TargetTable(Section):
    """Points at which the registration's error is judged."""

    name: BoneName
    points_mm: Annotated[tuple[PointMm, ...], Field(min_length=1)]


class DefectTable(Section):
    """Damaged cartilage: all of the surface within an outline, or near some points."""

    name: Name
    bone: FollowedBone
    outline_mm: Annotated[tuple[PointMm, ...], Field(min_length=3)] | None = None
    points_mm: Annotated[tuple[PointMm, ...], Field(min_length=1)] | None = None

    @model_validator(mode="after")
    def _is_one_or_the_other(self) -> Self:
        if (self.outline_mm is None) is (self.points_mm is None):
            raise ValueError("give either outline_mm or points_mm")
        return self


class StageTable(Section):
    """The bone of a stage, and the names of what belongs to it."""

    bone: FollowedBone
    targets: tuple[BoneName, ...] = ()
    planes: tuple[str, ...] = ()
    drills: tuple[str, ...] = ()
    parts: tuple[str, ...] = ()
    risks: tuple[str, ...] = ()

    def value(self) -> StageContent:
        """As a plan has it."""
        return StageContent(**dict(self))


class StagesTable(Section):
    """The five stages; one that is left out stays as it is built in."""

    opening: StageTable | None = None
    drilling: StageTable | None = None
    implant: StageTable | None = None
    patella: StageTable | None = None
    spacer: StageTable | None = None


class ContentsTables(Section):
    """A whole contents file."""

    plane: tuple[PlaneTable, ...] = ()
    drill: tuple[DrillTable, ...] = ()
    implant: tuple[PartTable, ...] = ()
    spacer: tuple[PartTable, ...] = ()
    risk: tuple[RiskTable, ...] = ()
    landmark: tuple[LandmarkTable, ...] = ()
    hip: CentreTable | None = None
    ankle: CentreTable | None = None
    target: tuple[TargetTable, ...] = ()
    defect: tuple[DefectTable, ...] = ()
    stage: StagesTable = StagesTable()
