"""Triangle meshes: the surface of a bone, an instrument, a drape."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.transform import FloatArray, RigidTransform, read_only

IntArray = NDArray[np.int32]

# Of the angle between a vertex's normal and the way to the camera.
_LEAST_COSINE = 0.2


@dataclass(frozen=True, slots=True, eq=False)
class TriangleMesh:
    """Vertices in mm and triangles seen counter-clockwise from outside.

    Raises:
        ValueError: wrong shapes, an index out of range, a value that is not finite.
    """

    vertices_mm: FloatArray  # (V, 3) float64
    faces: IntArray  # (F, 3) int32 indices into the vertices
    # (V, 3) float64 unit vertex normals, area weighted; computed when not given.
    normals: FloatArray = field(default_factory=lambda: np.empty((0, 3)))

    def __post_init__(self) -> None:
        vertices = read_only(self.vertices_mm)
        faces = read_only(self.faces, np.int32)
        if vertices.ndim != 2 or vertices.shape[1] != 3 or not np.isfinite(vertices).all():
            raise ValueError("vertices must be finite and of shape (V, 3)")
        if faces.ndim != 2 or faces.shape[1] != 3:
            raise ValueError("faces must be of shape (F, 3)")
        if len(faces) and (faces.min() < 0 or faces.max() >= len(vertices)):
            raise ValueError("a face names a vertex that does not exist")
        normals = self.normals
        if len(normals) == 0:
            normals = vertex_normals(vertices, faces)
        if normals.shape != vertices.shape or not np.isfinite(normals).all():
            raise ValueError("there must be one finite normal per vertex")
        object.__setattr__(self, "vertices_mm", vertices)
        object.__setattr__(self, "faces", faces)
        object.__setattr__(self, "normals", read_only(normals))

    @property
    def centroid_mm(self) -> FloatArray:
        """(3,) mean of the vertices."""
        centroid: FloatArray = self.vertices_mm.mean(axis=0)
        return centroid

    @property
    def size_mm(self) -> FloatArray:
        """(3,) extent along the axes."""
        extent: FloatArray = np.ptp(self.vertices_mm, axis=0)
        return extent

    def volume_mm3(self) -> float:
        """Signed volume (positive when the normals point outwards), from signed tetrahedra."""
        return float(self.face_volumes_mm3().sum())

    def face_volumes_mm3(self) -> FloatArray:
        """(F,) signed volumes of the tetrahedra on the triangles, tips at the centroid."""
        if len(self.faces) == 0:
            return np.empty(0)
        corners = (self.vertices_mm - self.centroid_mm)[self.faces]
        volumes: FloatArray = (
            np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6.0
        )
        return volumes

    def face_areas_mm2(self) -> FloatArray:
        """(F,) areas of the triangles."""
        a, b, c = (self.vertices_mm[self.faces[:, corner]] for corner in range(3))
        areas: FloatArray = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
        return areas

    def visible_vertices(self, camera_from_mesh: RigidTransform) -> NDArray[np.bool_]:
        """(V,) vertices that face a camera: n . v < -0.2 |v| (occlusion is not tested)."""
        # What is compiled is not loaded by those who only read meshes.
        from navapp.geometry.facing_kernels import find_facing

        # In the mesh's frame, nothing but the camera has to be moved.
        camera_mm = camera_from_mesh.inverse().translation_mm
        is_facing = np.empty(len(self.vertices_mm), dtype=np.bool_)
        find_facing(camera_mm, self.vertices_mm, self.normals, _LEAST_COSINE, is_facing)
        return is_facing

    def transform(self, target_from_source: RigidTransform) -> "TriangleMesh":
        """The mesh in the target frame."""
        return TriangleMesh(
            target_from_source.apply(self.vertices_mm),
            self.faces,
            target_from_source.rotate(self.normals),
        )

    def flip(self) -> "TriangleMesh":
        """The same surface with the other side outside."""
        return TriangleMesh(self.vertices_mm, self.faces[:, ::-1], -self.normals)

    def component_of_faces(self) -> IntArray:
        """(F,) number of the connected piece of each triangle."""
        from scipy.sparse import coo_matrix
        from scipy.sparse.csgraph import connected_components

        n = len(self.vertices_mm)
        rows = np.concatenate([self.faces[:, 0], self.faces[:, 1]])
        columns = np.concatenate([self.faces[:, 1], self.faces[:, 2]])
        graph = coo_matrix((np.ones(len(rows), dtype=np.int8), (rows, columns)), shape=(n, n))
        _, label_of_vertex = connected_components(graph, directed=False)
        component: IntArray = label_of_vertex[self.faces[:, 0]].astype(np.int32)
        return component

    def largest_component(self) -> "TriangleMesh":
        """The connected piece with the most triangles, without unused vertices."""
        if len(self.faces) == 0:
            return TriangleMesh(np.empty((0, 3)), self.faces)
        component = self.component_of_faces()
        kept = self.faces[component == int(np.bincount(component).argmax())]
        return TriangleMesh(self.vertices_mm, kept).without_unused_vertices()

    def without_unused_vertices(self) -> "TriangleMesh":
        """The same triangles and normals, and only the vertices that they have."""
        used, places = np.unique(self.faces, return_inverse=True)
        faces = np.asarray(places.reshape(-1, 3), dtype=np.int32)
        return TriangleMesh(self.vertices_mm[used], faces, self.normals[used])


def join_meshes(*meshes: TriangleMesh) -> TriangleMesh:
    """All of them as one; the triangles of the first come first."""
    firsts = np.cumsum([0, *(len(mesh.vertices_mm) for mesh in meshes)])
    return TriangleMesh(
        np.concatenate([mesh.vertices_mm for mesh in meshes]),
        np.concatenate([mesh.faces + first for mesh, first in zip(meshes, firsts, strict=False)]),
        np.concatenate([mesh.normals for mesh in meshes]),
    )


def vertex_normals(vertices_mm: FloatArray, faces: IntArray) -> FloatArray:
    """(V, 3) unit normals: the mean of the adjacent faces' normals, weighted by their area.

    A vertex of no face, or of degenerate ones only, has the normal 0.
    """
    corners = vertices_mm[faces]
    normals = np.zeros_like(vertices_mm)
    # Coordinates beyond all measure overflow; the mesh refuses normals that are not finite.
    with np.errstate(over="ignore", invalid="ignore"):
        face_normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        for column in range(3):
            index = faces[:, column]
            for axis in range(3):
                normals[:, axis] += np.bincount(index, face_normals[:, axis], len(vertices_mm))
        length = np.linalg.norm(normals, axis=1, keepdims=True)
    unit: FloatArray = normals / np.where(length > 0.0, length, 1.0)
    return unit
