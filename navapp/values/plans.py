"""A pre-operative plan, a surgical stage, and where a first registration may start."""

import hashlib
import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from types import MappingProxyType
from typing import Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.directions import ViewCone
from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.values.bones import AspectGraph, BoneModel
from navapp.values.conditions import Condition
from navapp.values.contents import PlannedStep, ResectionPlane, SurgicalContent
from navapp.values.digests import add_value


class _OfBone(Protocol):
    @property
    def bone(self) -> str: ...


T = TypeVar("T", bound=_OfBone)


# Three points tell a pose.
FEWEST_PICKS = 3
# Picks that are nearer to each other in the picture tell no turn.
_LEAST_APART_PX = 10.0
# A landmark that can be seen on a bone lies no further from its surface.
_BESIDE_MM = 5.0


@dataclass(frozen=True, slots=True, eq=False)
class Pick:
    """A landmark of a bone that an operator has found in the left picture."""

    name: str  # in the plan
    bone: str
    left_px: tuple[float, float]  # column and row
    model_mm: FloatArray  # (3,) in bone coordinates


@dataclass(frozen=True, slots=True, eq=False)
class Prior:
    """The rough start that an operator can give; any part may be absent."""

    # bone name -> rough pose.
    left_from_bone: Mapping[str, RigidTransform] = field(default_factory=dict)
    # bone name -> from where the cameras see it, in its coordinates.
    cones: Mapping[str, ViewCone] = field(default_factory=dict)
    box: tuple[int, int, int, int] | None = None  # x, y, width, height in the left picture, px
    picks: tuple[Pick, ...] = ()  # of any bones

    def __post_init__(self) -> None:
        if self.box is not None and min(self.box[2:]) < 1:
            raise ValueError("a box is at least 1 px wide and high")

    @property
    def is_empty(self) -> bool:
        """It says nothing at all."""
        return not any((self.left_from_bone, self.cones, self.picks)) and self.box is None

    def replaced_by(self, start: "Prior") -> "Prior":
        """What an operator has given instead, seen from the side that was known."""
        return start.with_cones(self.cones)

    def with_cones(self, usual: Mapping[str, ViewCone]) -> "Prior":
        """With these cones for bones of which it knows neither a cone nor a pose."""
        new = {bone: cone for bone, cone in usual.items() if bone not in self.left_from_bone}
        return replace(self, cones={**new, **self.cones})

    def picks_of(self, bone: str) -> tuple[Pick, ...]:
        """Those of a bone; none when they are too few for a pose."""
        found = tuple(pick for pick in self.picks if pick.bone == bone)
        return found if len(found) >= FEWEST_PICKS else ()

    def has_start(self, bone: str) -> bool:
        """Whether it says anything of where a bone is."""
        return (
            bone in self.left_from_bone
            or self.box is not None
            or bone in self.cones
            or bool(self.picks_of(bone))
        )


@dataclass(frozen=True, slots=True)
class StageSpec:
    """One surgical stage, as a row of the table in `navapp.control.stages`."""

    number: int
    name: str
    bone: str
    tolerance_mm: float
    tolerance_deg: float
    targets: tuple[str, ...]
    layers: tuple[str, ...]
    entry: tuple[Condition, ...] = ()  # before it is entered from the stage before
    exit: tuple[Condition, ...] = ()  # before the next stage is entered


@dataclass(frozen=True, slots=True, eq=False)
class Plan:
    """A pre-operative plan.

    Raises:
        ValueError: a risk structure has neither a surface nor a curve, a defect names a vertex that
            its bone does not have, or a stage names what the plan does not have.
    """

    bones: Mapping[str, BoneModel]  # name -> model
    # name -> (N, 3) points of that bone, mm, keyed `bone/name`.
    targets: Mapping[str, FloatArray] = field(default_factory=dict)
    # name -> (N, 3) polylines (vessels, nerves), mm; they move with the bone of the risk structure
    # of the same name, or with the femur.
    curves: Mapping[str, FloatArray] = field(default_factory=dict)
    digest: str = ""  # hash of all of it
    name: str = ""  # for people
    # what is to be cut, drilled, put in and kept away from.
    content: SurgicalContent = field(default_factory=SurgicalContent)
    # bone -> its edges from all around, where they were built beforehand; not in the digest,
    # because they follow from the bones.
    aspects: Mapping[str, AspectGraph] = field(default_factory=dict)
    # bone -> from where the cameras usually see it; not in the digest, because a first registration
    # starts there and its answer is judged like every other.
    approaches: Mapping[str, ViewCone] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "bones", MappingProxyType(dict(self.bones)))
        object.__setattr__(self, "targets", MappingProxyType(dict(self.targets)))
        object.__setattr__(self, "curves", MappingProxyType(dict(self.curves)))
        object.__setattr__(self, "aspects", MappingProxyType(dict(self.aspects)))
        object.__setattr__(self, "approaches", MappingProxyType(dict(self.approaches)))
        _check_content(self)
        if not self.digest:
            object.__setattr__(self, "digest", _digest(self))

    def targets_of(self, names: tuple[str, ...]) -> FloatArray:
        """(N, 3) target points of those names that the plan has; may be empty."""
        found = [self.targets[name].reshape(-1, 3) for name in names if name in self.targets]
        return np.concatenate(found) if found else np.empty((0, 3))

    def planes_of(self, stage: StageSpec) -> dict[str, ResectionPlane]:
        """The planes of a stage's bone: those that its plan names, or all of them."""
        return self.of_stage(self.content.planes, "planes", stage)

    def steps_of(self, stage: StageSpec) -> dict[str, PlannedStep]:
        """What is to be made in a stage: holes where it shows holes, else cuts and parts."""
        content = self.content
        if "drills" in stage.layers:
            return dict(self.of_stage(content.drills, "drills", stage))
        return {**self.planes_of(stage), **self.of_stage(content.parts, "parts", stage)}

    def of_stage(self, known: Mapping[str, T], kind: str, stage: StageSpec) -> dict[str, T]:
        """What the plan names of a kind for a stage; where it names nothing, all of its bone."""
        content = self.content.stages.get(stage.name)
        named = () if content is None else getattr(content, kind)
        return {
            name: one
            for name, one in known.items()
            if one.bone == stage.bone and (name in named or not named)
        }

    def landmarks_of(self, bone: str) -> Mapping[str, FloatArray]:
        """Points on a bone that have a name, (3,) mm: its landmarks, and targets of one point."""
        return _find_landmarks(self, bone)

    def stage(self, spec: StageSpec) -> StageSpec:
        """A stage as this plan has it: with its bone and, when it names any, its targets."""
        planned = self.content.stages.get(spec.name)
        if planned is None:
            return spec
        return replace(spec, bone=planned.bone, targets=planned.targets or spec.targets)


@lru_cache(maxsize=8)
def _find_landmarks(plan: Plan, bone: str) -> Mapping[str, FloatArray]:
    # Once: sessions ask with every frame.
    if bone not in plan.bones:
        return {}
    vertices_mm = plan.bones[bone].mesh.vertices_mm
    known = {name: np.reshape(points, (-1, 3)) for name, points in plan.targets.items()}
    named = {name: points_mm[0] for name, points_mm in known.items() if len(points_mm) == 1}
    named |= {name: one.point_mm for name, one in plan.content.landmarks.items()}
    return MappingProxyType(
        {
            name: point_mm
            for name, point_mm in named.items()
            # The hip's centre, too, is called the femur's.
            if name.startswith(f"{bone}/") and _is_beside(vertices_mm, point_mm)
        }
    )


def find_crowded(picks: Sequence[Pick]) -> tuple[str, str] | None:
    """Names of two picks that lie at one place of the picture; None when all lie apart."""
    for a, b in itertools.combinations(picks, 2):
        if math.dist(a.left_px, b.left_px) < _LEAST_APART_PX:
            return a.name, b.name
    return None


def _is_beside(vertices_mm: FloatArray, point_mm: FloatArray) -> bool:
    return bool(np.linalg.norm(vertices_mm - point_mm, axis=1).min() <= _BESIDE_MM)


def _check_content(plan: Plan) -> None:
    content = plan.content
    for name, risk in content.risks.items():
        if risk.mesh is None and name not in plan.curves:
            raise ValueError(f"the risk structure '{name}' has neither a surface nor a curve")
    for name, defect in content.defects.items():
        bone = plan.bones.get(defect.bone)
        n = 0 if bone is None else len(bone.mesh.vertices_mm)
        if len(defect.vertices) and defect.vertices[-1] >= n:
            raise ValueError(f"the defect '{name}' names a vertex that the {defect.bone} lacks")
    for stage, planned in content.stages.items():
        for kind, known in (
            ("targets", plan.targets),
            ("planes", content.planes),
            ("drills", content.drills),
            ("parts", content.parts),
            ("risks", content.risks),
        ):
            missing = [name for name in getattr(planned, kind) if name not in known]
            if missing:
                raise ValueError(f"stage {stage}: the {kind} have no '{missing[0]}'")


def _digest(plan: Plan) -> str:
    """Hash of everything in a plan that changes what is shown."""
    digest = hashlib.sha256()

    def add(label: str, array: NDArray[np.generic]) -> None:
        # With its length, so that the same bytes cut elsewhere are something else.
        digest.update(f"{label}:{array.size}:".encode())
        digest.update(np.ascontiguousarray(array).tobytes())

    for name in sorted(plan.bones):
        bone = plan.bones[name]
        digest.update(f"bone {name}:{bone.side}:{bone.version}".encode())
        add("vertices", bone.mesh.vertices_mm)
        add("faces", bone.mesh.faces)
        add("cartilage", bone.cartilage_mm)
        add("its deviation", bone.cartilage_sd_mm)
        add("removed", bone.is_removed)
        # Plans from before it was known keep their hash.
        if bone.surface_sd_mm:
            digest.update(f"surface {bone.surface_sd_mm!r}".encode())
    for kind, points_by_name in (("target", plan.targets), ("curve", plan.curves)):
        for name in sorted(points_by_name):
            add(f"{kind} {name}", np.asarray(points_by_name[name], dtype=np.float64))
    # Plans from before there was any keep their hash.
    if not plan.content.is_empty:
        add_value(digest, "content", plan.content)
    return digest.hexdigest()[:12]
