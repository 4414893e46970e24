"""A bone of the plan with the cuts that have been made, and what is known of their faces."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

from navapp.geometry.mesh import TriangleMesh
from navapp.resection.remaining_bone import Cut, cut_surface, remove_cuts
from navapp.values import BoneModel, MeasuredFace, ResectionPlane

# All chosen. A saw misses its plan: bone so near to a planned face may be gone, until the face is
# measured. Then what is left: a triangle's height, and what the measurement leaves open.
UNSURE_MM, SURE_MM = 1.5, 0.3
# The tilt of a face is unsure, too: so far from its middle most of it lies.
_HALF_FACE_MM = 25.0


@dataclass(frozen=True, eq=False)
class CutBone:
    """A bone of the plan, cut; changed by making another one."""

    planned: BoneModel
    made: Mapping[str, ResectionPlane] = field(default_factory=dict)  # by name, as planned
    faces: Mapping[str, MeasuredFace] = field(default_factory=dict)  # of those that are measured
    version: int = 0  # a number for each state; one that comes back has its number again
    earlier: tuple["CutBone", ...] = ()  # the states before, each once

    @cached_property
    def model(self) -> BoneModel:
        """What is left of the bone, to be registered to."""
        left = remove_cuts(self.planned, [self._cut(name) for name in self.made])
        return replace(left, version=self.version)

    @cached_property
    def surface(self) -> TriangleMesh | None:
        """What is left of it, with its faces where they are known or planned; None when whole."""
        if not self.made:
            return None
        planes = [self._cut(name).plane for name in self.made]
        return cut_surface(self.planned.mesh, planes)

    @property
    def unmeasured(self) -> tuple[str, ...]:
        """Names of the cuts whose face is not known yet."""
        return tuple(name for name in self.made if name not in self.faces)

    def cut(self, name: str, plane: ResectionPlane) -> "CutBone":
        """With one more cut; its face is not measured."""
        return self._become({**self.made, name: plane}, self._faces_but(name))

    def restore(self, name: str) -> "CutBone":
        """Without a cut."""
        made = {other: plane for other, plane in self.made.items() if other != name}
        return self._become(made, self._faces_but(name))

    def without_faces(self) -> "CutBone":
        """With its cuts, and nothing known of their faces."""
        return self._become(self.made, {})

    def with_faces(self, faces: Mapping[str, MeasuredFace]) -> "CutBone":
        """With the faces of some of its cuts as measured."""
        return self._become(self.made, {**self.faces, **faces})

    def _faces_but(self, name: str) -> dict[str, MeasuredFace]:
        return {other: face for other, face in self.faces.items() if other != name}

    def _become(
        self, made: Mapping[str, ResectionPlane], faces: Mapping[str, MeasuredFace]
    ) -> "CutBone":
        """Another state: an earlier one if it is the same, else a new version."""
        known = {state.version: state for state in (*self.earlier, self)}
        version = max(known) + 1
        for state in known.values():
            is_same = set(state.made) == set(made) and dict(state.faces) == dict(faces)
            version = state.version if is_same else version
        earlier = tuple(replace(state, earlier=()) for state in known.values())
        return CutBone(self.planned, made, faces, version, earlier)

    def _cut(self, name: str) -> Cut:
        face = self.faces.get(name)
        if face is None:
            return Cut(self.made[name], UNSURE_MM)
        tilt_mm = _HALF_FACE_MM * math.radians(face.bound_deg)
        return Cut(face.as_plane, min(SURE_MM + face.bound_mm + tilt_mm, UNSURE_MM))
