"""Measured points around a bone, by OpenCV's SGBM with or without the contributed WLS filter."""

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np

from drivers.frames import StereoFrame
from navapp.geometry.box import Box
from navapp.geometry.rectification import RectifiedPair, Rectifier
from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.geometry.zbuffer import bounds_of
from tests.bench.sgbm import make_matcher

# OpenCV tells disparities in sixteenths of a pixel, and looks for a multiple of sixteen of them.
_OPENCV_SCALE, _BLOCK = 16, 16


@dataclass(frozen=True, slots=True)
class StereoSettings:
    """How a peer's points are made."""

    window_px: int
    wls_lambda: float | None  # strength of the filter; None: it is not used
    margin_px: int  # around the bone's box
    margin_mm: float  # in depth, before and behind the bone
    n_points: int  # so many go on, or up to twice as many; all where there are fewer
    uniqueness_percent: int = 5
    speckle_px: int = 80
    wls_sigma: float = 1.5
    least_confidence: float = 127.0  # of 255, of the filter in a pixel that is used


def find_points_mm(
    frame: StereoFrame,
    rectifier: Rectifier,
    surface_mm: FloatArray,
    rectified_from_bone: RigidTransform,
    settings: StereoSettings,
) -> FloatArray | None:
    """(N, 3) in the rectified left camera, around the bone's last pose; None: out of view."""
    geometry = rectifier.geometry
    box, (near_mm, far_mm) = bounds_of(surface_mm, rectified_from_bone, geometry)
    if box is None or near_mm <= settings.margin_mm:
        return None
    lowest = int(geometry.disparity_px(far_mm + settings.margin_mm))
    highest = geometry.disparity_px(near_mm - settings.margin_mm)
    count = -(-(int(highest) + 1 - lowest) // _BLOCK) * _BLOCK
    pair = rectifier.rectify(
        frame.left,
        frame.right,
        box.grow(settings.margin_px),
        (float(lowest), float(lowest + count)),
        is_grey=True,
    )
    disparity_px = _match(pair, lowest, count, settings)
    return _lift(disparity_px, pair, settings.n_points)


def _match(pair: RectifiedPair, lowest: int, count: int, settings: StereoSettings) -> FloatArray:
    """(h, w) disparity of the pair's box, px; NaN where nothing was matched.

    Args:
        pair: rectified pictures.
        lowest: smallest disparity that is looked for, px.
        count: so many are, a multiple of 16.
        settings: of the matcher, and of the filter.
    """
    # The right picture is moved by the lowest disparity, and both crops begin so far to the left
    # that no column of the box lacks a partner.
    box, lead = pair.box, count + settings.window_px
    left = _crop(pair.left, box.x - lead, box.width + lead, box)
    right = _crop(pair.right, box.x - lead - lowest, box.width + lead, box)
    found = np.asarray(_make_matcher(0, count, settings).compute(left, right))
    is_sure = np.ones(found.shape, dtype=np.bool_)
    if settings.wls_lambda is not None:
        found, is_sure = _filter(found, left, right, count, settings)
    raw = found[:, lead:].astype(np.float64)
    return np.where((raw >= 0.0) & is_sure[:, lead:], raw / _OPENCV_SCALE + lowest, np.nan)


def _filter(
    found: Any, left: Any, right: Any, count: int, settings: StereoSettings
) -> tuple[Any, Any]:
    """The left picture's matches, filtered with those of the right one; where that is sure."""
    backward = _make_matcher(1 - count, count, settings)
    wls = cv2.ximgproc.createDisparityWLSFilterGeneric(True)
    wls.setLambda(settings.wls_lambda)
    wls.setSigmaColor(settings.wls_sigma)
    wls.setDepthDiscontinuityRadius(settings.window_px // 2 + 1)
    filtered = wls.filter(found, left, None, backward.compute(right, left))
    is_sure = np.asarray(wls.getConfidenceMap()) >= settings.least_confidence
    return np.asarray(filtered), is_sure


def _make_matcher(lowest: int, count: int, settings: StereoSettings) -> Any:
    return make_matcher(
        lowest, count, settings.window_px, settings.uniqueness_percent, settings.speckle_px
    )


def _crop(picture: Any, x: int, width: int, box: Box) -> Any:
    """Columns x .. x + width - 1 of the box's rows; black beside the picture."""
    inside = picture[box.y : box.y + box.height, max(x, 0) : max(x + width, 0)]
    before = min(max(-x, 0), width)
    after = width - before - inside.shape[1]
    return np.ascontiguousarray(np.pad(inside, ((0, 0), (before, after))))


def _lift(disparity_px: FloatArray, pair: RectifiedPair, n_points: int) -> FloatArray:
    """(N, 3) points of what was matched, spread evenly."""
    box, geometry = pair.box, pair.geometry
    rows, columns = np.nonzero(disparity_px > 0.0)
    every = max(1, len(rows) // n_points)
    rows, columns = rows[::every], columns[::every]
    z = geometry.focal_px * geometry.baseline_mm / disparity_px[rows, columns]
    x = (columns + box.x - geometry.centre_x_px) / geometry.focal_px
    y = (rows + box.y - geometry.centre_y_px) / geometry.focal_px
    return np.column_stack([x * z, y * z, z])
