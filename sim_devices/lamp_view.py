"""How deep points lie among their surroundings, as the lamps see them: crevices are darker.

Light does not know who looks: every camera finds the same darkness in the same place.

Source: Luft, Colditz, Deussen, Image enhancement by unsharp masking the depth buffer (SIGGRAPH
2006); there the depth is the camera's.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.transform import FloatArray, RigidTransform
from sim_devices.raster_kernels import raster_triangles

_CELL_MM = 2.0
_MOST_CELLS = 1000
# Surroundings are as wide as this standard deviation.
_REACH_MM = 9.0
# Beyond all that is seen: the z-buffer keeps the larger value.
_FAR_MM = 10_000.0
# Mean depth where the lamps see nothing: no point is dark.
_NOTHING = np.full((1, 1), _FAR_MM, dtype=np.float32)


@dataclass(frozen=True, slots=True, eq=False)
class Surroundings:
    """Mean depth around each place, along the lamps' light."""

    depth_mm: NDArray[np.float32]  # (h, w) float32, cells
    # (3, 4) float32 column and row (cells) and depth (mm) of a point in the camera's frame, mm.
    map_from_camera: NDArray[np.float32]


class LampView:
    """The scene as seen from far away in the mean direction of the lamps.

    Args:
        vertices_mm: (V, 3) of each part, in its body's frame.
        faces: (F, 3) int32 of each part, indices into its own vertices.
        is_static: of each part, whether it seldom moves.
        lamps: (L, 4) direction towards each lamp, strength.
    """

    def __init__(
        self,
        vertices_mm: Sequence[FloatArray],
        faces: Sequence[NDArray[np.int32]],
        is_static: Sequence[bool],
        lamps: FloatArray,
    ) -> None:
        self._vertices_mm, self._faces, self._is_static = vertices_mm, faces, is_static
        unit = lamps[:, :3] / np.linalg.norm(lamps[:, :3], axis=1, keepdims=True)
        # Of lamps that are all off, the mean counts each alike.
        self._view_from_lamps = _look_along(-(unit * (lamps[:, 3:] + 1e-9)).sum(axis=0))
        self._kept: NDArray[np.float32] | None = None
        self._corner_cells = np.zeros(2)

    def draw(
        self, poses: Sequence[RigidTransform], camera_from_lamps: RigidTransform, *, static: bool
    ) -> Surroundings:
        """Surroundings of the static parts alone, or of all parts.

        Args:
            poses: camera_from_body of each part.
            camera_from_lamps: of the lamps' frame.
            static: whether the moving parts are left out. This map is kept; without `static` the
                moving parts are drawn on top of the kept one.
        """
        lamps_from_camera = camera_from_lamps.inverse()
        view_from_camera = np.zeros((3, 4))
        view_from_camera[:, :3] = self._view_from_lamps @ lamps_from_camera.rotation
        view_from_camera[:, 3] = self._view_from_lamps @ lamps_from_camera.translation_mm
        # Columns and rows in cells, depth in mm.
        view_from_camera[:2] /= _CELL_MM
        chosen = [k for k, is_static in enumerate(self._is_static) if is_static == static]
        seen = [
            self._vertices_mm[k] @ (view_from_camera[:, :3] @ poses[k].rotation).T
            + (view_from_camera[:, :3] @ poses[k].translation_mm + view_from_camera[:, 3])
            for k in chosen
        ]
        if static:
            self._kept = nearness = self._lay_out(seen)
        else:
            nearness = self._lay_out(seen) if self._kept is None else self._kept.copy()
        if nearness is None:
            return Surroundings(_NOTHING, np.zeros((3, 4), np.float32))
        self._raster(seen, [self._faces[k] for k in chosen], nearness)
        view_from_camera[:2, 3] -= self._corner_cells
        return Surroundings(_take_mean(nearness), view_from_camera.astype(np.float32))

    def _lay_out(self, seen: Sequence[FloatArray]) -> NDArray[np.float32] | None:
        """A map of zeros that spans these points, and its corner; None without points."""
        if not seen:
            return None
        low = np.floor(np.min([one[:, :2].min(axis=0) for one in seen], axis=0))
        high = np.ceil(np.max([one[:, :2].max(axis=0) for one in seen], axis=0))
        width, height = np.minimum(high - low + 1, _MOST_CELLS).astype(int)
        self._corner_cells = low
        return np.zeros((height, width), dtype=np.float32)

    def _raster(
        self,
        seen: Sequence[FloatArray],
        faces: Sequence[NDArray[np.int32]],
        nearness: NDArray[np.float32],
    ) -> None:
        """Draw parts (V, 3) of the view into a map; parallel light needs no division."""
        height, width = nearness.shape
        box = np.array([0, 0, width, height], dtype=np.int64)
        triangle = np.empty(nearness.shape, dtype=np.int32)  # required, unused
        for points, of_part in zip(seen, faces, strict=True):
            screen = points - np.append(self._corner_cells, 0.0)
            screen[:, 2] = _FAR_MM - screen[:, 2]
            raster_triangles(screen, of_part, 0, box, nearness, triangle)


def _look_along(direction: FloatArray) -> FloatArray:
    """(3, 3) rotation of which the third row is that direction."""
    forward = direction / np.linalg.norm(direction)
    across = np.cross(forward, np.eye(3)[np.abs(forward).argmin()])
    across /= np.linalg.norm(across)
    return np.stack([across, np.cross(forward, across), forward])


def _take_mean(nearness: NDArray[np.float32]) -> NDArray[np.float32]:
    """Mean depth (mm) around each cell; beside all that is seen lies the deepest of it."""
    import cv2

    is_seen = nearness > 0.0
    if not is_seen.any():
        return _NOTHING
    depth_mm = np.where(is_seen, _FAR_MM - nearness, _FAR_MM - nearness[is_seen].min())
    sigma_cells = _REACH_MM / _CELL_MM
    return np.asarray(cv2.GaussianBlur(depth_mm.astype(np.float32), (0, 0), sigma_cells))
