"""Whether a stereo pair can be trusted: rows that agree, light, sharpness.

Matching looks along rows only. What it finds is right as long as the cameras still stand to each
other as they were calibrated; the rows tell, and nothing of the fit has looked at them.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.box import Box
from navapp.geometry.rectification import Image, RectifiedPair
from navapp.geometry.transform import FloatArray
from navapp.stereo.health_kernels import measure_rows
from navapp.values import DisparityMap

# Windows of 9 pixels that do not overlap, so that their noise is their own.
_STRIDE_PX, _RADIUS_PX = 10, 4
_MOST_POINTS, _FEWEST_POINTS = 128, 12
# A window that tells its row to no better than this has no texture across the row.
_WORST_SIGMA_PX = 0.3
# A linear step is exact near its end only.
_MOST_STEPS, _SETTLED_PX = 4, 0.05
_LARGEST_PX = 3.0
# Windows that share less than half of their variance do not show the same: steps between them end
# anywhere.
_LEAST_CORRELATION = 0.7
# Texture of a twentieth is below one grey level here; and what a sensor clips to.
_DARK_LEVEL, _SATURATED_LEVEL = 16, 250
_ROWS_APART, _COLUMNS_APART = 2, 4
# Differences that grow with the distance by so many standard errors show more than noise; chosen.
_SURE_ERRORS = 10.0
_STRETCH_ROUNDS = 3
# Row offsets of many points that go together: highlights lie elsewhere in both pictures.
_ALIKE_PX = 0.05
_NO_ROWS = (math.nan,) * 4  # offset and stretch, and their standard errors
_MEDIAN_TO_MEAN, _MAD_TO_SIGMA = 1.2533, 1.4826


@dataclass(frozen=True, slots=True)
class PictureHealth:
    """Light and sharpness of one picture around the bone."""

    dark_fraction: float  # of pixels too dark to show a bone's texture
    saturated_fraction: float  # of pixels that the sensor clipped
    detail: float  # rms difference of pixels two rows apart over the mean grey level
    # By how much the mean squared difference of pixels grows from four to eight rows apart, over
    # its growth from two to four: 4 where nothing is finer than eight rows, 2 or less in focus.
    # White noise and contrast cancel out. NaN where it grows by no more than chance.
    smoothness: float = math.nan


@dataclass(frozen=True, slots=True)
class StereoHealth:
    """What a pair says of its own cameras."""

    left: PictureHealth  # picture of the left camera
    right: PictureHealth  # of the right one, where it shows the same
    # how much lower the right picture shows what the left one shows; NaN when too few points tell,
    # or when it is too far off to be told.
    row_offset_px: float = math.nan
    row_offset_sigma_px: float = math.nan  # its standard error
    # by how much the right picture is taller than the left one, over its height; NaN as above.
    row_stretch: float = math.nan
    row_stretch_sigma: float = math.nan  # its standard error
    n_points: int = 0  # that told
    # median over their windows, of both pictures' grey values; 0 when the rows are further off than
    # is looked for.
    correlation: float = math.nan

    @property
    def has_lost_rows(self) -> bool:
        """Points matched along the rows, but what is around them differs: the rows are far off."""
        return self.correlation < _LEAST_CORRELATION


def measure_health(
    pair: RectifiedPair, found: DisparityMap | None, expected_px: float
) -> StereoHealth:
    """Health of a pair.

    Args:
        pair: rectified grey pictures.
        found: disparity that was matched in it; without one its rows are not compared.
        expected_px: disparity of what is looked at: where the right picture shows the box.
    """
    box = pair.box if found is None else found.box
    partner = Box(box.x - round(expected_px), box.y, box.width, box.height)
    left, right = _picture_health(pair.left, box), _picture_health(pair.right, partner)
    if found is None:
        return StereoHealth(left, right)
    return StereoHealth(left, right, *_rows(pair, found))


def _rows(
    pair: RectifiedPair, found: DisparityMap
) -> tuple[float, float, float, float, int, float]:
    """Median row offset, stretch, each with its standard error, number of points, correlation.

    Steps are repeated from the common offset: single windows are too noisy to follow.
    """
    stride_px = max(_STRIDE_PX, math.ceil((found.n_matched / _MOST_POINTS) ** 0.5))
    answers = np.empty((2 * _MOST_POINTS, 5))
    offset_px = 0.0
    for _ in range(_MOST_STEPS):
        n = measure_rows(
            pair.left, pair.right, found.disparity_px, found.origin, (found.x, found.y),
            (stride_px, _RADIUS_PX), offset_px, answers,
        )  # fmt: skip
        told = answers[:n][answers[:n, 1] < _WORST_SIGMA_PX]
        if len(told) < _FEWEST_POINTS:
            return *_NO_ROWS, len(told), math.nan
        before_px, offset_px = offset_px, float(np.median(told[:, 0]))
        if abs(offset_px) > _LARGEST_PX:
            return *_NO_ROWS, len(told), 0.0
        if abs(offset_px - before_px) < _SETTLED_PX:
            break
    correlation = float(np.median(told[:, 2]))
    if correlation < _LEAST_CORRELATION:
        return *_NO_ROWS, len(told), correlation
    spread_px = _MAD_TO_SIGMA * float(np.median(np.abs(told[:, 0] - offset_px)))
    sigma_px = _MEDIAN_TO_MEAN * spread_px / math.sqrt(len(told))
    stretch, stretch_sigma = _fit_stretch(told[:, 0], told[:, 3:])
    return offset_px, sigma_px, stretch, stretch_sigma, len(told), correlation


def _fit_stretch(offsets_px: FloatArray, places_px: FloatArray) -> tuple[float, float]:
    """How row offsets (N,) grow with the row of their points (N, 2), and its standard error.

    They may grow with the column as well, as those of a camera that is turned in its plane do.
    Least squares, with what lies more than three standard deviations off left out.
    """
    terms = np.column_stack([np.ones(len(places_px)), places_px - places_px.mean(axis=0)])
    stays = np.ones(len(terms), dtype=np.bool_)
    for _ in range(_STRETCH_ROUNDS):
        solved, *_ = np.linalg.lstsq(terms[stays], offsets_px[stays], rcond=None)
        off_px = np.abs(offsets_px - terms @ solved)
        spread_px = _MAD_TO_SIGMA * float(np.median(off_px[stays]))
        stays = off_px <= 3.0 * spread_px
    inverse = np.linalg.pinv(terms[stays].T @ terms[stays])
    alike = _ALIKE_PX / max(float(terms[stays, 2].std()), 1.0)
    return float(solved[2]), math.hypot(spread_px * math.sqrt(float(inverse[2, 2])), alike)


def _picture_health(picture: Image, box: Box) -> PictureHealth:
    """Of the part of the box that lies in the picture; of nothing, all dark."""
    inside = box.clip(picture.shape[1], picture.shape[0])
    part = picture[inside.slices][::_ROWS_APART, ::_COLUMNS_APART].astype(np.float32)
    if part.size == 0 or part.shape[0] < 2:
        return PictureHealth(1.0, 0.0, 0.0)
    return PictureHealth(
        np.count_nonzero(part < _DARK_LEVEL) / part.size,
        np.count_nonzero(part >= _SATURATED_LEVEL) / part.size,
        math.sqrt(_mean_square_step(part, 1)) / max(float(part.mean()), 1.0),
        _measure_smoothness(part),
    )


def _measure_smoothness(part: NDArray[np.float32]) -> float:
    """`PictureHealth.smoothness` of a picture (H, W) that holds every second row."""
    if part.shape[0] <= 4:
        return math.nan
    near, middle, far = (_mean_square_step(part, n) for n in (1, 2, 4))
    # Approximate standard error of a mean square, if the differences are noise alone.
    error = near * math.sqrt(2.0 / part.size)
    return (far - middle) / (middle - near) if middle - near > _SURE_ERRORS * error else math.nan


def _mean_square_step(part: NDArray[np.float32], n_steps: int) -> float:
    step = (part[n_steps:] - part[:-n_steps]).ravel()
    return float(step @ step) / len(step)
