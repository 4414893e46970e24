"""A bone's surface, prepared once for registration."""

from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError, cKDTree

from navapp.geometry.box import Box
from navapp.geometry.mesh import TriangleMesh, join_meshes
from navapp.geometry.mesh_edges import open_border
from navapp.geometry.rectification import RectifiedGeometry
from navapp.geometry.simplify import drawn, is_closed
from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.geometry.vertex_neighbourhoods import compute_curvature, find_neighbours
from navapp.geometry.zbuffer import RenderedView, render_rectified
from navapp.registration.cartilage_fit import ThicknessField
from navapp.registration.lookup_kernels import ModelArrays, VoxelGrid, fill_model_grid
from navapp.values import BoneModel

# All chosen: of the grid of nearest vertices, and of the smoothed normals.
_FINEST_VOXEL_MM = 2.0
_MOST_VOXELS = 400_000
_GRID_MARGIN_MM = 14.0
_SMOOTHING_ROUNDS = 2
_LEAST_SIGMA_MM = 1e-3
# Widest kernel as a share of the model's radius: 6 mm for a patella; from a radius of 36 mm on the
# usual 12 mm is the limit. Chosen; compared in tests.bench.small_bones.
_KERNEL_PER_RADIUS = 1.0 / 3.0


class RegistrationModel:
    """Model points with normals, the look-up over them, and what must not pair.

    Attributes:
        points_mm: (V, 3) the surface that the camera sees: bone moved out by its mean cartilage.
        normals: (V, 3) of that surface, unit, outward.
        sigma_mm: (V,) of that surface along the normal (model and cartilage).
        is_usable: (V,) False for parts that are cut away.
        seen_mesh: those points and the triangles that are left: what a camera should see.
        centre_mm: (3,) mean of the bone's vertices: the covariance is about this point.
        pairs_backward: model points look for partners in a scene, too; False: scene points alone,
            as in plain ICP.
    """

    # Uncertainty of a segmented surface that carries no figure of its own; chosen.
    SURFACE_SIGMA_MM = 0.1

    def __init__(self, bone: BoneModel, *, pairs_backward: bool = True) -> None:
        self.bone, self.pairs_backward = bone, pairs_backward
        self.seen_mesh = bone.make_seen_surface()
        self.points_mm: FloatArray = np.array(self.seen_mesh.vertices_mm)
        self.normals: FloatArray = np.array(self.seen_mesh.normals)
        self.sigma_mm: FloatArray = np.hypot(self.SURFACE_SIGMA_MM, bone.cartilage_sd_mm)
        self.is_usable: NDArray[np.bool_] = ~bone.is_removed
        self.centre_mm: FloatArray = bone.mesh.centroid_mm

    @cached_property
    def rendered_mesh(self) -> TriangleMesh:
        """`seen_mesh` in fewer triangles where it has many, and its lid: what is rendered."""
        mesh, lid = drawn(self.seen_mesh), self.bone.lid
        return mesh if lid is None else join_meshes(mesh, lid).without_unused_vertices()

    @cached_property
    def thickness(self) -> ThicknessField | None:
        """What the cartilage may differ from the plan by; None where the plan is sure of it."""
        return ThicknessField.over(self.points_mm, self.bone.cartilage_sd_mm)

    @cached_property
    def _n_outward(self) -> int:
        """How many of the triangles rendered, the first, are never drawn from inside.

        All but the lid's, where the bone is closed but for what was removed: then its inner side is
        not seen through a hole either.
        """
        n_lid = 0 if self.bone.lid is None else len(self.bone.lid.faces)
        return len(self.rendered_mesh.faces) - n_lid if is_closed(self.bone.mesh) else 0

    def render(
        self,
        camera_from_bone: RigidTransform,
        geometry: RectifiedGeometry,
        box: Box,
        *,
        has_lid: bool = False,
    ) -> RenderedView:
        """The bone at a pose in a box of the rectified left view; its lid hides, unseen or seen."""
        mesh = self.rendered_mesh
        view = render_rectified(mesh, camera_from_bone, geometry, box, n_outward=self._n_outward)
        if not has_lid:
            self.take_out_lid(view)
        return view

    def take_out_lid(self, view: RenderedView) -> None:
        """Clear a view, in place, where it shows the lid: that hides, and is no bone's surface."""
        if (lid := self.bone.lid) is not None:
            is_lid = view.face_index >= len(self.rendered_mesh.faces) - len(lid.faces)
            view.depth_mm[is_lid], view.face_index[is_lid] = np.nan, -1

    @cached_property
    def rendered_face_sigma_mm(self) -> FloatArray:
        """(F,) `sigma_mm` of the triangles that are rendered."""
        _, nearest = cKDTree(self.points_mm).query(self.rendered_mesh.vertices_mm, workers=2)
        return np.asarray(self.sigma_mm[nearest][self.rendered_mesh.faces].mean(axis=1))

    @cached_property
    def arrays(self) -> ModelArrays:
        """What the compiled loops read; made at first use."""
        neighbours = find_neighbours(self.points_mm, self.bone.mesh.faces)
        curvatures, spacing = compute_curvature(self.points_mm, self.normals, neighbours)
        low = self.points_mm.min(axis=0) - _GRID_MARGIN_MM
        size = np.ptp(self.points_mm, axis=0) + 2.0 * _GRID_MARGIN_MM
        voxel = max(_FINEST_VOXEL_MM, float((size.prod() / _MOST_VOXELS) ** (1.0 / 3.0)))
        shape = np.ceil(size / voxel).astype(int) + 1
        grid = VoxelGrid(np.full(shape, -1, dtype=np.int32), low, voxel)
        fill_model_grid(self.points_mm, neighbours, grid)
        is_border = open_border(len(self.points_mm), self.bone.mesh.faces)
        has_normal = np.linalg.norm(self.normals, axis=1) > 0.5
        return ModelArrays(
            self.points_mm,
            self.normals,
            curvatures,
            spacing,
            np.maximum(self.sigma_mm, _LEAST_SIGMA_MM),
            self.is_usable & ~is_border & has_normal,
            neighbours,
            grid,
        )

    @cached_property
    def hull_mm(self) -> FloatArray:
        """(H, 3) corners of the seen surface's convex hull: they bound it in every view."""
        try:
            return self.points_mm[ConvexHull(self.points_mm).vertices]
        except QhullError:  # flat
            return self.points_mm

    @cached_property
    def radius_mm(self) -> float:
        """Root mean square distance of the surface from the bone's centre."""
        return float(np.sqrt(((self.points_mm - self.centre_mm) ** 2).sum(axis=1).mean()))

    @property
    def widest_kernel_mm(self) -> float:
        """The widest kernel with which the bone is looked for in tissue.

        A wider one pairs a small bone with what lies beside it (tests.bench.small_bones).
        """
        return _KERNEL_PER_RADIUS * self.radius_mm

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
            normals = total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-12)
        return normals
