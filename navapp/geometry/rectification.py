"""Rectification: rows of both pictures become the same epipolar line."""

import math
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from navapp.errors import RigError
from navapp.geometry.bands import run_both
from navapp.geometry.bilinear import Interpolation, bilinear, lens_maps
from navapp.geometry.box import Box
from navapp.geometry.resampling import TAPS_PX, find_places, resample, shift_places
from navapp.geometry.rig import StereoRig
from navapp.geometry.transform import FloatArray, RigidTransform

if TYPE_CHECKING:
    # Kernels are loaded at first use: the command line starts without a compiler.
    from navapp.geometry.resample_kernels import Places

Image = NDArray[np.uint8]


@dataclass(frozen=True, slots=True, eq=False)
class RectifiedGeometry:
    """Geometry of a rectified pair: one focal length, one centre, the right camera at +x.

    A point (x, y, z) mm in the rectified left camera is seen at u = f x / z + cx in the left and at
    u - f B / z in the right picture, both at v = f y / z + cy.
    """

    focal_px: float
    centre_x_px: float
    centre_y_px: float
    baseline_mm: float
    width: int
    height: int
    rectified_from_left: RigidTransform

    @property
    def camera_matrix(self) -> FloatArray:
        """(3, 3) of both rectified cameras."""
        return np.array(
            [
                [self.focal_px, 0.0, self.centre_x_px],
                [0.0, self.focal_px, self.centre_y_px],
                [0.0, 0.0, 1.0],
            ]
        )

    def disparity_px(self, depth_mm: float) -> float:
        """Disparity of a point at that depth."""
        return self.focal_px * self.baseline_mm / depth_mm

    def disparity_map_px(self, depth_mm: NDArray[np.floating]) -> NDArray[np.float32]:
        """Disparity (h, w) of a depth map (h, w); NaN stays NaN."""
        return (self.focal_px * self.baseline_mm / depth_mm).astype(np.float32)

    def depth_mm(self, disparity_px: float) -> float:
        """Depth of a point with that disparity."""
        return self.focal_px * self.baseline_mm / disparity_px

    def reduced(self, reduction: int) -> "RectifiedGeometry":
        """Of the same pictures at 1/reduction of their resolution: pixels are means of blocks."""
        return replace(
            self,
            focal_px=self.focal_px / reduction,
            centre_x_px=(self.centre_x_px + 0.5) / reduction - 0.5,
            centre_y_px=(self.centre_y_px + 0.5) / reduction - 0.5,
            width=self.width // reduction,
            height=self.height // reduction,
        )

    def project(self, points_mm: FloatArray) -> FloatArray:
        """(N, 2) px in the left picture of points (N, 3) mm; NaN at or behind the camera."""
        z = np.where(points_mm[:, 2] > 1e-6, points_mm[:, 2], np.nan)
        return np.column_stack(
            [
                self.focal_px * points_mm[:, 0] / z + self.centre_x_px,
                self.focal_px * points_mm[:, 1] / z + self.centre_y_px,
            ]
        )


@dataclass(frozen=True, slots=True, eq=False)
class RectifiedPair:
    """Rectified pictures and their geometry; `box` is the region of interest in the left one."""

    left: Image
    right: Image
    geometry: RectifiedGeometry
    box: Box


@dataclass(frozen=True, eq=False)
class Rectifier:
    """Rectifies the pictures of one rig; the maps are made once.

    Source: Bouguet's method as in OpenCV's `stereoRectify`, zero disparity at infinity.

    Raises:
        RigError: the right camera does not stand to the right of the left one.
    """

    rig: StereoRig  # whose pictures are rectified
    interpolation: Interpolation = "cubic"  # between pixels
    # R1, R2 (3, 3) and P1, P2 (3, 4) that another program has rectified with, instead of ours.
    given: tuple[FloatArray, FloatArray, FloatArray, FloatArray] | None = None
    _solved: tuple[Any, ...] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        rig = self.rig
        r1, r2, p1, p2 = _solve(rig) if self.given is None else self.given
        if p2[0, 3] >= 0.0 or abs(p2[1, 3]) > 1e-9:
            raise RigError(
                f"rig {rig.name}: the right camera must stand to the right of the left one",
                subject=rig.name,
                remedy="swap the cameras, or calibrate them again",
            )
        object.__setattr__(self, "_solved", (r1, r2, p1, p2))

    @cached_property
    def geometry(self) -> RectifiedGeometry:
        """Focal length, centre and baseline, from the projection matrices only."""
        r1, _, p1, p2 = self._solved
        return RectifiedGeometry(
            focal_px=float(p1[0, 0]),
            centre_x_px=float(p1[0, 2]),
            centre_y_px=float(p1[1, 2]),
            baseline_mm=float(-p2[0, 3] / p2[0, 0]),
            width=self.rig.width,
            height=self.rig.height,
            rectified_from_left=RigidTransform.from_parts("left_rect", "left", r1, np.zeros(3)),
        )

    @property
    def matrices(self) -> tuple[Any, Any, Any, Any]:
        """R1, R2 (3, 3) and P1, P2 (3, 4), as OpenCV names them."""
        r1, r2, p1, p2 = self._solved
        return r1, r2, p1, p2

    @cached_property
    def maps(self) -> tuple[Any, Any, Any, Any]:
        """Float maps: left x, left y, right x, right y.

        Fixed-point maps differ by up to 2 grey levels.
        """
        r1, r2, p1, p2 = self._solved
        return (*lens_maps(self.rig.left, r1, p1), *lens_maps(self.rig.right, r2, p2))

    def rectify(
        self,
        left: Image,
        right: Image,
        box: Box | None = None,
        band_px: tuple[float, float] | None = None,
        *,
        is_grey: bool = False,
        row_shifts_px: tuple[FloatArray, FloatArray] | None = None,
    ) -> RectifiedPair:
        """Rectify both pictures; `box` (in the rectified left view) is passed on clipped.

        Args:
            left: picture of the left camera.
            right: of the right one.
            box: region of interest; None is the whole picture.
            band_px: smallest and largest disparity. With it only the box, and what it reaches in
                the right picture, is rectified; the rest stays 0.
            is_grey: of coloured pictures only the luma.
            row_shifts_px: (h, 2) each, of the left and of the right picture: x and y in it by which
                each rectified row is looked up elsewhere. Not for bilinear interpolation.

        Raises:
            ValueError: pictures of another size than the rig's, a grey one beside a coloured one,
                row shifts with bilinear interpolation.
        """
        self.check(left, right)
        if row_shifts_px is not None and self.interpolation == "bilinear":
            raise ValueError("bilinear interpolation knows no shifts of rows")
        whole = Box(0, 0, self.rig.width, self.rig.height)
        inside = whole if box is None else box.clip(whole.width, whole.height)
        in_left, in_right = whole, whole
        if band_px is not None:
            in_left, in_right = find_reached(inside, band_px)
        if self.interpolation == "bilinear":
            greys = (luma(left), luma(right)) if is_grey else (left, right)
            return self._bilinear(greys, (in_left, in_right), inside)
        for_left, for_right = self._places
        left_shift_px, right_shift_px = row_shifts_px or (None, None)

        def rectify_one(
            picture: Image, places: "Places", part: Box, shift_px: FloatArray | None
        ) -> Image:
            if shift_px is not None:
                places = shift_places(places, shift_px, part)
            grey = _luma_for(picture, places, part) if is_grey else picture
            return resample(grey, places, part)

        pictures = run_both(
            lambda: rectify_one(left, for_left, in_left, left_shift_px),
            lambda: rectify_one(right, for_right, in_right, right_shift_px),
        )
        return RectifiedPair(*pictures, self.geometry, inside)

    def check(self, left: Image, right: Image) -> None:
        """Refuse what `rectify` would refuse.

        Raises:
            ValueError: pictures of another size than the rig's, a grey one beside a coloured one.
        """
        for picture in (left, right):
            if picture.shape[:2] != (self.rig.height, self.rig.width):
                raise ValueError(
                    f"pictures are {picture.shape[1]}x{picture.shape[0]}, "
                    f"the rig {self.rig.width}x{self.rig.height}"
                )
        if left.shape != right.shape:
            raise ValueError("one picture of the pair is grey and the other coloured")

    def _bilinear(
        self, pictures: tuple[Image, Image], parts: tuple[Box, Box], inside: Box
    ) -> RectifiedPair:
        """As other programs interpolate."""
        left_x, left_y, right_x, right_y = self.maps
        slices = [part.clip(self.rig.width, self.rig.height).slices for part in parts]
        left = bilinear(pictures[0], left_x, left_y, slices[0])
        right = bilinear(pictures[1], right_x, right_y, slices[1])
        return RectifiedPair(left, right, self.geometry, inside)

    @cached_property
    def _places(self) -> "tuple[Places, Places]":
        """Where the rectified pixels lie in the left and in the right picture."""
        left_x, left_y, right_x, right_y = self.maps
        return find_places(left_x, left_y), find_places(right_x, right_y)


@lru_cache(maxsize=2)
def rectifier_of(rig: StereoRig) -> Rectifier:
    """The rectifier of a rig, for all who rectify its pictures: its maps are made once.

    Raises:
        RigError: the right camera does not stand to the right of the left one.
    """
    return Rectifier(rig)


def _solve(rig: StereoRig) -> tuple[Any, Any, Any, Any]:
    """R1, R2, P1, P2."""
    import cv2

    r1, r2, p1, p2, *_ = cv2.stereoRectify(
        np.array(rig.left.matrix),
        np.array(rig.left.distortion),
        np.array(rig.right.matrix),
        np.array(rig.right.distortion),
        (rig.width, rig.height),
        np.array(rig.right_from_left.rotation),
        np.array(rig.right_from_left.translation_mm).reshape(3, 1),
        flags=cv2.CALIB_ZERO_DISPARITY,
        alpha=-1,
    )
    return r1, r2, p1, p2


def luma(picture: Image) -> Image:
    """Grey picture: colour adds cost and, with JPEG, halved chroma, but no disparity."""
    import cv2

    if picture.ndim == 2:
        return picture
    return np.asarray(cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY), dtype=np.uint8)


def find_reached(box: Box, band_px: tuple[float, float]) -> tuple[Box, Box]:
    """The box, and what its disparities and interpolation reach in the right picture."""
    first = box.x - math.ceil(band_px[1]) - TAPS_PX
    last = box.x + box.width - math.floor(band_px[0]) + TAPS_PX
    return box, replace(box, x=first, width=last - first)


def _luma_for(picture: Image, places: "Places", part: Box) -> Image:
    """The grey picture where a part of its rectified one asks for it; anything elsewhere."""
    import cv2

    if picture.ndim == 2:
        return picture
    grey = np.empty(picture.shape[:2], dtype=np.uint8)
    asked = _source_box(places, part)
    if not asked.is_empty:
        rows, columns = (
            slice(asked.y, asked.y + asked.height),
            slice(asked.x, asked.x + asked.width),
        )
        cv2.cvtColor(picture[rows, columns], cv2.COLOR_BGR2GRAY, dst=grey[rows, columns])
    return grey


def _source_box(places: "Places", part: Box) -> Box:
    """What of the other picture a part of the rectified one is made of."""
    height, width = places.columns.shape
    inside = part.clip(width, height)
    if inside.is_empty:
        return inside
    low, high = inside.y, inside.y + inside.height - 1
    # Columns grow along a row, but for a lens that folds the picture's ends.
    ends = [places.columns[low : high + 1, x] for x in (inside.x, inside.x + inside.width - 1)]
    begin, end = min(column.min() for column in ends), max(column.max() for column in ends)
    first, last = np.clip([begin - TAPS_PX, end + TAPS_PX], 0, width - 1).astype(int)
    curves = places.rows[[low, high], first : last + 1]
    top, bottom = np.clip([curves.min() - TAPS_PX, curves.max() + TAPS_PX], 0, height - 1).astype(
        int
    )
    return Box(int(first), int(top), int(last - first + 1), int(bottom - top + 1))
