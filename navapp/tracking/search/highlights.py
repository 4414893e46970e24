"""A glossy bone: measured once more in pictures without what is mirrored in it.

A wet bone mirrors the lamps. Each eye sees the glints elsewhere, so that there the pictures match
beside the bone, or not at all, and too little of a small bone is left to be believed. Coloured
pictures tell what is mirrored from what comes out of the bone (`stereo/matte_pictures.py`).
"""

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.rectification import RectifiedPair
from navapp.geometry.transform import RigidTransform
from navapp.stereo import refine_on_model
from navapp.stereo.matte_pictures import RESAMPLED_REACH_PX, find_near_clipped, make_matte_pair
from navapp.tracking.following import Follower
from navapp.tracking.frame import Fit, Frame
from navapp.tracking.surface_meter import (
    FREE_CORRELATION_PX,
    NEAR_BOX,
    NEAR_VIEW,
    Expected,
    Measurement,
    SurfaceMeter,
)
from navapp.values import DisparityMap

# How far both are off, over what they claim and over the 0.65 beyond which residuals are no noise
# (`TOLERATED_VARIANCE_RATIO`): pictures without highlights have less texture, and where they
# answer nothing, grey ones see the highlights (tests.bench.bone_highlights).
_MATTE_ALONE, _GREY_ALONE = np.float32(1.5), np.float32(2.0)
# Spread of the differences between both answers, over what both claim, and pixels that are answered
# without highlights, over those in grey. On six matt patellas 0.62 to 0.68 and 0.97 to 1.01, on
# fifteen glossy ones 0.70 to 1.20 and 1.11 to 1.40 (tests.bench.bone_highlights). With too little
# colour for its texture noise contradicts as well, but then fewer pixels are answered.
_LEAST_CONTRADICTION, _LEAST_ANSWERED = 0.75, 1.08
_MAD_TO_SIGMA = 1.4826

MeasureMatte = Callable[[Expected], Measurement | None]


class HighlightSearch:
    """Follows one bone onto what is measured of it without highlights."""

    def __init__(self, meter: SurfaceMeter) -> None:
        self._meter = meter

    def find(self, frame: Frame, pose: RigidTransform) -> Iterator[Fit]:
        """The fit at which the bone rests near a pose (rectified left camera from bone).

        Nothing where no highlights are seen: in grey pictures, without colour, on a matt bone.
        """
        begun = self._begin(frame, pose)
        if begun is None:
            return
        first, measure_matte = begun
        # The follower begins where this was measured.
        firsts, found = iter([first]), None

        def measure(expected: Expected) -> Measurement:
            nonlocal found
            found = next(firsts, None) or measure_matte(expected)
            return found or self._meter.measure_on_model(expected)

        fit = Follower(self._meter, measure=measure).follow(frame, pose, skips_samples=True)
        if fit is not None and fit.measured is found:
            yield fit

    def measure(self, frame: Frame, pose: RigidTransform) -> Measurement | None:
        """The surface at a pose, as `find` measures it; None where no highlights are seen."""
        begun = self._begin(frame, pose)
        return None if begun is None else begun[0]

    def _begin(self, frame: Frame, pose: RigidTransform) -> tuple[Measurement, MeasureMatte] | None:
        """What is measured at a pose, and what measures so nearby; None without highlights."""
        region = self._meter.find_region(pose, NEAR_VIEW)
        expected = self._meter.render(frame.pair, pose, NEAR_BOX)
        left, right, shifts_px = frame.pictures.left, frame.pictures.right, frame.row_shifts_px
        if left.ndim == 2 or region is None or expected is None:
            return None
        coloured = self._meter.rectifier.rectify(left, right, *region, row_shifts_px=shifts_px)
        matte = make_matte_pair(
            replace(coloured, box=expected.pair.box), np.isfinite(expected.support_px)
        )
        if matte is None:
            return None
        # What was filled was not measured.
        is_filled = find_near_clipped(coloured.left, RESAMPLED_REACH_PX)
        measure_matte = partial(self._measure_matte, matte, is_filled)
        first = measure_matte(expected)
        return None if first is None else (first, measure_matte)

    def _measure_matte(
        self, matte: RectifiedPair, is_filled: NDArray[np.bool_], expected: Expected
    ) -> Measurement | None:
        """With what pictures without highlights say; None where these say nothing else."""
        support_px, box = expected.support_px, expected.pair.box
        pairs = expected.pair, replace(matte, box=box)
        found, without = (refine_on_model(one, support_px) for one in pairs)
        without = without.only(~is_filled[box.slices])
        if not are_highlights_seen(found, without):
            return None
        return self._meter.measure_on_model(
            expected, join_maps(found, without), FREE_CORRELATION_PX
        )


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
        np.where(has_matte, _MATTE_ALONE * matte.sigma_px, _GREY_ALONE * grey.sigma_px),
        np.where(has_matte, matte.origin, grey.origin),
        grey.x,
        grey.y,
    )
