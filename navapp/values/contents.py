"""The surgical content of a plan: what is to be cut, drilled, put in and kept away from.

Everything is in plan coordinates (LPS, mm) and moves with the bone that it names.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from types import MappingProxyType
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.directions import perpendicular_axes
from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.transform import FloatArray, RigidTransform, read_only

PartKind = Literal["implant", "spacer"]
# A cut may be as much longer and broader than its planned rectangle.
_REACH = 1.3
# Of the mechanical axes; they lie outside the usual field of view and may be absent.
HIP_CENTRE, ANKLE_CENTRE = "femur/hip_centre", "tibia/ankle_centre"


@dataclass(frozen=True, slots=True, eq=False)
class ResectionPlane:
    """A planned cut."""

    bone: str  # that is cut
    point_mm: FloatArray  # (3,) middle of the cut
    normal: FloatArray  # (3,) unit, out of the bone that stays: what lies beyond is removed
    # width across (the plan's x laid into the plane) and depth, for drawing.
    extent_mm: tuple[float, float] = (80.0, 60.0)

    def __post_init__(self) -> None:
        object.__setattr__(self, "point_mm", _point(self.point_mm, "the point of a plane"))
        object.__setattr__(self, "normal", _unit(self.normal, "the normal of a plane"))
        width_mm, depth_mm = (_positive(value, "the extent of a plane") for value in self.extent_mm)
        object.__setattr__(self, "extent_mm", (width_mm, depth_mm))

    def heights_mm(self, points_mm: FloatArray) -> FloatArray:
        """(N,) distance of points (N, 3) from the plane; positive on the side that is removed."""
        heights_mm: FloatArray = (points_mm - self.point_mm) @ self.normal
        return heights_mm

    def is_over(self, points_mm: FloatArray) -> NDArray[np.bool_]:
        """(N,) points over the planned rectangle and a margin: a cut reaches no further.

        The plane meets other parts of the bone too, which stay.
        """
        along_mm = np.abs((points_mm - self.point_mm) @ self.axes.T)
        is_inside = along_mm <= 0.5 * _REACH * np.array(self.extent_mm)
        return np.asarray(is_inside.all(axis=1))

    @property
    def axes(self) -> FloatArray:
        """(2, 3) unit directions across the normal: of the width, and of the depth."""
        along = np.eye(3)[1 if abs(self.normal[0]) > 0.9 else 0]
        across = along - (along @ self.normal) * self.normal
        across /= np.linalg.norm(across)
        return np.stack([across, np.cross(self.normal, across)])

    def corners_mm(self) -> FloatArray:
        """(4, 3) corners of the drawn rectangle, in order."""
        signs = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
        corners: FloatArray = self.point_mm + (0.5 * signs * self.extent_mm) @ self.axes
        return corners


@dataclass(frozen=True, slots=True, eq=False)
class DrillAxis:
    """A planned hole: where it enters the bone, its unit direction into it, depth and diameter."""

    bone: str
    entry_mm: FloatArray
    direction: FloatArray
    depth_mm: float
    diameter_mm: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "entry_mm", _point(self.entry_mm, "the entry of a drill axis"))
        object.__setattr__(
            self, "direction", _unit(self.direction, "the direction of a drill axis")
        )
        for name in ("depth_mm", "diameter_mm"):
            object.__setattr__(self, name, _positive(getattr(self, name), f"{name} of a drill"))

    @property
    def axes(self) -> FloatArray:
        """(2, 3) unit directions across the hole."""
        axes: FloatArray = perpendicular_axes(self.direction[None])[0]
        return axes


@dataclass(frozen=True, slots=True)
class Box:
    """Centred at the part's origin, along its axes."""

    size_mm: tuple[float, float, float]

    def __post_init__(self) -> None:
        x_mm, y_mm, z_mm = (_positive(value, "the size of a box") for value in self.size_mm)
        object.__setattr__(self, "size_mm", (x_mm, y_mm, z_mm))


@dataclass(frozen=True, slots=True)
class Cylinder:
    """Centred at the part's origin, along its z."""

    diameter_mm: float
    length_mm: float

    def __post_init__(self) -> None:
        for name in ("diameter_mm", "length_mm"):
            object.__setattr__(self, name, _positive(getattr(self, name), f"{name} of a cylinder"))


@dataclass(frozen=True, slots=True)
class Sphere:
    """Centred at the part's origin."""

    diameter_mm: float

    def __post_init__(self) -> None:
        value_mm = _positive(self.diameter_mm, "diameter_mm of a sphere")
        object.__setattr__(self, "diameter_mm", value_mm)


Shape = Box | Cylinder | Sphere | TriangleMesh


@dataclass(frozen=True, slots=True, eq=False)
class Part:
    """An implant or a spacer: its shape, and `bone_from_part`; that frame's target is its bone."""

    kind: PartKind
    shape: Shape
    bone_from_part: RigidTransform

    @property
    def bone(self) -> str:
        """It moves with this one."""
        return self.bone_from_part.target


# What is made of a bone, in one step of the operation: a cut, a hole, a part put in its place.
PlannedStep = ResectionPlane | DrillAxis | Part
StepKind = Literal["cut", "hole", "part"]


def kind_of(step: PlannedStep) -> StepKind:
    """What is made by a step."""
    if isinstance(step, ResectionPlane):
        return "cut"
    return "hole" if isinstance(step, DrillAxis) else "part"


@dataclass(frozen=True, slots=True, eq=False)
class RiskStructure:
    """A vessel or a nerve: a surface, or without one the plan's curve of the same name."""

    bone: str  # whose motion it follows
    safety_mm: float  # nothing sharp comes nearer than this
    mesh: TriangleMesh | None = None  # its surface

    def __post_init__(self) -> None:
        if not (np.isfinite(self.safety_mm) and self.safety_mm >= 0.0):
            raise ValueError("the safety distance must be finite and not negative")
        object.__setattr__(self, "safety_mm", float(self.safety_mm))


@dataclass(frozen=True, slots=True, eq=False)
class Landmark:
    """A point of the anatomy, its standard deviation (one number for all directions) and origin."""

    point_mm: FloatArray  # (3,)
    sd_mm: float | None  # None when whoever gave it did not say
    source: str  # `contents`, `markups`, `surface` (estimated), `simulation`

    def __post_init__(self) -> None:
        object.__setattr__(self, "point_mm", _point(self.point_mm, "a landmark"))
        if self.sd_mm is None:
            return
        if not (np.isfinite(self.sd_mm) and self.sd_mm >= 0.0):
            raise ValueError("the deviation of a landmark must be finite and not negative")
        object.__setattr__(self, "sd_mm", float(self.sd_mm))


@dataclass(frozen=True, slots=True, eq=False)
class Defect:
    """Damaged cartilage, painted on a bone: indices of its vertices, rising."""

    bone: str
    vertices: NDArray[np.int64]

    def __post_init__(self) -> None:
        vertices = np.unique(np.asarray(self.vertices, dtype=np.int64))
        if len(vertices) and vertices[0] < 0:
            raise ValueError("a defect names a vertex that does not exist")
        object.__setattr__(self, "vertices", read_only(vertices, np.int64))


@dataclass(frozen=True, slots=True)
class StageContent:
    """What of the plan belongs to a stage: the bone that is followed there, and names."""

    bone: str
    targets: tuple[str, ...] = ()
    planes: tuple[str, ...] = ()
    drills: tuple[str, ...] = ()
    parts: tuple[str, ...] = ()
    risks: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for name in ("targets", "planes", "drills", "parts", "risks"):
            object.__setattr__(self, name, tuple(getattr(self, name)))


@dataclass(frozen=True, slots=True, eq=False)
class SurgicalContent:
    """All of it, by name. Landmarks are keyed `bone/name`, stages by the stage's name."""

    planes: Mapping[str, ResectionPlane] = field(default_factory=dict)
    drills: Mapping[str, DrillAxis] = field(default_factory=dict)
    parts: Mapping[str, Part] = field(default_factory=dict)
    risks: Mapping[str, RiskStructure] = field(default_factory=dict)
    landmarks: Mapping[str, Landmark] = field(default_factory=dict)
    defects: Mapping[str, Defect] = field(default_factory=dict)
    stages: Mapping[str, StageContent] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for one in fields(self):
            object.__setattr__(self, one.name, MappingProxyType(dict(getattr(self, one.name))))

    @property
    def steps(self) -> dict[str, PlannedStep]:
        """All that is to be made, by name; of several with one name the cut, then the hole."""
        return {**self.parts, **self.drills, **self.planes}

    @property
    def is_empty(self) -> bool:
        """Whether it says nothing, as in a plan of surfaces only."""
        return not any(getattr(self, one.name) for one in fields(self))


def _point(value: FloatArray, what: str) -> FloatArray:
    point = read_only(np.asarray(value, dtype=np.float64))
    if point.shape != (3,) or not np.isfinite(point).all():
        raise ValueError(f"{what} must be three finite numbers")
    return point


def _unit(value: FloatArray, what: str) -> FloatArray:
    direction = _point(value, what)
    length = float(np.linalg.norm(direction))
    if length < 1e-6:
        raise ValueError(f"{what} has no length")
    # One that is a unit already keeps its bits, so that a written plan reads back the same.
    return direction if abs(length - 1.0) < 1e-12 else read_only(direction / length)


def _positive(value: float, what: str) -> float:
    if not (np.isfinite(value) and value > 0.0):
        raise ValueError(f"{what} must be finite and above 0")
    return float(value)
