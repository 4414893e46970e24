"""The measured surface around a pose: freely, or on the model itself."""

import time
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.rectification import Box, RectifiedPair, Rectifier
from navapp.geometry.rig import StereoRig
from navapp.geometry.transform import RigidTransform
from navapp.geometry.zbuffer import projected_box, render_rectified
from navapp.registration import RegistrationModel
from navapp.stereo import SgbmSettings, fill_occlusions, match_sgbm, refine, reproject
from navapp.values import DisparityMap, LineTimings, SurfaceCloud

Image = NDArray[np.uint8]


@dataclass(frozen=True, slots=True)
class Margins:
    """How far around the predicted bone is looked: in the picture, and in depth."""

    box_px: int
    band_mm: float


@dataclass(frozen=True, slots=True, eq=False)
class Measurement:
    """The surface in the bone's box, and how long it took."""

    disparity: DisparityMap
    cloud: SurfaceCloud
    timings: LineTimings


class SurfaceMeter:
    """Measures the surface of one bone under one rig."""

    def __init__(
        self,
        rig: StereoRig,
        model: RegistrationModel,
        depth_mm: tuple[float, float],
        max_points: int,
    ) -> None:
        self._rectifier = Rectifier(rig)
        self._model = model
        self._depth_mm = depth_mm
        self._max_points = max_points
        self._matcher = SgbmSettings()
        self.geometry = self._rectifier.geometry

    def rectified(self, left: Image, right: Image) -> tuple[RectifiedPair, LineTimings]:
        """Both pictures, grey and rectified."""
        started = time.perf_counter_ns()
        pair = self._rectifier.rectify(_luma(left), _luma(right))
        return pair, LineTimings(rectify_ms=_ms_since(started))

    def freely(
        self, pair: RectifiedPair, pose: RigidTransform, margins: Margins, *, fills: bool = True
    ) -> Measurement | None:
        """Block matching in the box and depth band around a pose; None out of view.

        It sees whatever is there, also where the bone is not.
        """
        region = self._region(pose, margins)
        if region is None:
            return None
        box, band_px = region
        started = time.perf_counter_ns()
        matched = match_sgbm(replace(pair, box=box), band_px, self._matcher)
        timings = LineTimings(stereo_ms=_ms_since(started))
        started = time.perf_counter_ns()
        filled = fill_occlusions(matched) if fills else matched
        return self._measurement(filled, replace(timings, fill_ms=_ms_since(started)))

    def on_model(
        self, pair: RectifiedPair, pose: RigidTransform, margins: Margins
    ) -> Measurement | None:
        """Sub-pixel matching on the model's own surface at a pose; None out of view.

        Exact, but only where the surface lies within 1 to 2 px of the model's: elsewhere it answers
        nothing.
        """
        region = self._region(pose, margins)
        if region is None:
            return None
        started = time.perf_counter_ns()
        view = render_rectified(self._model.seen_mesh, pose, self.geometry, region[0])
        scale = self.geometry.focal_px * self.geometry.baseline_mm
        support_px = (scale / view.depth_mm).astype(np.float32)
        matched = refine(replace(pair, box=region[0]), support_px)
        return self._measurement(matched, LineTimings(stereo_ms=_ms_since(started)))

    def _measurement(self, disparity: DisparityMap, timings: LineTimings) -> Measurement:
        n_matched = disparity.matched_share * disparity.origin.size
        stride_px = max(1, round((n_matched / self._max_points) ** 0.5))
        return Measurement(disparity, reproject(disparity, self.geometry, stride_px), timings)

    def _region(
        self, pose: RigidTransform, margins: Margins
    ) -> tuple[Box, tuple[float, float]] | None:
        """Box and disparity band around the model at a pose; None out of view or out of depth."""
        box = projected_box(self._model.bone.mesh, pose, self.geometry)
        if box is None:
            return None
        depths = pose.apply(self._model.points_mm)[:, 2]
        near = max(float(depths.min()) - margins.band_mm, self._depth_mm[0])
        far = min(float(depths.max()) + margins.band_mm, self._depth_mm[1])
        if near >= far:
            return None
        grown = box.grown(margins.box_px).clipped(self.geometry.width, self.geometry.height)
        return grown, (self.geometry.disparity_px(far), self.geometry.disparity_px(near))


def _luma(image: Image) -> Image:
    """Grey picture: colour adds cost and, with JPEG, halved chroma, but no disparity."""
    import cv2

    if image.ndim == 2:
        return image
    return np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), dtype=np.uint8)


def _ms_since(started_ns: int) -> float:
    return (time.perf_counter_ns() - started_ns) / 1e6
