"""A glossy bone: measured once more in pictures without what is mirrored in it.

A wet bone mirrors the lamps. Each eye sees the glints elsewhere, so that there the pictures match
beside the bone, or not at all, and too little of a small bone is left to be believed. Coloured
pictures tell what is mirrored from what comes out of the bone (`stereo/matte_pictures.py`).
"""

from collections.abc import Iterator
from dataclasses import replace
from functools import partial

import numpy as np

from navapp.geometry.rectification import RectifiedPair
from navapp.geometry.transform import RigidTransform
from navapp.stereo import refine_on_model
from navapp.stereo.matte_pictures import make_matte_pair
from navapp.tracking.following import Follower
from navapp.tracking.frame import Fit, Frame
from navapp.tracking.surface_meter import NEAR_VIEW, Expected, Measurement, SurfaceMeter
from navapp.values import DisparityMap

# Where pictures without highlights answer nothing, grey ones are off by so many of the standard
# deviations that they claim (tests.bench.bone_highlights).
_GREY_ALONE = np.float32(1.7)
# Spread of the differences between both answers, over what both claim. On six matt patellas it is
# 0.62 to 0.68, on the same glossy ones 0.81 to 1.06 (tests.bench.bone_highlights); in between.
_LEAST_CONTRADICTION = 0.75
# With too little colour for its texture, noise contradicts as well: then fewer pixels are answered
# than in grey; on these patellas it was 0.97 of them and more.
_LEAST_ANSWERED = 0.95
_MAD_TO_SIGMA = 1.4826


class HighlightSearch:
    """Follows one bone onto what is measured of it without highlights.

    Args:
        meter: of the bone's surface.
    """

    def __init__(self, meter: SurfaceMeter) -> None:
        self._meter = meter

    def find(self, frame: Frame, pose: RigidTransform) -> Iterator[Fit]:
        """The fit at which the bone rests near a pose (rectified left camera from bone).

        None of grey pictures, and of pictures without colour.
        """
        region = self._meter.find_region(pose, NEAR_VIEW)
        if frame.rectify_coloured is None or region is None:
            return
        measure = partial(self._measure, coloured=frame.rectify_coloured(*region))
        fit = Follower(self._meter, measure=measure).follow(frame, pose, skips_samples=True)
        if fit is not None:
            yield fit

    def _measure(self, expected: Expected, coloured: RectifiedPair) -> Measurement:
        support_px, box = expected.support_px, expected.pair.box
        found = refine_on_model(expected.pair, support_px)
        matte = make_matte_pair(replace(coloured, box=box), np.isfinite(support_px))
        if matte is not None:
            without = refine_on_model(matte, support_px)
            if are_highlights_seen(found, without):
                found = join_maps(found, without)
        return self._meter.take_on_model(expected, found)


def are_highlights_seen(grey: DisparityMap, matte: DisparityMap) -> bool:
    """Whether pictures without highlights say something else than grey ones, and say enough.

    Where nothing is mirrored they only claim less, and would hide that a model does not fit.
    """
    has_colour = matte.n_matched >= _LEAST_ANSWERED * grey.n_matched
    return has_colour and measure_contradiction(grey, matte) >= _LEAST_CONTRADICTION


def measure_contradiction(grey: DisparityMap, matte: DisparityMap) -> float:
    """Spread of the differences of two maps, over what both claim; 0 where they do not meet."""
    both = (grey.origin > 0) & (matte.origin > 0)
    if not both.any():
        return 0.0
    claimed_px = np.hypot(grey.sigma_px[both], matte.sigma_px[both])
    ratios = (grey.disparity_px[both] - matte.disparity_px[both]) / claimed_px
    return float(_MAD_TO_SIGMA * np.median(np.abs(ratios - np.median(ratios))))


def join_maps(grey: DisparityMap, matte: DisparityMap) -> DisparityMap:
    """Of a glossy bone what pictures without highlights say; where they are silent, grey ones."""
    has_matte = matte.origin > 0
    return DisparityMap(
        np.where(has_matte, matte.disparity_px, grey.disparity_px),
        np.where(has_matte, matte.sigma_px, _GREY_ALONE * grey.sigma_px),
        np.where(has_matte, matte.origin, grey.origin),
        grey.x,
        grey.y,
    )
