"""A glossy bone: measured once more in pictures without what is mirrored in it.

A wet bone mirrors the lamps. Each eye sees the glints elsewhere, so that there the pictures match
beside the bone, or not at all, and too little of a small bone is left to be believed. Coloured
pictures tell what is mirrored from what comes out of the bone (`stereo/matte_pictures.py`).
"""

from collections.abc import Iterator
from dataclasses import replace
from functools import partial

import numpy as np

from navapp.geometry.transform import RigidTransform
from navapp.geometry.zbuffer import find_known_range
from navapp.stereo import refine_on_model
from navapp.stereo.matte_pictures import make_matte_pair
from navapp.tracking.following import Follower
from navapp.tracking.frame import Fit, Frame, RectifyBox
from navapp.tracking.surface_meter import Expected, Measurement, SurfaceMeter
from navapp.values import DisparityMap

# Where pictures without highlights answer nothing, grey ones are off by so many of the standard
# deviations that they claim (tests.bench.bone_highlights).
_GREY_ALONE = np.float32(1.7)
# Matching windows reach so far beyond the box, and a step so far beyond the support.
_WINDOW_PX, _STEP_PX = 12, 3.0


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
        if frame.rectify_coloured is None:
            return
        measure = partial(self._measure, rectify=frame.rectify_coloured)
        fit = Follower(self._meter, measure=measure).follow(frame, pose, skips_samples=True)
        if fit is not None:
            yield fit

    def _measure(self, expected: Expected, rectify: RectifyBox) -> Measurement:
        support_px = expected.support_px
        grey = refine_on_model(expected.pair, support_px)
        nearest_px, farthest_px = find_known_range(support_px)
        reach_px = nearest_px - _STEP_PX, farthest_px + _STEP_PX
        coloured = rectify(expected.pair.box.grow(_WINDOW_PX), reach_px)
        coloured = replace(coloured, box=expected.pair.box)
        matte = make_matte_pair(coloured, np.isfinite(support_px))
        found = grey
        if matte is not None:
            found = join_maps(grey, refine_on_model(matte, support_px))
        return self._meter.take_on_model(expected, found)


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
