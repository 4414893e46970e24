"""The bone's skin around a planned hole, and how bright each eye sees it."""

from typing import Self

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.camera import Camera
from navapp.geometry.rectification import Image
from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.values import BoneModel, DrillAxis

# All chosen. So far around the entry the skin is taken, where it faces the drill at least so much;
# fewer vertices than these are no surface.
_PATCH_MM, _LEAST_COSINE, _FEWEST = 16.0, 0.3, 12


class SkinPatch:
    """The bone's surface around a planned entry, as heights over the plane across the hole."""

    def __init__(self, planned: DrillAxis, flat_mm: FloatArray, along_mm: FloatArray) -> None:
        from scipy.interpolate import LinearNDInterpolator

        self._planned = planned
        self._along = LinearNDInterpolator(flat_mm, along_mm)

    @classmethod
    def around(cls, bone: BoneModel, planned: DrillAxis) -> Self | None:
        """None where the plan's entry lies on no surface."""
        offset = bone.mesh.vertices_mm - planned.entry_mm
        flat_mm, along_mm = offset @ planned.axes.T, offset @ planned.direction
        faces_drill = -(bone.mesh.normals @ planned.direction) > _LEAST_COSINE
        is_near = (np.abs(flat_mm).max(axis=1) < _PATCH_MM) & (np.abs(along_mm) < _PATCH_MM)
        here = is_near & faces_drill
        if np.count_nonzero(here) < _FEWEST:
            return None
        return cls(planned, flat_mm[here], along_mm[here])

    def place(self, flat_mm: FloatArray) -> FloatArray:
        """(N, 3) points of the surface, bone coordinates, of places (N, 2) across the hole."""
        along_mm = self._along(flat_mm)
        points: FloatArray = (
            self._planned.entry_mm
            + flat_mm @ self._planned.axes
            + along_mm[:, None] * self._planned.direction
        )
        return points


class Eye:
    """One picture, asked for its brightness at points of the bone."""

    def __init__(self, picture: Image, camera: Camera, camera_from_bone: RigidTransform) -> None:
        self._picture = picture if picture.ndim == 2 else picture[..., 1]
        self._camera, self._pose = camera, camera_from_bone

    def look(self, points_mm: FloatArray) -> NDArray[np.float32]:
        """(N,) brightness; NaN beside the picture."""
        import cv2

        pixels = np.full((len(points_mm), 2), np.nan)
        known = np.isfinite(points_mm).all(axis=1)
        pixels[known] = self._camera.project(self._pose.apply(points_mm[known]))
        columns, rows = (one.astype(np.float32)[None] for one in pixels.T)
        height, width = self._picture.shape
        inside = (columns >= 0) & (columns <= width - 1) & (rows >= 0) & (rows <= height - 1)
        values = cv2.remap(self._picture.astype(np.float32), columns, rows, cv2.INTER_LINEAR)
        seen: NDArray[np.float32] = np.where(inside, values, np.float32(np.nan))[0]
        return seen
