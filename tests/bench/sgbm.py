"""Disparity by OpenCV's semi-global block matching, inside a box and a band."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.box import Box
from navapp.geometry.rectification import RectifiedPair
from navapp.values import DisparityMap, Origin

_OPENCV_SCALE = 16
_BLOCK = 16


@dataclass(frozen=True, slots=True)
class SgbmSettings:
    """How OpenCV's matcher is used.

    Attributes:
        window_px: block size, odd.
        sigma_px: standard deviation that is claimed for every match. The matcher's staircase on
            smooth slanted surfaces (0.13-0.27 px median deviation) is its largest part.
        uniqueness_percent: how much better the best match must be than the second.
        speckle_px: smaller islands of similar disparity are removed.
        contrast_grey: a window of the left picture with a smaller range of grey levels (no light,
            glare) matches everything, so it matches nothing.
    """

    window_px: int = 5
    sigma_px: float = 0.25
    uniqueness_percent: int = 5
    speckle_px: int = 80
    contrast_grey: int = 3


def match_sgbm(
    pair: RectifiedPair, band_px: tuple[float, float], settings: SgbmSettings | None = None
) -> DisparityMap:
    """Match the box of a rectified pair; nothing outside the band's window is found.

    Args:
        pair: rectified pictures; `pair.box` is matched.
        band_px: smallest and largest disparity expected; see `disparity_window`.
        settings: of the matcher.

    Returns:
        The map over `pair.box`; unmatched pixels are NaN, nothing is filled.

    Source: Hirschmueller 2008, as in OpenCV's `StereoSGBM` (three-way).
    """

    settings = settings or SgbmSettings()
    box = pair.box
    lowest, n_disparities = disparity_window(band_px)
    if box.is_empty:
        empty = np.zeros((max(box.height, 0), max(box.width, 0)), dtype=np.float32)
        return _map(empty, empty > 0.0, settings, box)
    # The right picture is moved by the lowest disparity, so that the search starts at zero, and
    # both crops begin so far to the left that no column of the box lacks a partner.
    lead = n_disparities + settings.window_px
    width = box.width + lead
    left = _crop(pair.left, box.x - lead, width, box)
    right = _crop(pair.right, box.x - lead - lowest, width, box)
    channels = 1 if left.ndim == 2 else left.shape[2]
    matcher = make_matcher(
        0,
        n_disparities,
        settings.window_px,
        settings.uniqueness_percent,
        settings.speckle_px,
        channels,
    )
    raw = np.asarray(matcher.compute(left, right))[:, lead:].astype(np.float32)
    disparity = (raw / np.float32(_OPENCV_SCALE) + np.float32(lowest)).astype(np.float32)
    # A pixel and its right partner must be inside their pictures.
    rows = np.arange(box.y, box.y + box.height)[:, None]
    columns = np.arange(box.x, box.x + box.width, dtype=np.float32)
    partner = columns - disparity
    last_row, last_column = pair.left.shape[0] - 1, pair.left.shape[1] - 1
    is_matched = (raw > 0.0) & (raw < _OPENCV_SCALE * (n_disparities - 1))
    is_matched &= (partner >= 0.0) & (partner <= last_column)
    is_matched &= (columns >= 0.0) & (columns <= last_column) & (rows >= 0) & (rows <= last_row)
    is_matched &= _has_contrast(left, settings)[:, lead:]
    return _map(disparity, is_matched, settings, box)


def make_matcher(
    lowest: int,
    n_disparities: int,
    window_px: int,
    uniqueness_percent: int,
    speckle_px: int,
    channels: int = 1,
) -> Any:
    """OpenCV's three-way SGBM with the penalties that its documentation proposes."""
    import cv2

    return cv2.StereoSGBM.create(
        minDisparity=lowest,
        numDisparities=n_disparities,
        blockSize=window_px,
        P1=8 * channels * window_px**2,
        P2=32 * channels * window_px**2,
        disp12MaxDiff=1,
        preFilterCap=63,
        uniquenessRatio=uniqueness_percent,
        speckleWindowSize=speckle_px,
        speckleRange=2,
        mode=cv2.STEREO_SGBM_MODE_SGBM_3WAY,
    )


def disparity_window(band_px: tuple[float, float]) -> tuple[int, int]:
    """Lowest disparity and number of disparities (a multiple of 16) that hold the band.

    At least one more stands on either side: a best match at the window's end is no minimum.
    """
    low, high = band_px
    if not (np.isfinite(low) and np.isfinite(high) and low < high):
        raise ValueError(f"a disparity band needs two growing numbers, not {band_px}")
    lowest = int(np.floor(low)) - 1
    return lowest, _BLOCK * max(1, int(np.ceil((high - lowest + 2) / _BLOCK)))


def _crop(image: NDArray[np.uint8], x0: int, width: int, box: Box) -> NDArray[np.uint8]:
    """Columns x0 .. x0 + width - 1 of the box's rows; black outside the picture."""
    out = np.zeros((box.height, width, *image.shape[2:]), dtype=np.uint8)
    inside = Box(x0, box.y, width, box.height).clip(image.shape[1], image.shape[0])
    if not inside.is_empty:
        x, y = inside.x - x0, inside.y - box.y
        out[y : y + inside.height, x : x + inside.width] = image[
            inside.y : inside.y + inside.height, inside.x : inside.x + inside.width
        ]
    return out


def _has_contrast(image: NDArray[np.uint8], settings: SgbmSettings) -> NDArray[np.bool_]:
    """(h, w) pixels whose window holds something to match."""
    import cv2

    window = np.ones((settings.window_px, settings.window_px), dtype=np.uint8)
    spread = cv2.subtract(cv2.dilate(image, window), cv2.erode(image, window))
    found = np.asarray(spread) >= settings.contrast_grey
    return found if image.ndim == 2 else np.asarray(found.any(axis=2), dtype=np.bool_)


def _map(
    disparity: NDArray[np.float32], is_matched: NDArray[np.bool_], settings: SgbmSettings, box: Box
) -> DisparityMap:
    return DisparityMap(
        np.where(is_matched, disparity, np.nan).astype(np.float32),
        np.where(is_matched, settings.sigma_px, np.nan).astype(np.float32),
        np.where(is_matched, Origin.MATCHED, Origin.UNKNOWN).astype(np.uint8),
        box.x,
        box.y,
    )
