"""The line: one stereo frame in, one judged pose out.

`Line.track` is the frame's whole way in the paper's order. No step knows a device, a thread or the
terminal; what is remembered between frames is handed in and out as a `TrackState`.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.rectification import Box, Rectifier
from navapp.geometry.rig import StereoRig
from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.geometry.zbuffer import projected_box
from navapp.registration import (
    PointToPlaneSettings,
    RegistrationModel,
    distinct,
    find_candidates,
    fit_icp,
    fit_point_to_plane,
    tilted_starts,
)
from navapp.registration.point_to_plane import estimate_at
from navapp.stereo import SgbmSettings, fill_occlusions, match_sgbm, reproject
from navapp.tracking.judge import Goal, Judge
from navapp.tracking.motion import TrackState
from navapp.values import (
    BoneModel,
    DisparityMap,
    LineTimings,
    PoseEstimate,
    Prior,
    Reason,
    Status,
    SurfaceCloud,
    TrackedFrame,
    Verdict,
)

Image = NDArray[np.uint8]
Method = Literal["bimcc", "icp"]


@dataclass(frozen=True, slots=True)
class Margins:
    """How far around the predicted bone is looked: in the picture, and in depth."""

    box_px: int
    band_mm: float


@dataclass(frozen=True, slots=True)
class LineSettings:
    """How the line works.

    Attributes:
        method: `icp` is the paper's baseline chain; anything else the production one.
        depth_mm: nearest and farthest surface that the rig is used for.
        tracking: margins from frame to frame.
        search: margins of a first registration, and after a loss.
        max_points: about so many measured points enter an estimate.
        tilt_deg: of the starts of a first registration.
        n_refined: so many of its answers are refined.
    """

    method: Method = "bimcc"
    depth_mm: tuple[float, float] = (300.0, 700.0)
    tracking: Margins = Margins(box_px=16, band_mm=15.0)
    search: Margins = Margins(box_px=60, band_mm=35.0)
    max_points: int = 2500
    tilt_deg: float = 15.0
    n_refined: int = 3


@dataclass(frozen=True, slots=True, eq=False)
class Measurement:
    """The surface in the bone's box, and how long it took."""

    disparity: DisparityMap
    cloud: SurfaceCloud
    timings: LineTimings


class Line:
    """The steps of one rig and one bone; holds only what is constant."""

    def __init__(
        self, rig: StereoRig, bone: BoneModel, settings: LineSettings | None = None
    ) -> None:
        self.settings = settings or LineSettings()
        self.rig = rig
        self.model = RegistrationModel(bone)
        self._rectifier = Rectifier(rig)
        self._geometry = self._rectifier.geometry
        is_accepted = rig.quality is None or rig.quality.is_accepted
        self._judge = Judge(self._geometry, is_accepted)
        self._matcher = SgbmSettings()
        self._wide = PointToPlaneSettings()
        self._near = PointToPlaneSettings(radii_mm=self._wide.radii_mm[1:])

    @property
    def centre_mm(self) -> FloatArray:
        """(3,) mean of the model's vertices, in bone coordinates."""
        return self.model.centre_mm

    def track(
        self, left: Image, right: Image, captured_ns: int, state: TrackState, goal: Goal
    ) -> tuple[TrackedFrame, TrackState]:
        """Follow the bone into the next frame (the paper's intra-operative loop)."""
        is_lost = state.n_lost > 0
        margins = self.settings.search if is_lost else self.settings.tracking
        predicted = self._rectified(state.predicted(captured_ns, self.centre_mm))
        measured = self._measure(left, right, predicted, margins)
        if measured is None:
            tracked = self._lost(Reason.OUT_OF_VIEW)
            return tracked, state.updated(tracked, captured_ns, self.centre_mm)
        started = time.perf_counter_ns()
        estimate = self._estimate(measured, predicted, self._wide if is_lost else self._near)
        timings = replace(measured.timings, estimate_ms=_ms_since(started))
        tracked = self._judged(estimate, measured.disparity, goal, timings, predicted)
        return tracked, state.updated(tracked, captured_ns, self.centre_mm)

    def register(
        self,
        left: Image,
        right: Image,
        prior: Prior,
        goal: Goal,
        on_progress: Callable[[float], None] = lambda share: None,
    ) -> list[TrackedFrame]:
        """Find the bone from a rough pose: distinct candidates, best first.

        Args:
            left: picture of the left camera.
            right: of the right one, at the same instant.
            prior: must hold a pose of this bone.
            goal: for the judge.
            on_progress: told the share done; what it raises stops the search.
        """
        start = prior.left_from_bone.get(self.model.bone.name)
        if start is None:
            return []
        rough = self._rectified(start)
        measured = self._measure(left, right, rough, self.settings.search)
        if measured is None or len(measured.cloud) == 0:
            return [self._lost(Reason.NO_SURFACE)]

        def score(estimate: PoseEstimate) -> float:
            found = self._judge.agreement(self.model, estimate.camera_from_bone, measured.disparity)
            return found.coverage * found.inlier_share

        starts = tilted_starts(rough, self.centre_mm, self.settings.tilt_deg)
        if self.settings.method == "icp":
            starts = [rough]
        coarse = find_candidates(measured.cloud, self.model, starts, score, on_progress)
        refined = [
            self._estimate(measured, estimate.camera_from_bone, self._wide)
            for estimate in coarse[: self.settings.n_refined]
        ]
        refined.sort(key=score, reverse=True)
        return [
            self._judged(estimate, measured.disparity, goal, measured.timings)
            for estimate in distinct(refined, self.centre_mm)
        ]

    def assess(
        self, left: Image, right: Image, left_from_bone: RigidTransform, goal: Goal
    ) -> TrackedFrame:
        """Judge a pose as it stands, without moving it."""
        pose = self._rectified(left_from_bone)
        measured = self._measure(left, right, pose, self.settings.tracking)
        if measured is None:
            return self._lost(Reason.OUT_OF_VIEW)
        estimate = estimate_at(
            measured.cloud, self.model, pose, settings=self._near
        )  # fmt: skip
        return self._judged(estimate, measured.disparity, goal, measured.timings)

    def _measure(
        self,
        left: Image,
        right: Image,
        rectified_from_bone: RigidTransform,
        margins: Margins,
    ) -> Measurement | None:
        """Rectify, match in the box and band around a pose, fill, reproject; None out of view."""
        region = self._region(rectified_from_bone, margins)
        if region is None:
            return None
        box, band_px = region
        t0 = time.perf_counter_ns()
        pair = self._rectifier.rectify(_luma(left), _luma(right), box)
        t1 = time.perf_counter_ns()
        matched = match_sgbm(pair, band_px, self._matcher)
        t2 = time.perf_counter_ns()
        filled = matched if self.settings.method == "icp" else fill_occlusions(matched)
        t3 = time.perf_counter_ns()
        n_matched = filled.matched_share * filled.origin.size
        stride_px = max(1, round((n_matched / self.settings.max_points) ** 0.5))
        cloud = reproject(filled, self._geometry, stride_px)
        timings = LineTimings(
            rectify_ms=(t1 - t0) / 1e6, stereo_ms=(t2 - t1) / 1e6, fill_ms=(t3 - t2) / 1e6
        )
        return Measurement(filled, cloud, timings)

    def _estimate(
        self, measured: Measurement, start: RigidTransform, settings: PointToPlaneSettings
    ) -> PoseEstimate:
        if self.settings.method == "icp":
            return fit_icp(measured.cloud, self.model, start)
        return fit_point_to_plane(measured.cloud, self.model, start, settings)

    def _judged(
        self,
        estimate: PoseEstimate,
        measured: DisparityMap,
        goal: Goal,
        timings: LineTimings,
        predicted: RigidTransform | None = None,
    ) -> TrackedFrame:
        """Judge, and hand the pose out in the unrectified left camera."""
        started = time.perf_counter_ns()
        verdict = self._judge.judge(self.model, estimate, measured, goal, predicted)
        timings = replace(timings, judge_ms=_ms_since(started))
        name = self.model.bone.name
        if verdict.predicted_tre_mm is None:
            return TrackedFrame(name, None, verdict, timings)
        return TrackedFrame(name, self._unrectified(estimate), verdict, timings)

    def _lost(self, reason: Reason) -> TrackedFrame:
        verdict = Verdict(Status.LOST, None, (reason,))
        return TrackedFrame(self.model.bone.name, None, verdict, LineTimings())

    def _region(
        self, pose: RigidTransform, margins: Margins
    ) -> tuple[Box, tuple[float, float]] | None:
        """Box and disparity band around the model at a pose; None out of view or out of depth."""
        box = projected_box(self.model.bone.mesh, pose, self._geometry)
        if box is None:
            return None
        depths = pose.apply(self.model.points_mm)[:, 2]
        near = max(float(depths.min()) - margins.band_mm, self.settings.depth_mm[0])
        far = min(float(depths.max()) + margins.band_mm, self.settings.depth_mm[1])
        if near >= far:
            return None
        grown = box.grown(margins.box_px).clipped(self._geometry.width, self._geometry.height)
        return grown, (self._geometry.disparity_px(far), self._geometry.disparity_px(near))

    def _rectified(self, left_from_bone: RigidTransform) -> RigidTransform:
        return self._geometry.rectified_from_left @ left_from_bone

    def _unrectified(self, estimate: PoseEstimate) -> PoseEstimate:
        """The same estimate in the left camera before rectification: a pure rotation."""
        left_from_rectified = self._geometry.rectified_from_left.inverse()
        turn = np.kron(np.eye(2), left_from_rectified.rotation)
        return replace(
            estimate,
            camera_from_bone=left_from_rectified @ estimate.camera_from_bone,
            covariance=turn @ estimate.covariance @ turn.T,
        )


def _luma(image: Image) -> Image:
    """Grey picture: colour adds cost and, with JPEG, halved chroma, but no disparity."""
    import cv2

    if image.ndim == 2:
        return image
    return np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), dtype=np.uint8)


def _ms_since(started_ns: int) -> float:
    return (time.perf_counter_ns() - started_ns) / 1e6
