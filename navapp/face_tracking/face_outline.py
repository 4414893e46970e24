"""The border of a face, as the outline of a bone."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from navapp.geometry.box import Box
from navapp.geometry.mesh_sections import section_lines
from navapp.geometry.rectification import RectifiedGeometry
from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.registration.model import RegistrationModel
from navapp.tracking.outline import OutlineMeter, look_up, select_points
from navapp.tracking.outline_kernels import Eye, Rim, thin_rim
from navapp.values import MeasuredFace

# All chosen. The border is taken just below the face, on which the mesh has vertices, at points so
# far from each other.
_BELOW_MM, _SPACING_MM = 0.02, 0.3
# Where fewer px of the flank are seen beyond the border, the edge may be that of the flank.
_STRIP_PX = 5


class FaceOutline(OutlineMeter):
    """Measures the border of a bone's face in both pictures.

    It is an edge whether the bone ends there or tissue hides its flank. Where a narrow strip of
    flank is expected beyond the border, the edge that is found may be that of the flank: such
    points are left out.

    Args:
        model: of the bone, whose surface the face closes.
        geometry: of the rectified pair.
        face: in the bone's coordinates.
    """

    def __init__(
        self, model: RegistrationModel, geometry: RectifiedGeometry, face: MeasuredFace
    ) -> None:
        super().__init__(model, geometry)
        mesh = model.seen_mesh
        height_mm = face.as_plane.heights_mm(mesh.vertices_mm)
        lines = section_lines(mesh, height_mm + _BELOW_MM)
        # A line that something else cuts off has ends.
        loops = [_resample(line) for line in lines if np.allclose(line[0], line[-1])]
        self._loops_mm = [loop for loop in loops if len(loop) > 3]
        # The skin's own vertices know how unsure its cartilage is; those of the face are sawn.
        skin = np.flatnonzero(height_mm < -2.0 * _BELOW_MM)
        tree = cKDTree(mesh.vertices_mm[skin])
        self._vertices: list[NDArray[np.int32]] = [
            skin[tree.query(loop)[1]].astype(np.int32) for loop in self._loops_mm
        ]

    def find_seen_rim(
        self, pose: RigidTransform, eye: Eye, depth_mm: NDArray[np.float32], first: tuple[int, int]
    ) -> Rim:
        """The border as an eye sees it, without points beside which 1 to 4 px of flank are seen."""
        if not self._loops_mm:
            return Rim(np.empty((0, 3)), np.empty((0, 2)), np.empty((0, 2)), np.empty(0),
                       np.empty(0, dtype=np.int32))  # fmt: skip
        rims = [
            _project(pose.apply(loop), vertices, eye)
            for loop, vertices in zip(self._loops_mm, self._vertices, strict=True)
        ]
        rim = Rim(*(np.concatenate(parts) for parts in zip(*rims, strict=True)))
        strip_px = _measure_strip(rim, depth_mm, first)
        is_clear = (strip_px == 0) | (strip_px == _STRIP_PX)  # the count stops there
        thin: Rim = thin_rim(select_points(rim, is_clear))
        return thin


def _measure_strip(
    rim: Rim, depth_mm: NDArray[np.float32], first: tuple[int, int]
) -> NDArray[np.int64]:
    """(N,) over how many px, `_STRIP_PX` at most, the model goes on beyond each point."""
    height, width = depth_mm.shape
    beyond = rim.pixel + np.arange(1, _STRIP_PX + 1)[:, None, None] * rim.normal
    goes_on = np.isfinite(look_up(depth_mm, beyond, Box(*first, width, height), np.nan))
    return np.asarray(np.logical_and.accumulate(goes_on).sum(axis=0))


def _resample(line_mm: FloatArray) -> FloatArray:
    """(N, 3) points of a closed line (M, 3), evenly spaced, each once."""
    along_mm = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(line_mm, axis=0), axis=1)))
    places_mm = np.arange(0.0, along_mm[-1], _SPACING_MM)
    return np.column_stack([np.interp(places_mm, along_mm, axis) for axis in line_mm.T])


def _project(points_mm: FloatArray, vertices: NDArray[np.int32], eye: Eye) -> Rim:
    """A closed loop of points (N, 3) in the left camera's frame, as an eye sees it."""
    per_mm = eye.focal_px / points_mm[:, 2]
    pixel = np.column_stack(
        [
            per_mm * (points_mm[:, 0] - eye.x_mm) + eye.centre_x_px,
            per_mm * points_mm[:, 1] + eye.centre_y_px,
        ]
    )
    along = np.roll(pixel, -1, axis=0) - np.roll(pixel, 1, axis=0)
    length = np.maximum(np.linalg.norm(along, axis=1), 1e-9)
    x, y = pixel.T
    area = float(x @ np.roll(y, -1) - y @ np.roll(x, -1))
    outward = np.column_stack([along[:, 1], -along[:, 0]]) * np.sign(area)
    return Rim(points_mm, pixel, outward / length[:, None], 0.5 * length, vertices)
