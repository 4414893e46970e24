"""Where a picture is seen from: the left camera, or the eye that looks into the mirror."""

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.bands import run_both
from navapp.geometry.box import Box
from navapp.geometry.camera import Camera
from navapp.geometry.display_model_view import EyeView
from navapp.geometry.halves import half_box, inside_of_halves
from navapp.geometry.rectification import RectifiedGeometry, rectifier_of
from navapp.geometry.rig import StereoRig
from navapp.geometry.transform import FloatArray
from navapp.overlay.see_kernels import Measured, look_up_depth
from navapp.overlay.splat_kernels import IN_FRONT, KNOWN, splat_points
from navapp.values import Foreground

FloatMap = NDArray[np.float32]

# Between matches a gap as narrow as this is no guess.
_NARROW_PX = 5
# The marks are of every other pixel: their edge is made smooth over so much.
_EDGE_SIGMA_PX = 1.2
# Of the measured points in the rectified picture every so many is moved to the eye, each way.
_POINT_STEP = 2
# Half as many points are enough work for each of two threads.
_WORTH_TWO = 1000


@dataclass(frozen=True, slots=True, eq=False)
class SeenDepth:
    """What the stereo camera has measured of the scene, in a box of a picture.

    Depth and guesses are known of every second pixel each way, over `half_box(box)`.
    """

    box: Box
    depth_mm: FloatMap  # (h', w') along the picture's axis, NaN where unknown
    is_guess: NDArray[np.uint8]  # (h', w') 1: unknown, or filled: nothing was matched there
    # (h, w) 0 to 255: how much of a pixel stands in front of the bone; smooth at its edge.
    in_front: NDArray[np.uint8]


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

    @property
    def is_video(self) -> bool:
        """Guides lie over the camera's picture; otherwise they are all that is lit."""
        ...

    def to_camera(self, points_mm: FloatArray) -> FloatArray:
        """(N, 3) points of the left camera's frame in the frame of `camera`."""
        ...

    def see(self, foreground: Foreground, box: Box) -> SeenDepth:
        """The depth around a bone, as seen in a box of the picture."""
        ...


class LeftView:
    """The left camera's own picture, distortion included."""

    is_video = True

    def __init__(self, rig: StereoRig) -> None:
        self._camera = rig.left
        self._geometry = rectifier_of(rig).geometry
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
        """What was measured in the rectified picture, at every second pixel of a box each way."""
        half = half_box(box)
        shape = half.height, half.width
        depth_mm = np.empty(shape, dtype=np.float32)
        is_guess, in_front = np.empty((2, *shape), dtype=np.uint8)
        look_up_depth(
            self._columns, self._rows, self._depth_share, (half.x, half.y),
            self._geometry.focal_px * self._geometry.baseline_mm, *_maps_of(foreground),
            foreground.is_in_front, (foreground.box.x, foreground.box.y), depth_mm, is_guess,
            in_front,
        )  # fmt: skip
        return _smooth(box, depth_mm, is_guess, in_front)


def _maps_of(foreground: Foreground) -> tuple[Measured, Measured]:
    """What lies around a bone, and what holds instead of it where it is matched."""
    around, finer = foreground.surroundings, foreground.measured
    box = half_box(around.box) if around.is_half else around.box
    return (
        Measured(around.disparity_px, around.origin, box.x, box.y, int(around.is_half)),
        Measured(finer.disparity_px, finer.origin, finer.x, finer.y, 0),
    )


def _smooth(
    box: Box, depth_mm: FloatMap, is_guess: NDArray[np.uint8], in_front: NDArray[np.uint8]
) -> SeenDepth:
    """Guesses without specks and narrow parts; marks of 0 and 255 doubled, with a smooth edge."""
    import cv2

    square = np.ones((_NARROW_PX // 2 + 1, _NARROW_PX // 2 + 1), np.uint8)
    is_gap = np.asarray(cv2.morphologyEx(is_guess, cv2.MORPH_OPEN, square), dtype=np.uint8)
    blurred = cv2.GaussianBlur(in_front, (0, 0), 0.5 * _EDGE_SIGMA_PX)
    height, width = in_front.shape
    soft = cv2.resize(blurred, (2 * width, 2 * height), interpolation=cv2.INTER_LINEAR)
    smooth = np.ascontiguousarray(soft[inside_of_halves(box)], dtype=np.uint8)
    return SeenDepth(box, depth_mm, is_gap, smooth)


def _rectified_places(
    camera: Camera, geometry: RectifiedGeometry
) -> tuple[NDArray[np.int16], NDArray[np.int16], FloatMap]:
    """Of every second pixel (H, W): column and row in the rectified picture, and a share of depth.

    Nearest ones, negative where there is none. The depth in the camera is the rectified depth times
    that share.
    """
    half = half_box(Box(0, 0, camera.width, camera.height))
    rows, columns = np.mgrid[half.slices]
    rectified = rectify_rays(camera.scale(0.5), geometry, columns.ravel(), rows.ravel())
    places = np.nan_to_num(
        np.round(geometry.project(rectified)), nan=-1.0, posinf=-1.0, neginf=-1.0
    )
    shape = half.height, half.width
    # The rays in the camera have the depth 1.
    depth_share = (1.0 / rectified[:, 2]).reshape(shape).astype(np.float32)
    u, v = np.clip(places, -1.0, 32767.0).astype(np.int16).T.reshape(2, *shape)
    return u, v, depth_share


def rectify_rays(
    camera: Camera, geometry: RectifiedGeometry, columns: NDArray[Any], rows: NDArray[Any]
) -> FloatArray:
    """(N, 3) rays through pixels of the left picture, turned into the rectified camera."""
    rays = camera.rays(np.column_stack([columns, rows]))
    return geometry.rectified_from_left.rotate(rays)


class MirrorView:
    """The screen in the half-silvered mirror, as the calibrated eye sees it.

    What was measured by the cameras is moved to the eye; what the eye sees and they do not is
    unknown.
    """

    is_video = False

    def __init__(self, eye_view: EyeView, rig: StereoRig) -> None:
        self.eye_view = eye_view
        self._geometry = rectifier_of(rig).geometry

    @property
    def camera(self) -> Camera:
        """At the eye, its picture in the plane of the screen."""
        return self.eye_view.camera

    @property
    def axes_in_left(self) -> FloatArray:
        """The screen's columns and rows, as the eye reads them, and the way it looks."""
        return self.eye_view.eye_from_left.rotation

    def to_camera(self, points_mm: FloatArray) -> FloatArray:
        """So that they are seen where they are: with glass and bulge."""
        middle = len(points_mm) // 2
        if middle < _WORTH_TWO:
            return self.eye_view.warp(points_mm)
        halves = points_mm[:middle], points_mm[middle:]
        warp = self.eye_view.warp
        return np.concatenate(run_both(lambda: warp(halves[0]), lambda: warp(halves[1])))

    def see(self, foreground: Foreground, box: Box) -> SeenDepth:
        """Every second measured point each way, drawn as large as the gap to the next one."""
        around, half = foreground.box, half_box(box)
        depth_mm = np.full((half.height, half.width), np.nan, dtype=np.float32)
        mark = np.zeros(depth_mm.shape, dtype=np.uint8)
        splat_points(
            *_maps_of(foreground),
            foreground.is_in_front,
            (around.x, around.y, _POINT_STEP),
            self._lens_of_pair(),
            self._eye_from_rectified(foreground),
            self._lens_of_eye(half),
            depth_mm,
            mark,
        )
        is_guess = (mark & KNOWN == 0).view(np.uint8)
        in_front = np.where(mark & IN_FRONT > 0, np.uint8(255), np.uint8(0))
        return _smooth(box, depth_mm, is_guess, in_front)

    def _lens_of_pair(self) -> tuple[float, float, float, float]:
        one = self._geometry
        return one.focal_px, one.centre_x_px, one.centre_y_px, one.baseline_mm

    def _lens_of_eye(self, half: Box) -> tuple[float, float, float, float]:
        """Of the picture at half its resolution, counted from a box in it."""
        matrix = self.camera.scale(0.5).matrix
        return matrix[0, 0], matrix[1, 1], matrix[0, 2] - half.x, matrix[1, 2] - half.y

    def _eye_from_rectified(self, foreground: Foreground) -> FloatArray:
        """(3, 4); what glass and bulge do in the middle of the bone they do everywhere near."""
        left_from_rectified = self._geometry.rectified_from_left.inverse()
        matrix = np.array((self.eye_view.eye_from_left @ left_from_rectified).matrix[:3])
        middle = self._middle_mm(foreground)
        if middle is not None:
            exact = self.to_camera(left_from_rectified.apply(middle[None]))[0]
            shift = exact - (matrix[:, :3] @ middle + matrix[:, 3])
            if np.isfinite(shift).all():
                matrix[:, 3] += shift
        return matrix

    def _middle_mm(self, foreground: Foreground) -> FloatArray | None:
        """(3,) of what was matched, in the rectified camera; None when nothing was."""
        cloud = foreground.measured.reproject(self._geometry, stride_px=16)
        return None if len(cloud) == 0 else np.asarray(np.median(cloud.points_mm, axis=0))
