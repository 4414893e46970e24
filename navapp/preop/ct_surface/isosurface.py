"""A smooth closed surface around a mask of voxels, the start of the refinement."""

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.simplify import simplify
from navapp.preop.segmentation.masks import find_bounds
from navapp.preop.volume import CtVolume, LabelVolume

_SMOOTHING_MM = 0.6
_PADDING = 4
# One vertex a square millimetre is as much as a CT can tell.
_VERTICES_PER_MM2 = 1.0
_WITHIN_MM = 0.3


def make_isosurface(
    mask: NDArray[np.bool_], volume: CtVolume | LabelVolume
) -> tuple[TriangleMesh, float]:
    """A closed surface around the largest piece of a mask, LPS mm, normals outward.

    Args:
        mask: (D, H, W) of the volume's voxels; where the volume ends the surface is closed flat.
        volume: says where the voxels are.

    Returns:
        The surface, and what share of the mask's volume is in other pieces.
    """
    import open3d
    from scipy.ndimage import gaussian_filter

    box = find_bounds(mask, np.zeros(3, dtype=np.intp))
    padded = np.pad(mask[box], _PADDING).astype(np.float32)
    smooth = gaussian_filter(padded, _SMOOTHING_MM / volume.spacing_mm[::-1], truncate=3.0)
    found = open3d.t.geometry.TriangleMesh.create_isosurfaces(
        open3d.core.Tensor.from_numpy(np.ascontiguousarray(smooth)), [0.5]
    )
    # Its points are ordered as indices i, j, k.
    indices = found.vertex.positions.numpy().astype(np.float64) - _PADDING
    indices += [edge.start for edge in box[::-1]]
    faces = found.triangle.indices.numpy().astype(np.int32)
    pieces = TriangleMesh(volume.points_lps_mm(indices), faces)
    mesh = pieces.largest_component()
    if mesh.volume_mm3() < 0.0:
        pieces, mesh = pieces.flip(), mesh.flip()
    wanted = int(_VERTICES_PER_MM2 * mesh.face_areas_mm2().sum())
    return simplify(mesh, wanted, _WITHIN_MM), _left_out(pieces)


def _left_out(pieces: TriangleMesh) -> float:
    """Share of the volume outside the largest piece; hollows in it are pieces turned inside out."""
    volumes = np.bincount(pieces.component_of_faces(), pieces.face_volumes_mm3())
    solid = volumes[volumes > 0.0]
    return float(1.0 - solid.max() / solid.sum()) if len(solid) else 0.0
