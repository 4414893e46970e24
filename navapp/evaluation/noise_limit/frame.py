"""How far the steps from a pair of pictures to a pose are from the least error, frame by frame.

Each step is asked at the true pose, so that it need not find the bone: what is left is its error.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from drivers.frames import StereoFrame
from navapp.evaluation.noise_limit.limit import (
    Floats,
    PixelModel,
    estimate_ideally,
    find_least_error_mm,
    join_information,
    model_pixels,
    weigh_directions,
    weigh_pixels,
)
from navapp.evaluation.noise_limit.sensor import find_variances
from navapp.evaluation.scores import ErrorBudget
from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.rectification import RectifiedPair, Rectifier
from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.geometry.zbuffer import RenderedView, bounds_of, render_rectified
from navapp.stereo import refine_on_model
from navapp.values import DisparityMap
from sim_devices.sensor import SensorModel

# A pixel that differs from its partner by more than noise does (standard deviations) shows a
# highlight or an edge: what it says of the pose is false.
_MOST_DEVIATION = 3.0
# What lies further from the model is something else (`tests.bench.model_noise`).
_LARGEST_OFFSET_PX = 0.3
_FEWEST_PIXELS = 500
_MARGIN_PX = 8


@dataclass(frozen=True, slots=True, eq=False)
class _Seen:
    """A surface at its true pose in a pair."""

    pair: RectifiedPair
    view: RenderedView
    support_px: Floats  # (h, w) its disparity, NaN beside it
    pixels: PixelModel


def measure_budget(
    frame: StereoFrame,
    pose: RigidTransform,
    true: RigidTransform,
    surface: TriangleMesh,
    centre_mm: FloatArray,
    targets_mm: FloatArray,
    rectifier: Rectifier,
    sensor: SensorModel,
) -> ErrorBudget | None:
    """Errors of one frame; None where too little of the bone is matched at its true pose.

    Args:
        frame: whose pictures the sensor took.
        pose: left camera from bone, that a method told.
        true: the same, as it was.
        surface: of the bone as the camera sees it.
        centre_mm: (3,) of the bone.
        targets_mm: (N, 3) in bone coordinates.
        rectifier: of the rig.
        sensor: for the noise.
    """
    seen = _look(frame, true, surface, centre_mm, rectifier)
    if seen is None:
        return None
    found = refine_on_model(seen.pair, seen.support_px)
    offset_px = found.disparity_px - seen.support_px
    with np.errstate(invalid="ignore"):
        is_on = found.is_matched & (np.abs(offset_px) < _LARGEST_OFFSET_PX)
    pixels = seen.pixels.select(is_on[seen.pixels.rows, seen.pixels.columns])
    if len(pixels.rows) < _FEWEST_PIXELS:
        return None
    variances = find_variances(frame.left, frame.right, rectifier, sensor)
    told = weigh_pixels(seen.pair, seen.support_px, pixels, variances)
    obeys = np.abs(told.deviation) < _MOST_DEVIATION
    obeying, told = pixels.select(obeys), told.select(obeys)
    rectified = rectifier.geometry.rectified_from_left @ true
    mean_square = weigh_directions(rectified, centre_mm, targets_mm)
    off_mm = pose.apply(targets_mm) - true.apply(targets_mm)
    try:
        return ErrorBudget(
            find_least_error_mm(join_information(obeying, told), mean_square),
            _length_mm(estimate_ideally(obeying, told), mean_square),
            _length_mm(_fit(pixels, found, offset_px), mean_square),
            float(np.sqrt(np.mean(np.sum(off_mm**2, axis=1)))),
        )
    except np.linalg.LinAlgError:
        return None


def _look(
    frame: StereoFrame,
    true: RigidTransform,
    surface: TriangleMesh,
    centre_mm: FloatArray,
    rectifier: Rectifier,
) -> _Seen | None:
    """The pair around the surface at its true pose; None out of view."""
    geometry = rectifier.geometry
    pose = geometry.rectified_from_left @ true
    box, depths_mm = bounds_of(surface.vertices_mm, pose, geometry)
    if box is None or depths_mm[0] <= 0.0:
        return None
    near_px, far_px = (geometry.disparity_px(depth_mm) for depth_mm in depths_mm)
    around = box.grow(_MARGIN_PX).clip(geometry.width, geometry.height)
    band_px = (far_px - _MARGIN_PX, near_px + _MARGIN_PX)
    pair = rectifier.rectify(frame.left, frame.right, around, band_px, is_grey=True)
    view = render_rectified(surface, pose, geometry, box)
    pixels = model_pixels(view, surface, pose, geometry, centre_mm)
    support_px = geometry.disparity_map_px(view.depth_mm)
    return _Seen(replace(pair, box=box), view, support_px, pixels)


def _fit(pixels: PixelModel, found: DisparityMap, offset_px: Floats) -> FloatArray:
    """(6,) twist that the matched disparities tell, each weighed by its claimed sigma."""
    at = (pixels.rows, pixels.columns)
    weight = 1.0 / found.sigma_px[at].astype(np.float64) ** 2
    weighted = pixels.slopes * weight[:, None]
    return np.asarray(np.linalg.solve(weighted.T @ pixels.slopes, weighted.T @ offset_px[at]))


def _length_mm(twist: FloatArray, mean_square: FloatArray) -> float:
    """Root mean square over the targets of how far a twist moves them."""
    return math.sqrt(float(twist @ mean_square @ twist))
