"""A bone's surface, prepared once for registration."""

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.mesh_edges import open_border
from navapp.geometry.simplify import drawn
from navapp.geometry.transform import FloatArray
from navapp.registration.lookup_kernels import ModelArrays, nearest_vertices
from navapp.registration.vertex_neighbourhoods import compute_curvature, find_neighbours
from navapp.values import BoneModel

_FINEST_VOXEL_MM = 2.0
_MOST_VOXELS = 400_000
_LEAST_SIGMA_MM = 1e-3
_SMOOTHING_ROUNDS = 2
_GRID_MARGIN_MM = 14.0


class RegistrationModel:
    """Model points with normals, the look-up over them, and what must not pair.

    Attributes:
        points_mm: (V, 3) the surface that the camera sees: bone moved out by its mean cartilage.
        normals: (V, 3) of that surface, unit, outward.
        sigma_mm: (V,) of that surface along the normal (model and cartilage).
        is_usable: (V,) False for parts that are cut away.
        seen_mesh: those points and the triangles that are left: what a camera should see.
        centre_mm: (3,) mean of the bone's vertices: the covariance is about this point.
    """

    # Uncertainty of a segmented surface that carries no figure of its own.
    SURFACE_SIGMA_MM = 0.1

    def __init__(self, bone: BoneModel) -> None:
        self.bone = bone
        self.seen_mesh = bone.make_seen_surface()
        self.points_mm: FloatArray = np.array(self.seen_mesh.vertices_mm)
        self.normals: FloatArray = np.array(self.seen_mesh.normals)
        self.sigma_mm: FloatArray = np.hypot(self.SURFACE_SIGMA_MM, bone.cartilage_sd_mm)
        self.is_usable: NDArray[np.bool_] = ~bone.is_removed
        self.centre_mm: FloatArray = bone.mesh.centroid_mm

    @cached_property
    def drawn_mesh(self) -> TriangleMesh:
        """`seen_mesh` in fewer triangles where it has many: what is rendered."""
        return drawn(self.seen_mesh)

    @cached_property
    def is_closed(self) -> bool:
        """What is rendered has no border and looks outward."""
        mesh = self.drawn_mesh
        has_border = open_border(len(mesh.vertices_mm), mesh.faces).any()
        return not has_border and mesh.volume_mm3() > 0.0

    @cached_property
    def drawn_face_sigma_mm(self) -> FloatArray:
        """(F,) `sigma_mm` of the triangles that are rendered."""
        from scipy.spatial import cKDTree

        _, nearest = cKDTree(self.points_mm).query(self.drawn_mesh.vertices_mm, workers=2)
        mean_mm: FloatArray = self.sigma_mm[nearest][self.drawn_mesh.faces].mean(axis=1)
        return mean_mm

    @cached_property
    def arrays(self) -> ModelArrays:
        """What the compiled loops read; made at first use."""
        from scipy.spatial import cKDTree

        # Most places that are asked for lie far from all points: large, loose boxes answer sooner.
        tree = cKDTree(self.points_mm, leafsize=64, compact_nodes=False, balanced_tree=False)
        neighbours = find_neighbours(self.points_mm, self.bone.mesh.faces, tree)
        curvatures, spacing = compute_curvature(self.points_mm, self.normals, neighbours)
        low = self.points_mm.min(axis=0) - _GRID_MARGIN_MM
        size = np.ptp(self.points_mm, axis=0) + 2.0 * _GRID_MARGIN_MM
        voxel = max(_FINEST_VOXEL_MM, float((size.prod() / _MOST_VOXELS) ** (1.0 / 3.0)))
        axes = [low[k] + voxel * np.arange(int(np.ceil(size[k] / voxel)) + 1) for k in range(3)]
        centres = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
        _, nearest = tree.query(centres.reshape(-1, 3), workers=2)
        return ModelArrays(
            np.ascontiguousarray(self.points_mm),
            np.ascontiguousarray(self.normals),
            curvatures,
            spacing,
            np.maximum(self.sigma_mm, _LEAST_SIGMA_MM),
            self.is_usable
            & ~open_border(len(self.points_mm), self.bone.mesh.faces)
            & (np.linalg.norm(self.normals, axis=1) > 0.5),
            neighbours,
            np.asarray(nearest, dtype=np.int32).reshape(centres.shape[:3]),
            low,
            voxel,
        )

    @cached_property
    def hull_mm(self) -> FloatArray:
        """(H, 3) corners of the seen surface's convex hull: they bound it in every view."""
        from scipy.spatial import ConvexHull, QhullError

        try:
            return self.points_mm[ConvexHull(self.points_mm).vertices]
        except QhullError:  # flat
            return self.points_mm

    @cached_property
    def smooth_normals(self) -> FloatArray:
        """(V, 3) unit normals over two rings of neighbours.

        A rough model's own normals look as if they fixed a rotation that its shape leaves free.
        """
        neighbours = self.arrays.neighbours
        is_there = (neighbours >= 0)[..., None]
        normals = self.normals
        for _ in range(_SMOOTHING_ROUNDS):
            around = np.where(is_there, normals[np.maximum(neighbours, 0)], 0.0)
            total = normals + around.sum(axis=1)
            length = np.linalg.norm(total, axis=1, keepdims=True)
            normals = total / np.maximum(length, 1e-12)
        return normals

    def nearest(self, points_mm: FloatArray) -> tuple[NDArray[np.int32], FloatArray]:
        """Index of the nearest model point of each of (N, 3) points, and its distance."""
        index = np.empty(len(points_mm), dtype=np.int32)
        distance = np.empty(len(points_mm))
        nearest_vertices(np.ascontiguousarray(points_mm), self.arrays, index, distance)
        return index, distance
