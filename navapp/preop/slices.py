"""Slices through a plan, in three directions of the patient, and the contours of surfaces in them.

Slices lie across the axes of LPS, whatever way a CT was recorded: their marks and positions are
then right by construction. They are seen as radiologists see them: the patient's right at the left
of axial and coronal slices, the front at the left of sagittal ones.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.mesh_sections import count_corners
from navapp.geometry.transform import FloatArray

Picture = NDArray[np.uint8]

# What is shown around the bones.
MARGIN_MM = 15.0
_STEP_MM = 1.0
# Larger regions get a longer step: a volume of so many voxels fills a few megabytes.
_MOST_VOXELS = 8_000_000
_STEPS_PER_MM = 4


@dataclass(frozen=True, slots=True)
class Direction:
    """One of three ways to slice. Axes are those of LPS: 0 to the left, 1 back, 2 to the head."""

    name: str
    axis: int  # that the slices lie across
    across: int  # axis that points right in the picture
    down: int  # axis that runs up or down in it
    is_down: bool  # the axis points down in the picture
    marks: tuple[str, str, str, str]  # left, right, top, bottom of the picture
    towards: str  # where slices of a higher number lie

    @property
    def letter(self) -> str:
        """Of the coordinate that is the slice's position."""
        return "xyz"[self.axis]


DIRECTIONS = (
    Direction("axial", 2, 0, 1, True, ("R", "L", "A", "P"), "head"),
    Direction("coronal", 1, 0, 2, False, ("R", "L", "H", "F"), "back"),
    Direction("sagittal", 0, 1, 2, False, ("A", "P", "H", "F"), "left"),
)


@dataclass(frozen=True, slots=True)
class SliceGrid:
    """A lattice of cubes along the axes of LPS; a slice is one layer of it."""

    origin_mm: tuple[float, float, float]  # centre of the first cube
    step_mm: float
    size: tuple[int, int, int]  # cubes along x, y, z

    def __post_init__(self) -> None:
        if not (np.isfinite(self.origin_mm).all() and 0.0 < self.step_mm < np.inf):
            raise ValueError("a grid has a finite place and a positive step")
        if min(self.size) < 1:
            raise ValueError("a grid has at least one cube")

    def count_slices(self, direction: Direction) -> int:
        """How many there are."""
        return self.size[direction.axis]

    def position_mm(self, direction: Direction, index: int) -> float:
        """The coordinate that all points of a slice share."""
        return self.origin_mm[direction.axis] + self.step_mm * index

    def find_slices(self, direction: Direction, points_mm: FloatArray) -> NDArray[np.intp]:
        """Index of the slice that each point is nearest to; may lie beyond the first or last."""
        steps = (points_mm[:, direction.axis] - self.origin_mm[direction.axis]) / self.step_mm
        # Half a step up: a point between two slices belongs to one of them, always the same.
        nearest: NDArray[np.intp] = np.floor(steps + 0.5).astype(np.intp)
        return nearest

    def holds(self, point_mm: FloatArray) -> bool:
        """Whether a point lies in one of the cubes."""
        found = [self.find_slices(one, point_mm[None])[0] for one in DIRECTIONS]
        most = [self.count_slices(one) for one in DIRECTIONS]
        return all(0 <= index < n for index, n in zip(found, most, strict=True))

    def shape_of(self, direction: Direction) -> tuple[int, int]:
        """Rows and columns of a slice."""
        return self.size[direction.down], self.size[direction.across]

    def find_pixels(self, direction: Direction, points_mm: FloatArray) -> FloatArray:
        """(..., 2) column and row of points in a slice, the centre of the first pixel at 0, 0."""
        origin = np.array(self.origin_mm)
        steps = (points_mm - origin) / self.step_mm
        column, row = steps[..., direction.across], steps[..., direction.down]
        if not direction.is_down:
            row = self.size[direction.down] - 1 - row
        return np.stack([column, row], axis=-1)


def make_grid(
    meshes: Sequence[TriangleMesh], bounds_mm: FloatArray | None = None, step_mm: float = _STEP_MM
) -> SliceGrid:
    """The grid around surfaces; its slices lie at whole multiples of the step.

    Args:
        meshes: at least one, LPS mm.
        bounds_mm: (2, 3) that it does not leave: what a CT covers.
        step_mm: that it has, or longer in a region that is very large.
    """
    points = np.concatenate([mesh.vertices_mm for mesh in meshes])
    lower, upper = points.min(axis=0) - MARGIN_MM, points.max(axis=0) + MARGIN_MM
    if bounds_mm is not None:
        lower, upper = np.maximum(lower, bounds_mm[0]), np.minimum(upper, bounds_mm[1])
    volume_mm3 = float(np.maximum(upper - lower, step_mm).prod())
    least_mm = (volume_mm3 / _MOST_VOXELS) ** (1.0 / 3.0)
    if least_mm > step_mm:
        step_mm = float(np.ceil(_STEPS_PER_MM * least_mm) / _STEPS_PER_MM)
    first = np.ceil(lower / step_mm)
    x, y, z = (step_mm * first).tolist()
    n_x, n_y, n_z = np.maximum(np.floor(upper / step_mm) - first + 1, 1).astype(int).tolist()
    return SliceGrid((x, y, z), step_mm, (n_x, n_y, n_z))


def cut_contour(
    points: FloatArray, faces: NDArray[np.int32], axis: int, position: float
) -> FloatArray:
    """(S, 2, 3) segments in which triangles cross the plane `points[:, axis] == position`."""
    height = points[:, axis] - position
    # A vertex in the plane counts as above it: every triangle then crosses in two edges or none.
    is_above = height >= 0.0
    n_above = count_corners(faces, is_above)
    crossing = faces[(n_above > 0) & (n_above < 3)]
    ends = np.empty((len(crossing), 2, 3))
    found = np.zeros(len(crossing), dtype=int)
    for start, end in ((0, 1), (1, 2), (2, 0)):
        a, b = crossing[:, start], crossing[:, end]
        rows = np.flatnonzero(is_above[a] != is_above[b])
        share = height[a[rows]] / (height[a[rows]] - height[b[rows]])
        ends[rows, found[rows]] = points[a[rows]] + share[:, None] * (
            points[b[rows]] - points[a[rows]]
        )
        found[rows] += 1
    return ends
