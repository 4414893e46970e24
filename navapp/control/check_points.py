"""Points over which the surgeon checks the mirror: corners of a board, or places on the bone."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivers.frames import Image
from navapp.geometry.display_model_view import EyeView
from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.rectification import RectifiedGeometry
from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.values import TrackedFrame

N_POINTS, LEAST_APART_MM = 3, 40.0
# Of the measured pixels every so many is a candidate; crosses stay so far from the picture's rim.
_STRIDE_PX, _RIM_PX = 8, 20
# From the plane through the nearest vertex of the model, and from that vertex.
_ON_BONE_MM, _NEAR_VERTEX_MM = 2.0, 8.0

# Of the left and the right picture: ids (n,) of the corners of a board that both show, and where
# they are, (n, 3) mm in the left camera's frame; None without a board.
LocateCorners = Callable[[Image, Image], tuple[NDArray[np.intp], FloatArray] | None]


@dataclass(frozen=True, slots=True, eq=False)
class CheckPoint:
    """Where a cross belongs."""

    point_mm: FloatArray  # (3,) of the bone; of a board's corner, in the left camera's frame
    corner_id: int | None = None  # of a board's corner

    def in_left(self, left_from_bone: RigidTransform) -> FloatArray:
        """(3,) in the left camera's frame."""
        if self.corner_id is not None:
            return self.point_mm
        place: FloatArray = left_from_bone.apply(self.point_mm[None])[0]
        return place


def choose_corners(
    view: EyeView, located: tuple[NDArray[np.intp], FloatArray] | None
) -> list[CheckPoint]:
    """Three corners of a board that lie far apart; none when it does not show three."""
    if located is None:
        return []
    ids, points = located
    chosen = _furthest_apart(points, _can_show(view, points))
    return [CheckPoint(points[k], int(ids[k])) for k in chosen]


def choose_on_bone(
    view: EyeView, geometry: RectifiedGeometry, tracked: TrackedFrame, mesh: TriangleMesh
) -> list[CheckPoint]:
    """Three places on a bone that were measured in a frame; none when there are no three."""
    from scipy.spatial import cKDTree

    pose, foreground = tracked.left_from_bone, tracked.foreground
    if foreground is None or pose is None:
        return []
    cloud = foreground.measured.reproject(geometry, _STRIDE_PX)
    points = geometry.rectified_from_left.inverse().apply(cloud.points_mm)
    # A hand, or what was matched wrongly, is not on the bone.
    in_bone = pose.inverse().apply(points)
    far_mm, nearest = cKDTree(mesh.vertices_mm).query(in_bone)
    normals = mesh.normals[nearest]
    off_mm = np.abs(np.sum((in_bone - mesh.vertices_mm[nearest]) * normals, axis=1))
    is_good = (off_mm < _ON_BONE_MM) & (far_mm < _NEAR_VERTEX_MM) & _can_show(view, points)
    return [CheckPoint(in_bone[k]) for k in _furthest_apart(points, is_good)]


def draw_places_px(view: EyeView, points_mm: FloatArray) -> FloatArray:
    """(N, 2) where points (N, 3) of the left camera's frame are drawn, as the eye reads them."""
    pixels: FloatArray = view.camera.project(view.warp(points_mm))
    return pixels


def _can_show(view: EyeView, points_mm: FloatArray) -> NDArray[np.bool_]:
    """Whether a cross on each of the points (N, 3) lies well inside the display."""
    last = np.array([view.camera.width, view.camera.height]) - _RIM_PX
    pixels = draw_places_px(view, points_mm)
    # Unknown places compare as outside.
    return np.asarray(((pixels > _RIM_PX) & (pixels < last)).all(axis=1))


def _furthest_apart(points: FloatArray, is_good: NDArray[np.bool_]) -> list[int]:
    """Numbers of three of the good points (N, 3) that lie far apart; none if they do not."""
    numbers = np.flatnonzero(is_good)
    if len(numbers) < N_POINTS:
        return []
    good = points[numbers]
    first = int(np.argmax(np.linalg.norm(good - good.mean(axis=0), axis=1)))
    second = int(np.argmax(np.linalg.norm(good - good[first], axis=1)))
    to_both = np.minimum(*(np.linalg.norm(good - good[k], axis=1) for k in (first, second)))
    chosen = [first, second, int(np.argmax(to_both))]
    corners = good[chosen]
    sides_mm = np.linalg.norm(corners - np.roll(corners, 1, axis=0), axis=1)
    return [int(numbers[k]) for k in chosen] if sides_mm.min() >= LEAST_APART_MM else []
