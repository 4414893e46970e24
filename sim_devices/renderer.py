"""Renders posed bodies into a picture: z-buffer, then shading; static parts are cached."""

import threading
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.camera import Camera
from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.transform import RigidTransform
from sim_devices.coverage_kernels import number_edges, raster_places
from sim_devices.lamp_view import LampView, Surroundings
from sim_devices.materials import MaterialId
from sim_devices.pixel_rays import centre_rays
from sim_devices.raster_kernels import project_vertices, raster_triangles
from sim_devices.sensor import Rows
from sim_devices.shading_kernels import shade
from sim_devices.textures import COARSE_VOXEL_MM, FINE_VOXEL_MM, NoiseTile

FloatImage = NDArray[np.float32]


@dataclass(frozen=True, slots=True, eq=False)
class Part:
    """A rigid piece of the scene."""

    body: str  # whose pose it follows
    mesh: TriangleMesh  # in that body's frame, closed or seen from its front only
    material: MaterialId  # of its surface
    # (V,) 0 to 1, where the material's marked colour shows; None for nowhere.
    mark: NDArray[np.float64] | None = None
    # (V,) 0 to 1, light that reaches the vertex; None for all.
    exposure: NDArray[np.float64] | None = None
    texture_sign: float = 1.0  # -1 looks the texture up mirrored in x (a left knee)


@dataclass(frozen=True, slots=True, eq=False)
class Surfaces:
    """Materials, texture and lamps of a rendering."""

    materials: NDArray[np.float32]  # table of `materials.make_material_table`
    tile: NoiseTile  # the solid noise
    # (L, 4) direction towards the lamp in the lamps' frame, strength. Operating lamps hang a metre
    # away and are broad: over the site their direction is constant.
    lamps: NDArray[np.float64]
    ambient: float = 0.16  # light from everywhere
    vignetting: float = 0.18  # loss of light in the corner of the picture, 0 to 1


@dataclass(frozen=True, slots=True, eq=False)
class DepthPicture:
    """What each pixel of a picture shows."""

    depth_mm: FloatImage  # (H, W) float32 along the optical axis; 0 where nothing is seen
    body: NDArray[np.int16]  # (H, W) int16 index into `bodies`; -1 where nothing is seen
    bodies: tuple[str, ...]  # names

    def find_middle_row(self, body: str) -> float:
        """Of the box that holds what is seen of a body, against the picture's; 0: unseen."""
        index = self.bodies.index(body) if body in self.bodies else len(self.bodies)
        rows = np.flatnonzero((self.body == index).any(axis=1))
        if len(rows) == 0:
            return 0.0
        return float(0.5 * (rows[0] + rows[-1]) - 0.5 * (len(self.body) - 1))


class _Geometry:
    """The parts of a scene in one set of arrays."""

    def __init__(self, parts: Sequence[Part]) -> None:
        self.parts = tuple(parts)
        self.bodies = tuple(dict.fromkeys(part.body for part in parts))
        offsets = np.cumsum([0, *(len(part.mesh.vertices_mm) for part in parts)])
        self.face_offsets = np.cumsum([0, *(len(part.mesh.faces) for part in parts)])
        self.vertices = [part.mesh.vertices_mm for part in parts]
        self.vertex_slices = [slice(int(a), int(b)) for a, b in pairwise(offsets)]
        self.faces = np.concatenate(
            [part.mesh.faces + np.int32(start) for part, start in zip(parts, offsets, strict=False)]
        ).astype(np.int32)
        self.attributes = np.concatenate([_attributes(part) for part in parts])
        counts = [len(part.mesh.faces) for part in parts]
        self.part_of_face = np.repeat(np.arange(len(parts), dtype=np.uint8), counts)
        self.material_of_face = np.repeat(
            np.array([int(part.material) for part in parts], dtype=np.uint8), counts
        )
        # Two parts of the same stuff must not show the same pattern side by side.
        shift = [17.3 * self.bodies.index(part.body) for part in parts]
        self.texture = np.array(
            [
                [part.texture_sign, s, 2.0 * s, 0.7 * s]
                for part, s in zip(parts, shift, strict=True)
            ],
            dtype=np.float32,
        )


def _attributes(part: Part) -> NDArray[np.float32]:
    columns = np.ones((len(part.mesh.vertices_mm), 5), dtype=np.float32)
    columns[:, :3] = part.mesh.normals
    columns[:, 3] = 0.0 if part.mark is None else part.mark
    if part.exposure is not None:
        columns[:, 4] = part.exposure
    return columns


class Renderer:
    """Pictures of one scene by one camera.

    Args:
        camera: with its distortion.
        parts: of the scene.
        surfaces: lamps, materials, noise.
        static_bodies: bodies whose pose seldom changes; they are kept as drawn until it does.

    `render` and `depth` may be called from several threads; calls wait for each other.
    """

    def __init__(
        self,
        camera: Camera,
        parts: Sequence[Part],
        surfaces: Surfaces,
        static_bodies: frozenset[str] = frozenset(),
    ) -> None:
        self._camera = camera
        self._surfaces = surfaces
        self._geometry = _Geometry(parts)
        self._static = [part.body in static_bodies for part in self._geometry.parts]
        self._numbers = _camera_numbers(camera)
        self._rays = centre_rays(camera)
        shape = (camera.height, camera.width)
        self._screen = np.zeros((len(self._geometry.attributes), 3))
        self._inverse_depth = np.zeros(shape, dtype=np.float32)
        self._triangle = np.full(shape, -1, dtype=np.int32)
        self._edge_number = np.full(shape, -1, dtype=np.int32)  # number of a pixel with an edge
        self._lamp_view = LampView(
            self._geometry.vertices,
            [part.mesh.faces for part in self._geometry.parts],
            self._static,
            surfaces.lamps,
        )
        self._background: tuple[FloatImage, FloatImage, NDArray[np.int32]] | None = None
        self._background_poses = np.zeros(0)
        self._lock = threading.Lock()

    def render(
        self,
        poses: Mapping[str, RigidTransform],
        camera_from_lamps: RigidTransform,
        rows: Rows | None = None,
    ) -> FloatImage:
        """(H, W, 3) float32 BGR radiance; `poses` are camera_from_body of every body.

        With `rows` only these are right: the others lack what moves.
        """
        with self._lock:
            box = self._draw(poses, camera_from_lamps)
            image_kept, _, triangle_kept = self._render_background(poses, camera_from_lamps)
            image = image_kept.copy()
            if box is not None:
                if rows is not None:
                    # A row more on either side: an edge may lie between two rows.
                    box[1], box[3] = max(box[1], rows[0] - 1), min(box[3], rows[1] + 1)
                if box[1] < box[3]:
                    places = self._find_places(box)
                    # Static surfaces are in the picture already; only at edges are they anew.
                    self._triangle[self._triangle == triangle_kept] = -1
                    self._shade(box, poses, camera_from_lamps, places, image, static=False)
            return image

    def depth(
        self, poses: Mapping[str, RigidTransform], camera_from_lamps: RigidTransform
    ) -> DepthPicture:
        """What each pixel shows, from the same z-buffer as `render`."""
        with self._lock:
            self._draw(poses, camera_from_lamps)
            seen = self._triangle >= 0
            geometry = self._geometry
            index = [geometry.bodies.index(part.body) for part in geometry.parts]
            body_of_part = np.array(index, dtype=np.int16)
            body = np.full(seen.shape, -1, dtype=np.int16)
            body[seen] = body_of_part[geometry.part_of_face[self._triangle[seen]]]
            depth_mm = np.zeros(seen.shape, dtype=np.float32)
            depth_mm[seen] = 1.0 / self._inverse_depth[seen]
            return DepthPicture(depth_mm, body, geometry.bodies)

    def _draw(
        self, poses: Mapping[str, RigidTransform], camera_from_lamps: RigidTransform
    ) -> NDArray[np.int64] | None:
        """Fill the z-buffer and its triangles; the box of pixels that moving parts can touch."""
        # All of it, not only the box: no picture may depend on the one before.
        _, self._inverse_depth[:], self._triangle[:] = self._render_background(
            poses, camera_from_lamps
        )
        box = self._project(poses, static=False)
        if box is not None:
            self._raster(box, static=False)
        return box

    def _render_background(
        self, poses: Mapping[str, RigidTransform], camera_from_lamps: RigidTransform
    ) -> tuple[FloatImage, FloatImage, NDArray[np.int32]]:
        """Picture, z-buffer and triangles of what lies still, drawn anew when it has moved."""
        still = [
            poses[part.body].matrix
            for part, is_static in zip(self._geometry.parts, self._static, strict=True)
            if is_static
        ]
        if self._background is None or not np.array_equal(self._background_poses, still):
            whole = np.array([0, 0, self._camera.width, self._camera.height], dtype=np.int64)
            image = np.zeros((self._camera.height, self._camera.width, 3), dtype=np.float32)
            self._inverse_depth.fill(0.0)
            self._triangle.fill(-1)
            self._screen.fill(0.0)  # moving parts are behind the camera: not seen
            self._project(poses, static=True)
            self._raster(whole, static=True)
            places = self._find_places(whole)
            self._shade(whole, poses, camera_from_lamps, places, image, static=True)
            self._background_poses = np.array(still)
            self._background = (image, self._inverse_depth.copy(), self._triangle.copy())
        return self._background

    def _project(
        self, poses: Mapping[str, RigidTransform], *, static: bool
    ) -> NDArray[np.int64] | None:
        """Project the static or the moving parts; the box of pixels that they can touch."""
        size = np.array([self._camera.width, self._camera.height], dtype=np.float64)
        lows, highs = [size], [np.zeros(2)]
        for k, part in enumerate(self._geometry.parts):
            if self._static[k] != static:
                continue
            screen = self._screen[self._geometry.vertex_slices[k]]
            pose = np.ascontiguousarray(poses[part.body].matrix[:3])
            bounds = np.empty(4)
            project_vertices(self._geometry.vertices[k], pose, self._numbers, screen, bounds)
            low, high = np.maximum(bounds[:2], 0.0), np.minimum(bounds[2:] + 1.0, size)
            if (low < high).all():
                lows.append(np.floor(low))
                highs.append(np.ceil(high))
        box = np.concatenate([np.min(lows, axis=0), np.max(highs, axis=0)]).astype(np.int64)
        return None if len(lows) == 1 else box

    def _raster(self, box: NDArray[np.int64], *, static: bool) -> None:
        geometry = self._geometry
        for k in range(len(geometry.parts)):
            if self._static[k] == static:
                first, last = int(geometry.face_offsets[k]), int(geometry.face_offsets[k + 1])
                faces = geometry.faces[first:last]
                raster_triangles(
                    self._screen, faces, first, box, self._inverse_depth, self._triangle
                )

    def _find_places(self, box: NDArray[np.int64]) -> tuple[NDArray[np.int32], FloatImage]:
        """Triangle and 1 / z (K, 9) at the places of the pixels in the box that have an edge."""
        geometry = self._geometry
        n_edges = number_edges(
            self._triangle, self._inverse_depth, geometry.part_of_face,
            geometry.material_of_face, box, self._camera.focal_px, self._edge_number,
        )  # fmt: skip
        triangle = np.full((n_edges, 9), -1, dtype=np.int32)
        inverse_depth = np.zeros((n_edges, 9), dtype=np.float32)
        raster_places(
            self._screen, geometry.faces, 0, box, self._edge_number, inverse_depth, triangle
        )
        return triangle, inverse_depth

    def _turn_lamps(
        self, body_from_camera: list[RigidTransform], camera_from_lamps: RigidTransform
    ) -> FloatImage:
        """(parts, lamps, 4) direction to each lamp in each part's frame, and its strength."""
        directions = camera_from_lamps.rotate(self._surfaces.lamps[:, :3])
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        lamps = np.empty((len(body_from_camera), len(directions), 4), dtype=np.float32)
        for k, pose in enumerate(body_from_camera):
            lamps[k, :, :3] = pose.rotate(directions)
            lamps[k, :, 3] = self._surfaces.lamps[:, 3]
        return lamps

    def _shade(
        self,
        box: NDArray[np.int64],
        poses: Mapping[str, RigidTransform],
        camera_from_lamps: RigidTransform,
        places: tuple[NDArray[np.int32], FloatImage],
        image: FloatImage,
        *,
        static: bool,
    ) -> None:
        geometry, surfaces = self._geometry, self._surfaces
        surroundings = self._find_surroundings(poses, camera_from_lamps, static=static)
        inverse = [poses[part.body].inverse() for part in geometry.parts]
        lamps = self._turn_lamps(inverse, camera_from_lamps)
        corner_px2 = 0.25 * (self._camera.width**2 + self._camera.height**2)
        constants = np.array(
            [
                1.0 / FINE_VOXEL_MM,
                1.0 / COARSE_VOXEL_MM,
                surfaces.vignetting / corner_px2,
                self._camera.focal_px,
            ],
            dtype=np.float32,
        )
        shade(
            (
                self._triangle,
                self._inverse_depth,
                self._rays,
                box,
                self._edge_number,
                *places,
            ),
            (
                self._screen,
                geometry.faces,
                geometry.attributes,
                geometry.part_of_face,
                geometry.material_of_face,
            ),
            (
                np.array([pose.matrix[:3] for pose in inverse], dtype=np.float32),
                lamps,
                geometry.texture,
            ),
            (
                surfaces.materials,
                surfaces.tile.values,
                np.float32(surfaces.ambient),
                constants,
                surroundings.depth_mm,
                surroundings.map_from_camera,
            ),
            image,
        )

    def _find_surroundings(
        self,
        poses: Mapping[str, RigidTransform],
        camera_from_lamps: RigidTransform,
        *,
        static: bool,
    ) -> Surroundings:
        """Mean depths that crevices are measured against; static parts ignore moving ones."""
        of_parts = [poses[part.body] for part in self._geometry.parts]
        return self._lamp_view.draw(of_parts, camera_from_lamps, static=static)


def _camera_numbers(camera: Camera) -> NDArray[np.float64]:
    numbers = np.zeros(16)
    matrix = camera.matrix
    numbers[:4] = matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2]
    numbers[4 : 4 + min(12, camera.distortion.size)] = camera.distortion[:12]
    return numbers
