"""Where a picture is seen from: the left camera, or the eye that looks into the mirror."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.box import Box
from navapp.geometry.camera import Camera
from navapp.geometry.rectification import RectifiedGeometry, Rectifier
from navapp.geometry.rig import StereoRig
from navapp.geometry.transform import FloatArray
from navapp.values import Foreground, Origin

FloatMap = NDArray[np.float32]


@dataclass(frozen=True, slots=True, eq=False)
class SeenDepth:
    """What the stereo camera has measured of the scene, in a box of a picture."""

    box: Box
    depth_mm: FloatMap  # (h, w) along the picture's axis, NaN where unknown
    is_guess: NDArray[np.bool_]  # (h, w) unknown, or filled: nothing was matched there
    # (h, w) 0 to 1: how much of a pixel stands in front of the bone; smooth at its edge.
    in_front: FloatMap


class Viewpoint(Protocol):
    """What layers ask of the place that a picture is seen from."""

    @property
    def camera(self) -> Camera:
        """That the picture is drawn for."""
        ...

    @property
    def axes_in_left(self) -> FloatArray:
        """(3, 3) rows: unit directions of columns, rows and depth in the left camera's frame."""
        ...

    def to_camera(self, points_mm: FloatArray) -> FloatArray:
        """(N, 3) points of the left camera's frame in the frame of `camera`."""
        ...

    def see(self, foreground: Foreground, box: Box) -> SeenDepth:
        """The depth around a bone, as seen in a box of the picture."""
        ...


class LeftView:
    """The left camera's own picture, distortion included."""

    def __init__(self, rig: StereoRig) -> None:
        self._camera = rig.left
        self._geometry = Rectifier(rig).geometry
        self._columns, self._rows, self._depth_share = _rectified_places(rig.left, self._geometry)

    @property
    def camera(self) -> Camera:
        """The left one."""
        return self._camera

    @property
    def axes_in_left(self) -> FloatArray:
        """Its own."""
        return np.eye(3)

    def to_camera(self, points_mm: FloatArray) -> FloatArray:
        """As they are."""
        return points_mm

    def see(self, foreground: Foreground, box: Box) -> SeenDepth:
        """What was measured in the rectified picture, at the places of the pixels of a box."""
        import cv2

        around = foreground.box
        columns = self._columns[box.slices] - np.float32(around.x)
        rows = self._rows[box.slices] - np.float32(around.y)
        disparity_px, origin = foreground.depth
        places = (columns, rows)
        seen_px = cv2.remap(
            disparity_px, *places, cv2.INTER_NEAREST, borderMode=cv2.BORDER_CONSTANT,
            borderValue=np.nan,
        )  # fmt: skip
        origins = cv2.remap(
            origin, *places, cv2.INTER_NEAREST, borderMode=cv2.BORDER_CONSTANT, borderValue=0
        )
        marks = foreground.is_in_front.astype(np.float32)
        smooth = cv2.remap(marks, *places, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT)
        in_front = np.asarray(cv2.GaussianBlur(smooth, (0, 0), _EDGE_SIGMA_PX), dtype=np.float32)
        with np.errstate(divide="ignore", invalid="ignore"):
            along_mm = np.float32(self._geometry.focal_px * self._geometry.baseline_mm) / seen_px
        depth_mm = along_mm * self._depth_share[box.slices]
        return SeenDepth(box, depth_mm, origins != Origin.MATCHED, in_front)


# The marks are of every other pixel: their edge is made smooth over so much.
_EDGE_SIGMA_PX = 1.2


def _rectified_places(
    camera: Camera, geometry: RectifiedGeometry
) -> tuple[FloatMap, FloatMap, FloatMap]:
    """Of each pixel (H, W): column and row in the rectified picture, and a share of depth.

    The depth in the camera is the rectified depth times that share.
    """
    rows, columns = np.mgrid[: camera.height, : camera.width]
    rays = camera.rays(np.column_stack([columns.ravel(), rows.ravel()]))
    rectified = geometry.rectified_from_left.rotate(rays)
    shape = camera.height, camera.width
    pixels = geometry.project(rectified)
    share = rays[:, 2] / rectified[:, 2]
    there = (pixels[:, 0], pixels[:, 1], share)
    u, v, depth_share = (part.reshape(shape).astype(np.float32) for part in there)
    return u, v, depth_share
