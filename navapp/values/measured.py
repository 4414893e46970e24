"""What stereo measures: disparity and the surface that it means."""

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.box import Box
from navapp.geometry.halves import double
from navapp.geometry.rectification import RectifiedGeometry
from navapp.geometry.transform import FloatArray


class Origin(IntEnum):
    """Where a disparity comes from."""

    UNKNOWN = 0
    MATCHED = 1
    FILLED_BORDER = 2
    FILLED_INTERIOR = 3
    MISMATCH_FILLED = 4


def _find_matched(origin: NDArray[np.uint8]) -> NDArray[np.bool_]:
    # With a member itself numpy compares whole integers, which takes many times as long.
    return np.asarray(origin == int(Origin.MATCHED))


@dataclass(frozen=True, slots=True, eq=False)
class DisparityMap:
    """Disparity of the rectified left view inside a box."""

    disparity_px: NDArray[np.float32]  # (h, w) float32, NaN where unknown
    sigma_px: NDArray[np.float32]  # (h, w) float32 standard deviation, NaN where unknown
    origin: NDArray[np.uint8]  # (h, w) uint8 of `Origin`
    # x, y: place of the box's first pixel in the rectified picture.
    x: int
    y: int

    @property
    def box(self) -> Box:
        """Where it lies in the rectified picture."""
        height, width = self.disparity_px.shape
        return Box(self.x, self.y, width, height)

    @property
    def is_matched(self) -> NDArray[np.bool_]:
        """(h, w) pixels with a measured disparity."""
        return _find_matched(self.origin)

    @property
    def n_matched(self) -> int:
        """How many pixels have a measured disparity."""
        return int(np.count_nonzero(self.is_matched))

    @property
    def matched_fraction(self) -> float:
        """Fraction of pixels with a measured disparity."""
        return self.n_matched / self.origin.size if self.origin.size else 0.0

    def reproject(
        self,
        geometry: RectifiedGeometry,
        stride_px: int = 1,
        origins: tuple[Origin, ...] = (Origin.MATCHED,),
    ) -> "SurfaceCloud":
        """Points of the rectified left camera, every `stride_px`-th pixel each way.

        Args:
            geometry: of the rectified pair.
            stride_px: 1 takes all pixels.
            origins: which pixels; by default the measured ones only.

        Source: z = f B / d; sigma_z = z^2 / (f B) * sigma_d.
        """
        # What is compiled is not loaded by those who only read values.
        from navapp.geometry.reprojection_kernels import count_wanted, reproject_pixels

        is_wanted = np.zeros(256, dtype=np.bool_)
        is_wanted[[int(origin) for origin in origins]] = True
        fixed = (self.origin, is_wanted, stride_px)
        n = count_wanted(self.disparity_px, *fixed)
        points_mm, sigma_ray_mm = np.empty((n, 3)), np.empty(n)
        pixels, origin = np.empty((n, 2), dtype=np.int32), np.empty(n, dtype=np.uint8)
        camera = (
            geometry.focal_px, geometry.centre_x_px, geometry.centre_y_px, geometry.baseline_mm
        )  # fmt: skip
        reproject_pixels(
            self.disparity_px, self.sigma_px, *fixed, (self.x, self.y), camera, points_mm,
            sigma_ray_mm, pixels, origin,
        )  # fmt: skip
        return SurfaceCloud(points_mm, sigma_ray_mm, pixels, origin, stride_px)

    def only(self, stays: NDArray[np.bool_]) -> "DisparityMap":
        """The map, unknown beside a mask (h, w)."""
        # What is compiled is not loaded by those who only read values.
        from navapp.geometry.masks import where_all

        disparity_px, sigma_px, origin = where_all(
            stays, ((self.disparity_px, np.nan), (self.sigma_px, np.nan), (self.origin, 0))
        )
        return DisparityMap(disparity_px, sigma_px, origin, self.x, self.y)


@dataclass(frozen=True, slots=True)
class RowCheck:
    """What the rows of a usable pair say of its rig."""

    offset_px: float  # how much lower the right picture shows what the left one shows
    is_off: bool  # surely, and by more than may be wrong


@dataclass(frozen=True, slots=True, eq=False)
class Surroundings:
    """What lies around a bone, to about a pixel, gaps filled: to tell what is where."""

    # over the box; where `is_half`, over `half_box(box)` and half as large; NaN where unknown.
    disparity_px: NDArray[np.float32]
    origin: NDArray[np.uint8]  # of `Origin`: unless MATCHED, the disparity is a guess
    box: Box  # of the rectified left view
    is_half: bool
    picture: NDArray[np.uint8]  # (h, w) grey, of the same resolution

    @property
    def is_matched(self) -> NDArray[np.bool_]:
        """(h, w) pixels, as `disparity_px`, that are no guess."""
        return _find_matched(self.origin)

    @property
    def whole(self) -> tuple[NDArray[np.float32], NDArray[np.uint8]]:
        """(h, w) disparity in px and origin over the box."""
        if not self.is_half:
            return self.disparity_px.copy(), self.origin.copy()
        return np.float32(2.0) * double(self.disparity_px, self.box), double(self.origin, self.box)


@dataclass(frozen=True, slots=True, eq=False)
class Foreground:
    """What lies around a bone, and which of it stands in front of the bone's surface."""

    surroundings: Surroundings
    measured: DisparityMap  # what it has matched holds instead of the surroundings
    is_in_front: NDArray[np.bool_]  # (h, w) over the box, on the bone and just beside it

    @property
    def box(self) -> Box:
        """Of the rectified left view, around the bone."""
        return self.surroundings.box

    @property
    def depth(self) -> tuple[NDArray[np.float32], NDArray[np.uint8]]:
        """(h, w) disparity in px, NaN where unknown, and origin of all that is around the bone."""
        disparity_px, origin = self.surroundings.whole
        here, there = self.box.shared_slices(self.measured.box)
        is_matched = self.measured.is_matched[there]
        np.copyto(disparity_px[here], self.measured.disparity_px[there], where=is_matched)
        origin[here][is_matched] = Origin.MATCHED
        return disparity_px, origin


@dataclass(frozen=True, slots=True, eq=False)
class SurfaceCloud:
    """Points seen by the stereo camera, in the rectified left camera."""

    points_mm: FloatArray  # (N, 3)
    sigma_ray_mm: FloatArray  # (N,) standard deviation along the ray through the point
    pixels: NDArray[np.int32]  # (N, 2) int32 column and row in the rectified left view
    origin: NDArray[np.uint8]  # (N,) uint8 of `Origin`
    stride_px: int = 1  # distance of neighbouring points in the picture

    def __len__(self) -> int:
        return len(self.points_mm)

    def select(self, mask: NDArray[np.bool_] | NDArray[np.intp]) -> "SurfaceCloud":
        """A part of the cloud; points are taken to be spread evenly over it."""
        n_kept = int(mask.sum()) if mask.dtype == np.bool_ else len(mask)
        thinning = (len(self) / n_kept) ** 0.5 if n_kept else 1.0
        return SurfaceCloud(
            self.points_mm[mask],
            self.sigma_ray_mm[mask],
            self.pixels[mask],
            self.origin[mask],
            max(1, round(self.stride_px * thinning)),
        )
