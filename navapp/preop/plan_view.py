"""What a person needs to check a plan by eye: its slices, surfaces, points and origin."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.transform import FloatArray
from navapp.preop.plan_origin import PlanOrigin
from navapp.preop.slice_volume import SliceVolume
from navapp.preop.slices import Direction, SliceGrid, cut_contour, make_grid
from navapp.values import Plan


@dataclass(frozen=True, slots=True, eq=False)
class PlanView:
    """A plan with its slices."""

    plan: Plan
    origin: PlanOrigin
    volume: SliceVolume  # without grey values where there is no CT

    @property
    def grid(self) -> SliceGrid:
        """Of the slices."""
        return self.volume.grid

    @property
    def has_pictures(self) -> bool:
        """There is more to see than contours."""
        return self.volume.grey is not None

    @property
    def slices_words(self) -> str:
        """What the slices show, in a sentence."""
        if self.volume.range_hu is not None:
            return "The slices are those of the CT, with the contours of the surfaces."
        if self.has_pictures:
            return "The slices are those of the segmentation, with the contours of the surfaces."
        if self.origin.kind == "surfaces":
            return "Made from surfaces, without a CT: contours alone, on black."
        return "The plan was made without slices: contours alone, on black. Make it again for them."

    def find_contours(self, direction: Direction, index: int) -> dict[str, FloatArray]:
        """Bone -> (S, 2, 2) segments of its surface in a slice, in its pixels."""
        position_mm = self.grid.position_mm(direction, index)
        found = {}
        for name, bone in self.plan.bones.items():
            mesh = bone.mesh
            ends = cut_contour(mesh.vertices_mm, mesh.faces, direction.axis, position_mm)
            if len(ends):
                found[name] = self.grid.find_pixels(direction, ends)
        return found

    def find_points(self, direction: Direction, index: int) -> dict[str, FloatArray]:
        """Name -> (2,) column and row of the landmarks and targets nearest to this slice."""
        return {
            name: self.grid.find_pixels(direction, point_mm)
            for name, point_mm in self.points_mm.items()
            if self.grid.find_slices(direction, point_mm[None])[0] == index
        }

    def list_pointed(self, direction: Direction) -> NDArray[np.intp]:
        """Indices of the slices that have a landmark or a target, rising."""
        points_mm = np.reshape(list(self.points_mm.values()), (-1, 3))
        return np.unique(self.grid.find_slices(direction, points_mm))

    @property
    def points_mm(self) -> dict[str, FloatArray]:
        """Name -> (3,) LPS mm of the landmarks and targets that lie within the slices."""
        named = name_points(self.plan)
        return {name: point_mm for name, point_mm in named.items() if self.grid.holds(point_mm)}

    @property
    def points_beyond(self) -> tuple[str, ...]:
        """Names of those that lie outside: the centres of hip and ankle."""
        named = name_points(self.plan)
        return tuple(name for name, point_mm in named.items() if not self.grid.holds(point_mm))


def make_plan_view(
    plan: Plan, origin: PlanOrigin | None = None, volume: SliceVolume | None = None
) -> PlanView:
    """Of a plan in memory; without a volume, slices hold contours alone."""
    if volume is None:
        volume = SliceVolume(make_grid([bone.mesh for bone in plan.bones.values()]))
    return PlanView(plan, origin or PlanOrigin(), volume)


def name_points(plan: Plan) -> Mapping[str, FloatArray]:
    """Name -> (3,) LPS mm of each landmark and target; several of one name are counted."""
    named = {name: landmark.point_mm for name, landmark in plan.content.landmarks.items()}
    for name, points in plan.targets.items():
        rows = np.reshape(points, (-1, 3))
        if len(rows) == 1:
            named.setdefault(name, rows[0])
        else:
            named.update({f"{name} {k}": row for k, row in enumerate(rows, 1)})
    return MappingProxyType(named)
