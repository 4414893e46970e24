"""The z-buffer: what a camera sees of a mesh at a pose."""

import math
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.bands import in_row_bands
from navapp.geometry.box import Box
from navapp.geometry.camera import Camera
from navapp.geometry.lane_kernels import FLOAT_LANES
from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.rectification import RectifiedGeometry
from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.geometry.zbuffer_kernels import (
    bounds_of_points,
    project_points,
    render_rows,
)


@dataclass(frozen=True, slots=True, eq=False)
class RenderedView:
    """Depth and triangle per pixel of a box."""

    # (h, w) float32 along the optical axis, NaN where the mesh is not seen.
    depth_mm: NDArray[np.float32]
    face_index: NDArray[np.int32]  # (h, w) int32, -1 where the mesh is not seen
    box: Box  # place of the buffer in the picture; it may reach beyond the picture

    @property
    def mask(self) -> NDArray[np.bool_]:
        """(h, w) pixels where the mesh is seen."""
        seen: NDArray[np.bool_] = self.face_index >= 0
        return seen


def render(
    mesh: TriangleMesh,
    camera_from_mesh: RigidTransform,
    camera: Camera,
    *,
    is_whole: bool = True,
    n_outward: int = 0,
) -> RenderedView:
    """The mesh as that camera sees it, lens distortion included (exact at the vertices).

    Args:
        mesh: what is seen.
        camera_from_mesh: its pose.
        camera: that sees it.
        is_whole: the whole picture; otherwise only the box around the mesh, empty out of view.
        n_outward: as for `render_rectified`.
    """
    projected = ProjectedMesh.of(camera_from_mesh.apply(mesh.vertices_mm), mesh.faces, camera)
    return projected.render(is_whole=is_whole, n_outward=n_outward)


@dataclass(frozen=True, slots=True, eq=False)
class ProjectedMesh:
    """A mesh in a camera's picture: where it lies is known before it is drawn."""

    pixels: FloatArray  # (V, 2)
    depths_mm: FloatArray  # (V,)
    faces: NDArray[np.int32]  # (F, 3)
    box: Box  # around it, inside the picture; empty out of view
    whole: Box  # the picture

    @classmethod
    def of(cls, points_mm: FloatArray, faces: NDArray[np.int32], camera: Camera) -> "ProjectedMesh":
        """Triangles (F, 3) of points (N, 3) in the camera's frame."""
        pixels = camera.project(points_mm)
        around = Box.around(pixels)
        box = Box(0, 0, 0, 0) if around is None else around.clip(camera.width, camera.height)
        whole = Box(0, 0, camera.width, camera.height)
        return cls(pixels, points_mm[:, 2].copy(), faces, box, whole)

    def render(self, *, is_whole: bool = False, n_outward: int = 0) -> RenderedView:
        """Options as of the function `render`."""
        box = self.whole if is_whole else self.box
        return _raster(self.pixels - (box.x, box.y), self.depths_mm, self.faces, box, n_outward)


def render_rectified(
    mesh: TriangleMesh,
    rectified_from_mesh: RigidTransform,
    geometry: RectifiedGeometry,
    box: Box,
    *,
    n_outward: int = 0,
) -> RenderedView:
    """The mesh in a box of the rectified left view.

    Args:
        mesh: what is seen.
        rectified_from_mesh: its pose.
        geometry: of the rectified pair.
        box: part of the left view.
        n_outward: so many triangles, the first, look outward and show no inner side: half of them
            need not be drawn.
    """
    pixels, depths_mm = np.empty((len(mesh.vertices_mm), 2)), np.empty(len(mesh.vertices_mm))
    project_points(
        mesh.vertices_mm, rectified_from_mesh.rotation, rectified_from_mesh.translation_mm,
        geometry.focal_px, (geometry.centre_x_px - box.x, geometry.centre_y_px - box.y),
        pixels, depths_mm,
    )  # fmt: skip
    return _raster(pixels, depths_mm, mesh.faces, box, n_outward)


def bounds_of(
    points_mm: FloatArray, rectified_from_points: RigidTransform, geometry: RectifiedGeometry
) -> tuple[Box | None, tuple[float, float]]:
    """What bounds (N, 3) points in the rectified left view, and the least and largest depth, mm.

    The box is clipped to the picture, and None when all points are out of view.
    """
    u0, v0, u1, v1, near_mm, far_mm = bounds_of_points(
        points_mm, rectified_from_points.rotation, rectified_from_points.translation_mm,
        geometry.focal_px, (geometry.centre_x_px, geometry.centre_y_px),
    )  # fmt: skip
    if not u0 < np.inf:
        return None, (near_mm, far_mm)
    x, y = math.floor(u0), math.floor(v0)
    around = Box(x, y, math.ceil(u1) - x + 1, math.ceil(v1) - y + 1)
    clipped = around.clip(geometry.width, geometry.height)
    return None if clipped.is_empty else clipped, (near_mm, far_mm)


def find_known_range(values: NDArray[np.float32]) -> tuple[float, float]:
    """Least and largest of the numbers that are known; of none, infinity and its negative."""
    least = np.fmin.reduce(values, axis=None, initial=np.inf)
    return float(least), float(np.fmax.reduce(values, axis=None, initial=-np.inf))


def _raster(
    pixels: FloatArray,
    depths_mm: FloatArray,
    faces: NDArray[np.int32],
    box: Box,
    n_outward: int = 0,
) -> RenderedView:
    """The triangles of vertices at pixels (V, 2) of the box, whose first pixel is (0, 0)."""
    height, width = max(box.height, 0), max(box.width, 0)
    depth = np.empty((height, width), dtype=np.float32)
    face_index = np.empty(depth.shape, dtype=np.int32)
    inverse_depth = np.zeros((height, width + FLOAT_LANES), dtype=np.float32)
    face_code = np.full(inverse_depth.shape, -1, dtype=np.int32)
    writable = np.array(faces)

    if not box.is_empty:
        draw = partial(
            render_rows, pixels, depths_mm, writable, n_outward, inverse_depth=inverse_depth,
            face_code=face_code.view(np.float32), coded=face_code, depth=depth,
            face_index=face_index,
        )  # fmt: skip
        in_row_bands(box.height, draw)
    return RenderedView(depth, face_index, box)
