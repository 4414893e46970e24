"""The surface of a bone, measured in a pair of pictures.

Four kinds: on the model at a pose, exact and near; on samples of it; freely, whatever is there; and
coarsely, to tell what lies where.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache, partial

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.both_eyes_kernels import mark_unclear
from navapp.geometry.box import Box
from navapp.geometry.masks import grow, large_regions
from navapp.geometry.rectification import Image, RectifiedPair, rectifier_of
from navapp.geometry.reduced_rectification import ReducedRectifier
from navapp.geometry.rig import StereoRig
from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.geometry.zbuffer import RenderedView, bounds_of
from navapp.registration import RegistrationModel, Scene
from navapp.stereo import (
    MODEL_REFINEMENT,
    CoarseMap,
    NearerSearch,
    match_coarsely,
    match_surface,
    refine,
    refine_on_model,
)
from navapp.values import DisparityMap, Origin, SurfaceCloud

# All chosen but where a source stands beside it.
# Errors of a free measurement are correlated over smooth bone, and over tissue that lies flush with
# it; those on the model over a matching window. Every covariance depends on them.
FREE_CORRELATION_PX, MODEL_CORRELATION_PX = 40.0, 11.0
_SAMPLED = replace(MODEL_REFINEMENT, n_steps=3, stops_at_rest=True, last_step_px=0.3)
_SAMPLES_PX = 6
# About so many measured points enter a fit.
_N_POINTS = 2500
# A larger gap in the answers is no highlight: something else covers the bone there. Windows that
# reach far into it see both, and most of what covers a bone lies in front of it.
_LARGEST_HIGHLIGHT_PX2 = 400
_MIXED_PX = 3
# Where a smaller fraction would be left, the gaps come from a pose that is still off.
_LEAST_UNMIXED_FRACTION = 0.5
# As of `mark_unclear`, where outlines are left out.
_OUTLINE_REACH_PX = 1
# Poses of which the bounds are kept.
_KEPT_BOUNDS = 8


@dataclass(frozen=True, slots=True)
class Margins:
    """How far around the predicted bone is looked: in the picture, and in depth."""

    box_px: int
    band_mm: float


# Matched around an expected bone from frame to frame; at first, and after a loss.
NEAR_BOX = Margins(box_px=16, band_mm=15.0)
WIDE_BOX = Margins(box_px=60, band_mm=35.0)
# Rectified around it: a little more than is matched when it is there, for it may have moved; much
# more when it has to be searched.
NEAR_VIEW = Margins(box_px=56, band_mm=60.0)
WIDE_VIEW = Margins(box_px=120, band_mm=65.0)
# What hides the bone may be so much nearer; what is seen through a wrong pose, so much further.
_AROUND = Margins(box_px=24, band_mm=60.0)


@dataclass(frozen=True, eq=False)
class Measurement:
    """The surface in the bone's box."""

    disparity: DisparityMap  # over the box
    # of the measured pixels, thinned: belongs to `disparity`, whoever replaces one replaces both.
    make_cloud: Callable[[], SurfaceCloud]
    matched_fraction: float  # of the pixels that were asked for: the box's, or the model's
    correlation_px: float  # distance in the picture over which its errors go together
    # the model that it was measured on; None of a free measurement.
    rendered: RenderedView | None = None

    @cached_property
    def cloud(self) -> SurfaceCloud:
        """Made when first asked for, so that a check can begin before; ask from one thread."""
        return self.make_cloud()

    @property
    def scene(self) -> Scene:
        """The cloud, to be registered to."""
        tells_shape = self.rendered is not None
        return Scene.from_stereo(self.cloud, self.correlation_px, tells_shape=tells_shape)


@dataclass(frozen=True, slots=True, eq=False)
class Expected:
    """What is to be seen of the model at a pose."""

    pair: RectifiedPair  # with the model's box
    # (h, w) disparity of the model over the box, NaN beside it and where it is not matched.
    support_px: NDArray[np.float32]
    view: RenderedView  # the model in that box


class SurfaceMeter:
    """Measures the surface of one bone under one rig.

    Args:
        rig: of the pictures.
        model: of the bone.
        depth_mm: nearest and farthest surface that the rig is used for.

    Attributes:
        leaves_out_outlines: the model is not matched at its outlines, nor where the right eye does
            not see it. So it is of a bone that was worked on, but for a tracked face, of which a
            part leaves a narrow ring. Of a whole bone the rims are a small part.
    """

    def __init__(
        self, rig: StereoRig, model: RegistrationModel, depth_mm: tuple[float, float]
    ) -> None:
        self.model, self.depth_mm = model, depth_mm
        self.leaves_out_outlines = model.bone.lid is not None and model.bone.face is None
        self.rectifier = rectifier_of(rig)
        self.geometry = self.rectifier.geometry
        self._reduced = {n: ReducedRectifier(self.rectifier, n) for n in NearerSearch.REDUCTIONS}
        # Several steps ask for the same few poses. No method: it would keep the meter alive.
        bounds = partial(bounds_of, model.hull_mm, geometry=self.geometry)
        self._bounds = lru_cache(_KEPT_BOUNDS)(bounds)

    def rectify(
        self,
        left: Image,
        right: Image,
        around: RigidTransform,
        margins: Margins,
        row_shifts_px: tuple[FloatArray, FloatArray] | None = None,
    ) -> RectifiedPair:
        """Both pictures, grey and rectified, as far around an expected pose as is asked for.

        Their rows are shifted as `Rectifier.rectify` says.
        """
        box, band_px = self.find_region(around, margins) or (None, None)
        return self.rectifier.rectify(
            left, right, box, band_px, is_grey=True, row_shifts_px=row_shifts_px
        )

    def make_nearer_search(self, left: Image, right: Image) -> NearerSearch:
        """How to look for what stands before the depths that were rectified, up to the nearest."""
        rectify = {n: partial(one.rectify, left, right) for n, one in self._reduced.items()}
        return NearerSearch(self.band_px[1], rectify)

    @property
    def band_px(self) -> tuple[float, float]:
        """Smallest and largest disparity that the rig is used for."""
        near_mm, far_mm = self.depth_mm
        return self.geometry.disparity_px(far_mm), self.geometry.disparity_px(near_mm)

    def rectify_surroundings(
        self, left: Image, right: Image, around: RigidTransform | None
    ) -> tuple[RectifiedPair, tuple[float, float]]:
        """Both pictures around a pose, and the disparities there; the whole view without one."""
        region = None if around is None else self.find_region(around, _AROUND)
        box, band_px = region or (None, self.band_px)
        return self.rectifier.rectify(left, right, box, band_px, is_grey=True), band_px

    def find_region(
        self, pose: RigidTransform, margins: Margins
    ) -> tuple[Box, tuple[float, float]] | None:
        """Box and disparity band around the model at a pose; None out of view or out of depth."""
        box, (nearest_mm, farthest_mm) = self._bounds(pose)
        if box is None:
            return None
        near = max(nearest_mm - margins.band_mm, self.depth_mm[0])
        far = min(farthest_mm + margins.band_mm, self.depth_mm[1])
        if near >= far:
            return None
        grown = box.grow(margins.box_px).clip(self.geometry.width, self.geometry.height)
        return grown, (self.geometry.disparity_px(far), self.geometry.disparity_px(near))

    def measure_freely(
        self, pair: RectifiedPair, pose: RigidTransform, margins: Margins
    ) -> Measurement | None:
        """Whatever surface is in the box and depth band around a pose; None out of view."""
        region = self.find_region(pose, margins)
        if region is None:
            return None
        box, band_px = region
        found = match_surface(replace(pair, box=box), band_px, fills=False).disparity
        return Measurement(
            found, partial(self._cloud, found), found.matched_fraction, FREE_CORRELATION_PX
        )

    def take_surface(self, found: DisparityMap, n_points: int) -> Measurement:
        """A free measurement from a map that was matched elsewhere: filled pixels count as well.

        Its cloud has so many points, spread evenly; all known pixels when they are fewer.
        """
        n_known = int(np.count_nonzero(found.origin))
        stride_px = max(1, int((0.9 * n_known / n_points) ** 0.5))
        cloud = found.reproject(self.geometry, stride_px, tuple(Origin)[1:])
        if len(cloud) > n_points:
            cloud = cloud.select(np.linspace(0, len(cloud) - 1, n_points).astype(np.intp))
        return Measurement(found, lambda: cloud, found.matched_fraction, FREE_CORRELATION_PX)

    def measure_coarsely(
        self, pair: RectifiedPair, pose: RigidTransform, box: Box | None = None
    ) -> CoarseMap | None:
        """Whatever lies in a box at the bone's depth; None out of view or depth.

        The box is of the rectified left view; without one it is around the bone, with some room.
        """
        region = self.find_region(pose, _AROUND)
        if region is None:
            return None
        return match_coarsely(replace(pair, box=box or region[0]), region[1])

    def render(
        self, pair: RectifiedPair, pose: RigidTransform, margins: Margins
    ) -> Expected | None:
        """What is to be seen of the model at a pose; None out of view."""
        region = self.find_region(pose, margins)
        if region is None:
            return None
        view = self.model.render(pose, self.geometry, region[0], has_lid=True)
        support_px = self.geometry.disparity_map_px(view.depth_mm)
        self.model.take_out_lid(view)
        is_unclear = ~view.mask
        if self.leaves_out_outlines:
            mark_unclear(support_px, _OUTLINE_REACH_PX, is_unclear)
        support_px[is_unclear] = np.nan
        return Expected(replace(pair, box=region[0]), support_px, view)

    def measure_on_model(
        self,
        expected: Expected,
        found: DisparityMap | None = None,
        correlation_px: float = MODEL_CORRELATION_PX,
    ) -> Measurement:
        """Sub-pixel matching on the model's own surface.

        Exact, but only where the surface lies within about half a pixel of the model's: elsewhere
        it answers nothing.

        Args:
            expected: of the model.
            found: matched there already, otherwise.
            correlation_px: over which its errors go together.
        """
        if found is None:
            found = refine_on_model(expected.pair, expected.support_px)
        is_expected = np.isfinite(expected.support_px)
        n_expected = max(int(np.count_nonzero(is_expected)), 1)
        return Measurement(
            found, lambda: self._cloud(remove_gap_rims(found, is_expected)),
            found.n_matched / n_expected, correlation_px, expected.view,
        )  # fmt: skip

    def measure_on_samples(self, expected: Expected) -> Measurement:
        """As `measure_on_model` at every sixth pixel each way, in more steps: it sees further.

        Rims of large gaps are kept.
        """
        support_px = expected.support_px
        thin = refine(expected.pair, support_px, _SAMPLED, _SAMPLES_PX)
        asked = support_px[::_SAMPLES_PX, ::_SAMPLES_PX]
        n_asked = max(int(np.count_nonzero(np.isfinite(asked))), 1)
        matched_fraction = int(np.count_nonzero(thin.origin)) / n_asked
        found = _spread(thin, _SAMPLES_PX, support_px.shape)
        make_cloud = partial(found.reproject, self.geometry, _SAMPLES_PX)
        return Measurement(found, make_cloud, matched_fraction, MODEL_CORRELATION_PX, expected.view)

    def _cloud(self, found: DisparityMap) -> SurfaceCloud:
        """About `_N_POINTS` of the measured ones."""
        stride_px = max(1, round((found.n_matched / _N_POINTS) ** 0.5))
        return found.reproject(self.geometry, stride_px)


def remove_gap_rims(found: DisparityMap, is_expected: NDArray[np.bool_]) -> DisparityMap:
    """Without the rims of large gaps in what is expected (h, w), unless that leaves too little."""
    is_matched = found.is_matched
    gaps = large_regions(is_expected & ~is_matched, _LARGEST_HIGHLIGHT_PX2, connectivity=4)
    stays = is_matched & ~grow(gaps, _MIXED_PX)
    if np.count_nonzero(stays) < _LEAST_UNMIXED_FRACTION * np.count_nonzero(is_matched):
        return found
    return found.only(stays)


def _spread(thin: DisparityMap, stride_px: int, shape: tuple[int, ...]) -> DisparityMap:
    """A map of every `stride_px`-th pixel at its full size (h, w); unknown in between."""
    disparity_px, sigma_px = (np.full(shape, np.nan, dtype=np.float32) for _ in range(2))
    origin = np.zeros(shape, dtype=np.uint8)
    disparity_px[::stride_px, ::stride_px] = thin.disparity_px
    sigma_px[::stride_px, ::stride_px] = thin.sigma_px
    origin[::stride_px, ::stride_px] = thin.origin
    return DisparityMap(disparity_px, sigma_px, origin, thin.x, thin.y)
