"""What the layers draw: one bone at one pose, seen from somewhere, and what stands before it."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.box import Box
from navapp.geometry.camera import Camera
from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.simplify import count_outward, drawn
from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.geometry.zbuffer import ProjectedMesh, RenderedView, find_known_range
from navapp.overlay.blend_kernels import find_weights
from navapp.overlay.colours import CANDIDATE, GUIDE, Colour
from navapp.overlay.stroke_kernels import Ground
from navapp.overlay.viewpoints import FloatMap, SeenDepth, Viewpoint
from navapp.values import (
    DrillAxis,
    Foreground,
    Part,
    Plan,
    ResectionPlane,
    RiskStructure,
    StageSpec,
)

_Planned = TypeVar("_Planned")

# Guides on the bone are drawn over this margin around its picture: lines beside it as well.
_MARGIN_PX = 48
# Chosen on simulated knees. What is matched nearer than the bone by more than this lies on it: less
# is within the error of the coarse map.
TISSUE_MM = 2.5
# A guide this far behind the bone's surface is beneath it; what is drawn simplified, and cut into
# straight pieces, lies as near.
SKIN_MM = 1.0
# Beside the bone, what stands off by more than this from its nearest point hides guides.
_ASIDE_MM = 5.0
# Of what is drawn beneath something, or where that is not known.
BENEATH_WEIGHT = 0.55


@dataclass(frozen=True, eq=False)
class Scene:
    """One bone at one pose, the guides of its stage, and what is known of the depth."""

    plan: Plan
    stage: StageSpec
    left_from_bone: RigidTransform
    viewpoint: Viewpoint
    is_candidate: bool  # nobody has accepted the pose
    # None: nothing is known of what stands in front of the bone.
    foreground: Foreground | None = None
    layers: tuple[str, ...] = ()  # to be drawn, in the order of the table of layers
    surface: TriangleMesh | None = None  # what is left of the bone; None: all of it
    # names of cuts, holes and parts that need no guides any more.
    made_steps: frozenset[str] = frozenset()

    @property
    def mesh(self) -> TriangleMesh:
        """Of the bone, as planned."""
        return self.plan.bones[self.stage.bone].mesh

    @property
    def drawn_mesh(self) -> TriangleMesh:
        """What is left of the bone, in as many triangles as a picture can show."""
        return drawn(self.mesh if self.surface is None else self.surface)

    @property
    def camera(self) -> Camera:
        """That the picture is drawn for."""
        return self.viewpoint.camera

    @property
    def guess_weight(self) -> float:
        """Of guides where the depth is not known: as beneath over video, unlit in the mirror."""
        return BENEATH_WEIGHT if self.viewpoint.is_video else 0.0

    @property
    def colour(self) -> Colour:
        """Of the bone's outline."""
        return CANDIDATE if self.is_candidate else GUIDE

    def to_camera(self, points_mm: FloatArray) -> FloatArray:
        """(N, 3) points of the bone in the frame of the picture's camera."""
        return self.viewpoint.to_camera(self.left_from_bone.apply(points_mm))

    @property
    def picture_axes_in_bone(self) -> FloatArray:
        """(2, 3) unit directions of the picture's columns and rows, in the bone's coordinates."""
        axes: FloatArray = self.viewpoint.axes_in_left[:2] @ self.left_from_bone.rotation
        return axes

    @property
    def axis_in_bone(self) -> FloatArray:
        """(3,) unit direction in which the picture is seen, in the bone's coordinates."""
        axis: FloatArray = self.viewpoint.axes_in_left[2] @ self.left_from_bone.rotation
        return axis

    @property
    def planes(self) -> Mapping[str, ResectionPlane]:
        """The stage's that are still to be cut, by name."""
        return self._to_make(self.plan.planes_of(self.stage))

    @property
    def drills(self) -> Mapping[str, DrillAxis]:
        """The stage's that are still to be drilled, by name."""
        return self._to_make(self.plan.of_stage(self.plan.content.drills, "drills", self.stage))

    @property
    def parts(self) -> Mapping[str, Part]:
        """The stage's that are still to be put in, by name."""
        return self._to_make(self.plan.of_stage(self.plan.content.parts, "parts", self.stage))

    def _to_make(self, planned: Mapping[str, _Planned]) -> dict[str, _Planned]:
        return {name: one for name, one in planned.items() if name not in self.made_steps}

    @property
    def risks(self) -> Mapping[str, RiskStructure]:
        """The stage's, by name; curves without a safety distance move with the femur."""
        alone = {name: RiskStructure("femur", 0.0) for name in self.plan.curves}
        risks = {**alone, **self.plan.content.risks}
        return self.plan.of_stage(risks, "risks", self.stage)

    def render(self, mesh: TriangleMesh) -> RenderedView:
        """A mesh in the bone's coordinates; only the box around it."""
        return self._project(mesh).render(n_outward=count_outward(mesh))

    def _project(self, mesh: TriangleMesh) -> ProjectedMesh:
        return ProjectedMesh.of(self.to_camera(mesh.vertices_mm), mesh.faces, self.camera)

    @cached_property
    def _projected(self) -> ProjectedMesh:
        return self._project(self.drawn_mesh)

    @cached_property
    def view(self) -> RenderedView:
        """The bone's part of the picture; rendered once."""
        return self._projected.render(n_outward=count_outward(self.drawn_mesh))

    @cached_property
    def box(self) -> Box:
        """Where the order of things is known: the bone's box and a margin, in the picture."""
        if self._projected.box.is_empty:
            return self._projected.box
        return self._projected.box.grow(_MARGIN_PX).clip(self.camera.width, self.camera.height)

    @cached_property
    def bone_mm(self) -> FloatMap:
        """(h, w) depth of the bone over `box`, NaN beside it."""
        depth_mm = np.full((self.box.height, self.box.width), np.nan, dtype=np.float32)
        depth_mm[self.view.box.relative_to(self.box).slices] = self.view.depth_mm
        return depth_mm

    @cached_property
    def seen(self) -> SeenDepth | None:
        """What was measured of the depth, over `box`; None when nothing was."""
        if self.foreground is None or self.box.is_empty:
            return None
        return self.viewpoint.see(self.foreground, self.box)

    @cached_property
    def _order(self) -> tuple[FloatMap, FloatMap, NDArray[np.bool_]]:
        """(h, w) over `box`: weight of guides on the bone, depth of what is nearest, is hidden."""
        shape = self.bone_mm.shape
        if self.seen is None:
            weight = np.full(shape, self.guess_weight, dtype=np.float32)
            return weight, self.bone_mm, np.zeros(shape, dtype=np.bool_)
        weight, nearest_mm = np.empty((2, *shape), dtype=np.float32)
        is_hidden = np.empty(shape, dtype=np.bool_)
        find_weights(
            self.bone_mm, self.seen.depth_mm, self.seen.is_guess,
            (self.box.x % 2, self.box.y % 2), self.seen.in_front, TISSUE_MM, self._aside_mm,
            BENEATH_WEIGHT, self.guess_weight, weight, nearest_mm, is_hidden,
        )  # fmt: skip
        return weight, nearest_mm, is_hidden

    @property
    def weight(self) -> FloatMap:
        """(h, w) over `box`: 0 to 1, how strongly a guide on the bone is drawn in each pixel."""
        return self._order[0]

    def weight_over(self, box: Box) -> FloatMap:
        """The weights over another box, not to be changed; beyond `box` nothing is known."""
        if box.intersect(self.box) == box:
            return self.weight[box.relative_to(self.box).slices]
        weight = np.full((box.height, box.width), self.guess_weight, dtype=np.float32)
        here, there = box.shared_slices(self.box)
        weight[here] = self.weight[there]
        return weight

    @cached_property
    def ground(self) -> Ground:
        """What lines and points of guides are compared with."""
        weight, nearest_mm, is_hidden = self._order
        skin_mm, beneath, beyond = (
            np.float32(value) for value in (SKIN_MM, BENEATH_WEIGHT, self.guess_weight)
        )
        maps = weight, nearest_mm, is_hidden
        return Ground(self.box.x, self.box.y, *maps, skin_mm, beneath, beyond)

    def weight_of(self, view: RenderedView, box: Box) -> FloatMap:
        """The weights over a box of another mesh: those of beneath where the bone is nearer."""
        weight = self.weight_over(box).copy()
        here, there = box.shared_slices(self.box)
        mesh_mm = np.full(weight.shape, np.nan, dtype=np.float32)
        mesh_mm[view.box.relative_to(box).slices] = view.depth_mm
        # A comparison with an unknown depth is False.
        is_beneath = mesh_mm[here] > self.bone_mm[there] + np.float32(SKIN_MM)
        np.minimum(weight[here], np.float32(BENEATH_WEIGHT), out=weight[here], where=is_beneath)
        return weight

    @property
    def _aside_mm(self) -> float:
        nearest_mm, _ = find_known_range(self.view.depth_mm)
        return nearest_mm - _ASIDE_MM
