"""The classes of the depth around a bone, as colours in the operator's picture."""

from functools import lru_cache, partial

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.camera import Camera
from navapp.geometry.rectification import RectifiedGeometry, rectifier_of
from navapp.geometry.rig import StereoRig
from navapp.overlay.viewpoints import rectify_rays
from navapp.values import DEPTH_COLOURS, Foreground, Origin

Image = NDArray[np.uint8]

_WIDTH = 640
# Share of the colour over the picture: what stands in front of the bone is nearly covered.
_SHARE, _SHARE_IN_FRONT = 0.45, 0.85


class DepthMarks:
    """Colours pictures of a rig's left camera by the classes of the depth around the bone.

    Depth is known to some pixels only: what is marked is a picture of at most 640 columns.
    """

    def __init__(self, rig: StereoRig) -> None:
        # No method: it would keep the marks alive.
        find = partial(_find_places, rig.left, rectifier_of(rig).geometry)
        self._places = lru_cache(1)(find)

    def draw(self, picture: Image, foreground: Foreground | None) -> Image:
        """A reduced picture with marks (h, w, 3); the picture (H, W, 3) without a foreground."""
        if foreground is None:
            return picture
        import cv2

        scale = min(1.0, _WIDTH / picture.shape[1])
        size = round(scale * picture.shape[1]), round(scale * picture.shape[0])
        small = np.asarray(cv2.resize(picture, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)
        columns, rows = self._places(small.shape[:2])
        columns, rows = columns - foreground.box.x, rows - foreground.box.y
        _, origin = foreground.depth
        height, width = origin.shape
        is_inside = (columns >= 0) & (columns < width) & (rows >= 0) & (rows < height)
        inside = rows[is_inside], columns[is_inside]
        colours = np.array([DEPTH_COLOURS[origin] for origin in Origin], dtype=np.float32)
        share = np.where(foreground.is_in_front[inside], _SHARE_IN_FRONT, _SHARE)[:, None]
        below = small[is_inside].astype(np.float32)
        colour = colours[origin[inside]]
        small[is_inside] = np.round(below + share * (colour - below)).astype(np.uint8)
        return small


def _find_places(
    camera: Camera, geometry: RectifiedGeometry, shape: tuple[int, int]
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Columns and rows (h, w) in the rectified left view of a reduced picture's pixels."""
    height, width = shape
    rows, columns = np.mgrid[:height, :width]
    x = (columns.ravel() + 0.5) * camera.width / width - 0.5
    y = (rows.ravel() + 0.5) * camera.height / height - 0.5
    pixels = geometry.project(rectify_rays(camera, geometry, x, y))
    there = np.nan_to_num(np.round(pixels), nan=-1.0).astype(np.intp)
    return there[:, 0].reshape(shape), there[:, 1].reshape(shape)
