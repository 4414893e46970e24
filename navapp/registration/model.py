"""A bone's surface, prepared once for look-ups."""

from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.transform import FloatArray
from navapp.registration.lookup_kernels import nearest_vertices
from navapp.values import BoneModel

_GRID_SPACING_MM = 2.0
_GRID_MARGIN_MM = 14.0
_MAX_NEIGHBOURS = 12


class RegistrationModel:
    """Model points with normals, the look-up over them, and what must not pair.

    Attributes:
        points_mm: (V, 3) the surface that the camera sees: bone moved out by its mean cartilage.
        normals: (V, 3) unit, outward.
        sigma_mm: (V,) of the surface along the normal (model and cartilage).
        is_usable: (V,) False for parts that a stage removed.
        seen_mesh: those points and the triangles that are left: what a camera should see.
        centre_mm: (3,) mean of the bone's vertices: the covariance is about this point.
    """

    # Uncertainty of a segmented surface that carries no figure of its own.
    SURFACE_SIGMA_MM = 0.1

    def __init__(self, bone: BoneModel) -> None:
        mesh = bone.mesh
        self.bone = bone
        self.points_mm: FloatArray = mesh.vertices_mm + bone.cartilage_mm[:, None] * mesh.normals
        self.normals: FloatArray = np.array(mesh.normals)
        self.sigma_mm: FloatArray = np.hypot(self.SURFACE_SIGMA_MM, bone.cartilage_sd_mm)
        self.is_usable: NDArray[np.bool_] = ~bone.is_removed
        is_left = self.is_usable[mesh.faces].all(axis=1)
        self.seen_mesh = TriangleMesh(self.points_mm, mesh.faces[is_left], mesh.normals)
        self.centre_mm: FloatArray = mesh.centroid_mm

    @cached_property
    def _tree(self) -> Any:
        from scipy.spatial import cKDTree

        return cKDTree(self.points_mm)

    @cached_property
    def _grid(self) -> tuple[NDArray[np.int32], FloatArray]:
        """Nearest vertex per voxel around the bone, and the centre of the first voxel."""
        low = self.points_mm.min(axis=0) - _GRID_MARGIN_MM
        size = np.ptp(self.points_mm, axis=0) + 2.0 * _GRID_MARGIN_MM
        counts = np.ceil(size / _GRID_SPACING_MM).astype(int) + 1
        axes = [low[k] + _GRID_SPACING_MM * np.arange(counts[k]) for k in range(3)]
        centres = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
        _, index = self._tree.query(centres)
        return index.astype(np.int32).reshape(tuple(counts)), low

    @cached_property
    def _neighbours(self) -> NDArray[np.int32]:
        """(V, K) vertices that share an edge with each vertex, padded with -1."""
        faces = self.bone.mesh.faces
        pairs = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
        pairs = np.unique(np.concatenate([pairs, pairs[:, ::-1]]), axis=0)
        starts = np.searchsorted(pairs[:, 0], np.arange(len(self.points_mm) + 1))
        rank = np.arange(len(pairs)) - starts[pairs[:, 0]]
        table = np.full((len(self.points_mm), _MAX_NEIGHBOURS), -1, dtype=np.int32)
        kept = rank < _MAX_NEIGHBOURS
        table[pairs[kept, 0], rank[kept]] = pairs[kept, 1]
        return table

    def nearest(
        self, points_mm: FloatArray, radius_mm: float
    ) -> tuple[NDArray[np.intp], FloatArray]:
        """Index of the nearest usable model point and its distance; infinite beyond the radius.

        Radii up to 14 mm use the grid; larger ones the exact tree.
        """
        if radius_mm > _GRID_MARGIN_MM:
            distance, index = self._tree.query(points_mm, distance_upper_bound=radius_mm)
            index = np.minimum(index, len(self.points_mm) - 1)
        else:
            grid, origin = self._grid
            found = np.empty(len(points_mm), dtype=np.int32)
            distance = np.empty(len(points_mm))
            nearest_vertices(
                np.ascontiguousarray(points_mm), self.points_mm, self._neighbours, grid, origin,
                _GRID_SPACING_MM, found, distance,
            )  # fmt: skip
            index = np.maximum(found, 0).astype(np.intp)
            distance = np.where(distance <= radius_mm, distance, np.inf)
        return index, np.where(self.is_usable[index], distance, np.inf)
