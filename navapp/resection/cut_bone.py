"""A bone of the plan with what has been cut, drilled and put in, and its faces as measured."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TypeVar

import numpy as np

from navapp.geometry.mesh import TriangleMesh
from navapp.resection.hole_rim import MOST_OFF_MM
from navapp.resection.remaining_bone import (
    Cut,
    close_with_face,
    cover_with_parts,
    cut_surface,
    heights_over,
    remove_cuts,
    remove_holes,
)
from navapp.values import BoneModel, DrillAxis, MeasuredFace, Part, PlannedStep, ResectionPlane

# All chosen. Saw and drill miss their plan: bone so near to a planned face or hole may be gone,
# until the face is measured. Then what is left: a triangle's height, and what the measurement
# leaves open.
UNSURE_MM, SURE_MM = 1.5, 0.3
# The tilt of a face is unsure, too: so far from its middle most of it lies.
_HALF_FACE_MM = 25.0

Value = TypeVar("Value")


@dataclass(frozen=True, eq=False)
class CutBone:
    """A bone of the plan, worked on; changed by making another one."""

    planned: BoneModel
    made: Mapping[str, PlannedStep] = field(default_factory=dict)  # by name, as planned
    faces: Mapping[str, MeasuredFace] = field(default_factory=dict)  # of cuts that are measured
    # of cuts below which a caliper was read: the bone is tracked by the last of these faces.
    caliper_faces: Mapping[str, MeasuredFace] = field(default_factory=dict)
    version: int = 0  # a number for each state; one that comes back has its number again
    earlier: tuple["CutBone", ...] = ()  # the states before, each once

    @cached_property
    def model(self) -> BoneModel:
        """What is left of the bone and not covered, to be registered to."""
        whole = self.planned
        for face in self.caliper_faces.values():
            whole = close_with_face(whole, face)
        cuts = [cut for name, cut in self.known_cuts.items() if name not in self.caliper_faces]
        left = remove_cuts(whole, cuts)
        holes = tuple(self.holes.values())
        left = cover_with_parts(remove_holes(left, holes, UNSURE_MM), self.parts)
        return replace(left, version=self.version)

    @cached_property
    def surface(self) -> TriangleMesh | None:
        """What is left of it, with its faces where they are known or planned; None when uncut."""
        if not self.cuts:
            return None
        planes = [cut.plane for cut in self.known_cuts.values()]
        return cut_surface(self.planned.mesh, planes)

    @property
    def cuts(self) -> dict[str, ResectionPlane]:
        """Those that are made, by name, as planned."""
        return {n: one for n, one in self.made.items() if isinstance(one, ResectionPlane)}

    @cached_property
    def known_cuts(self) -> dict[str, Cut]:
        """The cuts that are made, by name: as measured, else as planned, and how unsure each is."""
        return {name: self._cut(name) for name in self.cuts}

    @property
    def holes(self) -> dict[str, DrillAxis]:
        """Those that are made, by name, as planned."""
        return {n: one for n, one in self.made.items() if isinstance(one, DrillAxis)}

    @cached_property
    def whole_holes(self) -> tuple[str, ...]:
        """Names of the holes whose mouth no cut has come near: its rim still lies on the skin."""
        points_mm = self.planned.mesh.vertices_mm
        gone_mm = [
            heights_over(self.planned.mesh, Cut(plane, UNSURE_MM)) for plane in self.cuts.values()
        ]
        is_gone = np.any(np.array(gone_mm) > 0.0, axis=0) if gone_mm else np.zeros(len(points_mm))
        whole = []
        for name, hole in self.holes.items():
            away_mm = np.linalg.norm(points_mm - hole.entry_mm, axis=1)
            if not is_gone[away_mm < hole.diameter_mm + MOST_OFF_MM].any():
                whole.append(name)
        return tuple(whole)

    @property
    def parts(self) -> tuple[Part, ...]:
        """Those that are in place, where they are planned."""
        return tuple(one for one in self.made.values() if isinstance(one, Part))

    @property
    def unmeasured(self) -> tuple[str, ...]:
        """Names of the cuts whose face is not known yet."""
        return tuple(name for name in self.cuts if name not in {*self.faces, *self.caliper_faces})

    @property
    def faces_bound_mm(self) -> float:
        """95 %, of the least known of its measured faces: across it, where most of it lies."""
        bounds_mm = (
            math.hypot(face.bound_mm, _HALF_FACE_MM * math.radians(face.bound_deg))
            for face in self.faces.values()
        )
        return max(bounds_mm, default=0.0)

    def make(self, name: str, step: PlannedStep) -> "CutBone":
        """With one more step made; the face of a cut is not measured."""
        made = {**self.made, name: step}
        return self._become(made, _without(self.faces, name), _without(self.caliper_faces, name))

    def restore(self, name: str) -> "CutBone":
        """Without a step."""
        made = _without(self.made, name)
        return self._become(made, _without(self.faces, name), _without(self.caliper_faces, name))

    def without_faces(self) -> "CutBone":
        """As it is made, and nothing measured of its faces."""
        return self._become(self.made, {}, self.caliper_faces)

    def with_faces(self, faces: Mapping[str, MeasuredFace]) -> "CutBone":
        """With the faces of some of its cuts as measured."""
        return self._become(self.made, {**self.faces, **faces}, self.caliper_faces)

    def with_caliper_face(self, name: str, face: MeasuredFace) -> "CutBone":
        """With the face of a cut as the thickness below it tells (`caliper.find_face`)."""
        return self._become(
            self.made, _without(self.faces, name), {**self.caliper_faces, name: face}
        )

    def _become(
        self,
        made: Mapping[str, PlannedStep],
        faces: Mapping[str, MeasuredFace],
        caliper_faces: Mapping[str, MeasuredFace],
    ) -> "CutBone":
        """Another state: an earlier one if it is the same, else a new version."""
        known = {state.version: state for state in (*self.earlier, self)}
        version = max(known) + 1
        for state in known.values():
            is_same = set(state.made) == set(made) and dict(state.faces) == dict(faces)
            is_same &= dict(state.caliper_faces) == dict(caliper_faces)
            version = state.version if is_same else version
        earlier = tuple(replace(state, earlier=()) for state in known.values())
        return CutBone(self.planned, made, faces, caliper_faces, version, earlier)

    def _cut(self, name: str) -> Cut:
        face = self.caliper_faces.get(name, self.faces.get(name))
        if face is None:
            return Cut(self.cuts[name], UNSURE_MM)
        tilt_mm = _HALF_FACE_MM * math.radians(face.bound_deg)
        return Cut(face.as_plane, min(SURE_MM + face.bound_mm + tilt_mm, UNSURE_MM))


def _without(values: Mapping[str, Value], name: str) -> dict[str, Value]:
    return {other: value for other, value in values.items() if other != name}
