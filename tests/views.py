"""What a rendered mesh shows, for tests."""

import numpy as np

from navapp.geometry.box import Box
from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.rectification import RectifiedGeometry
from navapp.geometry.transform import RigidTransform
from navapp.geometry.zbuffer import RenderedView, bounds_of

# A vertex hidden by less than this is still the surface itself, seen at a grazing angle.
SELF_OCCLUSION_MM = 1.0


def project_box(
    mesh: TriangleMesh, rectified_from_mesh: RigidTransform, geometry: RectifiedGeometry
) -> Box | None:
    """Box around the mesh in the rectified left view, clipped; None when it is out of view."""
    return bounds_of(mesh.vertices_mm, rectified_from_mesh, geometry)[0]


def find_silhouette(view: RenderedView) -> np.ndarray:
    """(h, w) seen pixels with an unseen 4-neighbour."""
    seen = np.pad(view.mask, 1)
    inner = seen[:-2, 1:-1] & seen[2:, 1:-1] & seen[1:-1, :-2] & seen[1:-1, 2:]
    return view.mask & ~inner


def find_unhidden_vertices(
    mesh: TriangleMesh,
    rectified_from_mesh: RigidTransform,
    geometry: RectifiedGeometry,
    view: RenderedView,
) -> np.ndarray:
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
    shown[inside] = points_mm[inside, 2] <= surface_mm + SELF_OCCLUSION_MM
    return shown
