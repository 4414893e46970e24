"""The z-buffer: what a camera sees of a mesh at a pose."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.bands import in_row_bands
from navapp.geometry.camera import Camera
from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.rectification import Box, RectifiedGeometry
from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.geometry.zbuffer_kernels import raster_nearest

# A vertex hidden by less than this is still the surface itself, seen at a grazing angle.
_SELF_OCCLUSION_MM = 1.0


@dataclass(frozen=True, slots=True, eq=False)
class RenderedView:
    """Depth and triangle per pixel of a box.

    Attributes:
        depth_mm: (h, w) float32 along the optical axis, NaN where the mesh is not seen.
        face_index: (h, w) int32, -1 where the mesh is not seen.
        box: place of the buffer in the picture; it may reach beyond the picture.
    """

    depth_mm: NDArray[np.float32]
    face_index: NDArray[np.int32]
    box: Box

    @property
    def mask(self) -> NDArray[np.bool_]:
        """(h, w) pixels where the mesh is seen."""
        seen: NDArray[np.bool_] = self.face_index >= 0
        return seen

    def silhouette(self) -> NDArray[np.bool_]:
        """(h, w) seen pixels with an unseen 4-neighbour."""
        seen = np.pad(self.mask, 1)
        inner = seen[:-2, 1:-1] & seen[2:, 1:-1] & seen[1:-1, :-2] & seen[1:-1, 2:]
        edge: NDArray[np.bool_] = self.mask & ~inner
        return edge


def render(
    mesh: TriangleMesh,
    camera_from_mesh: RigidTransform,
    camera: Camera,
    *,
    is_whole: bool = True,
) -> RenderedView:
    """The mesh as that camera sees it, lens distortion included (exact at the vertices).

    Args:
        mesh: what is seen.
        camera_from_mesh: its pose.
        camera: that sees it.
        is_whole: the whole picture; otherwise only the box around the mesh, empty out of view.
    """
    points_mm = camera_from_mesh.apply(mesh.vertices_mm)
    pixels = camera.project(points_mm)
    box = Box(0, 0, camera.width, camera.height)
    if not is_whole:
        around = Box.around(pixels)
        box = Box(0, 0, 0, 0) if around is None else around.clipped(camera.width, camera.height)
    return _raster(pixels, points_mm[:, 2], mesh.faces, box)


def render_rectified(
    mesh: TriangleMesh,
    rectified_from_mesh: RigidTransform,
    geometry: RectifiedGeometry,
    box: Box,
    *,
    is_closed: bool = False,
) -> RenderedView:
    """The mesh in a box of the rectified left view.

    Args:
        mesh: what is seen.
        rectified_from_mesh: its pose.
        geometry: of the rectified pair.
        box: part of the left view.
        is_closed: the mesh has no border, and its triangles look outward: half of them need not be
            drawn.
    """
    points_mm = rectified_from_mesh.apply(mesh.vertices_mm)
    return _raster(geometry.project(points_mm), points_mm[:, 2], mesh.faces, box, is_closed)


def projected_box(
    mesh: TriangleMesh, rectified_from_mesh: RigidTransform, geometry: RectifiedGeometry
) -> Box | None:
    """Box around the mesh in the rectified left view, clipped; None when it is out of view."""
    return box_around(rectified_from_mesh.apply(mesh.vertices_mm), geometry)


def box_around(points_mm: FloatArray, geometry: RectifiedGeometry) -> Box | None:
    """Box around (N, 3) points in the rectified left view, clipped; None when out of view."""
    around = Box.around(geometry.project(points_mm))
    if around is None:
        return None
    clipped = around.clipped(geometry.width, geometry.height)
    return None if clipped.is_empty else clipped


def unhidden_vertices(
    mesh: TriangleMesh,
    rectified_from_mesh: RigidTransform,
    geometry: RectifiedGeometry,
    view: RenderedView,
) -> NDArray[np.bool_]:
    """(V,) vertices that the view shows: inside its box and not behind another part of the mesh."""
    points_mm = rectified_from_mesh.apply(mesh.vertices_mm)
    pixels = geometry.project(points_mm)
    finite = np.isfinite(pixels).all(axis=1)
    column = np.full(len(pixels), -1)
    row = np.full(len(pixels), -1)
    # Rounding by floor(u + 0.5): pixel centres lie at integers.
    column[finite] = np.floor(pixels[finite, 0] + 0.5).astype(int) - view.box.x
    row[finite] = np.floor(pixels[finite, 1] + 0.5).astype(int) - view.box.y
    inside = (column >= 0) & (column < view.box.width) & (row >= 0) & (row < view.box.height)
    shown = np.zeros(len(pixels), dtype=bool)
    surface_mm = view.depth_mm[row[inside], column[inside]]
    shown[inside] = points_mm[inside, 2] <= surface_mm + _SELF_OCCLUSION_MM
    return shown


def _raster(
    pixels: FloatArray,
    depths_mm: FloatArray,
    faces: NDArray[np.int32],
    box: Box,
    is_closed: bool = False,
) -> RenderedView:
    inverse_depth = np.zeros((max(box.height, 0), max(box.width, 0)), dtype=np.float32)
    face_index = np.full(inverse_depth.shape, -1, dtype=np.int32)
    if not box.is_empty and len(faces):
        shifted, depths = np.ascontiguousarray(pixels - (box.x, box.y)), depths_mm.copy()
        writable = np.array(faces)
        in_row_bands(
            box.height,
            lambda first, last: raster_nearest(
                shifted, depths, writable, inverse_depth, face_index, (first, last), is_closed
            ),
        )
    depth = np.full(inverse_depth.shape, np.nan, dtype=np.float32)
    np.divide(1.0, inverse_depth, out=depth, where=face_index >= 0)
    return RenderedView(depth, face_index, box)
