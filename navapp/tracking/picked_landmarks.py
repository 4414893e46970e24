"""A rough pose from landmarks that an operator has picked in the left picture.

Source: rigid fit of two point sets (Arun 1987), the picked ones by stereo matching around them.
"""

from collections.abc import Sequence

import numpy as np

from navapp.geometry.box import Box
from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.stereo import match_surface
from navapp.tracking.surface_meter import SurfaceMeter
from navapp.values import FEWEST_PICKS, DisparityMap, Pick, StereoPictures

# All chosen. A pick lies as deep as what is matched around it; a picture is measured a little
# further than that.
_AROUND_PX, _SPARE_PX = 10, 40
# Landmarks that lie nearer than this to one line (rms) do not tell the turn about it; so many
# turns are tried.
_LEAST_WIDTH_MM, _N_TURNS = 6.0, 12


def find_rough_poses(
    pictures: StereoPictures, picks: Sequence[Pick], meter: SurfaceMeter
) -> list[RigidTransform]:
    """Left camera from bone, where the picked landmarks have it.

    Returns:
        One pose; several, turned about their line, when the landmarks lie on one; none when fewer
        than three of them have a depth.
    """
    seen_mm = measure_picks_mm(pictures, picks, meter)
    is_known = np.isfinite(seen_mm).all(axis=1)
    if is_known.sum() < FEWEST_PICKS:
        return []
    model_mm = np.array([pick.model_mm for pick in picks])[is_known]
    return fit_poses(seen_mm[is_known], model_mm, meter.model.bone.name)


def measure_picks_mm(
    pictures: StereoPictures, picks: Sequence[Pick], meter: SurfaceMeter
) -> FloatArray:
    """(N, 3) of the picks in the left camera; NaN where nothing is matched around one."""
    geometry, rig = meter.geometry, meter.rectifier.rig
    pixels = np.array([pick.left_px for pick in picks], dtype=np.float64)
    rays = geometry.rectified_from_left.rotate(rig.left.rays(pixels))
    at_px = geometry.project(rays)
    around = Box.around(at_px)
    if around is None:
        return np.full((len(picks), 3), np.nan)
    box = around.grow(_AROUND_PX + _SPARE_PX)
    left, right = pictures.left, pictures.right
    pair = meter.rectifier.rectify(left, right, box, meter.band_px, is_grey=True)
    if pair.box.is_empty:
        return np.full((len(picks), 3), np.nan)
    found = match_surface(pair, meter.band_px, fills=False).disparity
    disparity_px = np.array([_disparity_around(found, place) for place in at_px])
    depth_mm = geometry.focal_px * geometry.baseline_mm / disparity_px
    points_mm: FloatArray = geometry.rectified_from_left.inverse().apply(
        rays / rays[:, 2:] * depth_mm[:, None]
    )
    return points_mm


def _disparity_around(found: DisparityMap, at_px: FloatArray) -> float:
    """Median of what is matched around a place in the rectified left view; NaN without any."""
    x, y = (round(float(value)) for value in at_px)
    _, there = Box(x, y, 1, 1).grow(_AROUND_PX).shared_slices(found.box)
    matched = found.disparity_px[there][found.is_matched[there]]
    return float(np.median(matched)) if len(matched) else float("nan")


def fit_poses(seen_mm: FloatArray, model_mm: FloatArray, bone: str) -> list[RigidTransform]:
    """Left camera from bone: points (N, 3) of the bone onto seen ones, in the least squares' sense.

    Several, turned about their line, when the points lie on one.
    """
    fitted = RigidTransform.fit("left", bone, seen_mm, model_mm)
    _, sizes, axes = np.linalg.svd(model_mm - model_mm.mean(axis=0))
    if sizes[1] / np.sqrt(len(model_mm)) >= _LEAST_WIDTH_MM:
        return [fitted]
    line = fitted.rotate(axes[0])
    turns_rad = 2.0 * np.pi / _N_TURNS * np.arange(_N_TURNS)
    middle_mm = seen_mm.mean(axis=0)
    return [fitted.move(np.concatenate([np.zeros(3), a * line]), middle_mm) for a in turns_rad]
