"""The paper's state of the art as a tracker: box, best view, gradient matching, ICP, contour.

Source: the paper, section 3.1, figure 1 and algorithm 1. It is there to be compared with: our judge
accepts hardly any of its poses.
"""

from collections.abc import Iterable
from contextlib import nullcontext
from dataclasses import replace

from navapp.geometry.rig import StereoRig
from navapp.geometry.transform import RigidTransform
from navapp.registration import solution_at, solve_icp
from navapp.registration.best_view import find_best_view
from navapp.registration.verdict import Goal
from navapp.stereo import match_baseline
from navapp.tracking.frame import Fit, Frame, ignore
from navapp.tracking.motion import TrackState
from navapp.tracking.row_times import RowTimes
from navapp.tracking.settings import TrackerSettings
from navapp.tracking.surface_meter import (
    NEAR_BOX,
    NEAR_VIEW,
    WIDE_BOX,
    WIDE_VIEW,
    Margins,
    Measurement,
)
from navapp.tracking.tracker import Tracker
from navapp.values import (
    AspectGraph,
    BoneModel,
    PoseEstimate,
    Prior,
    Reason,
    StereoPictures,
    Stopwatch,
    TrackedFrame,
)
from navapp.values.progress import Progress

# With 20,000 points the error from a true pose is the same within a tenth:
# `python -m tests.bench.paper_points`.
N_POINTS = 3000


class IcpTracker(Tracker):
    """Finds one bone from a pose, and follows it by its box: one fit in every frame.

    Without `aspects` the expected pose stands for the best view. About `n_points` of what
    is matched are paired.

    Attributes:
        fills_occlusions: before the Gaussian filter.
        n_among: the model's points are paired among so many scene points at most, or among
            `n_points` if that is more.
    """

    fills_occlusions = False
    n_among = 0

    def __init__(
        self,
        rig: StereoRig,
        bone: BoneModel,
        settings: TrackerSettings | None = None,
        aspects: AspectGraph | None = None,
        n_points: int = N_POINTS,
    ) -> None:
        super().__init__(rig, bone, settings)
        self._aspects, self.n_points = aspects, n_points

    def track(
        self, pictures: StereoPictures, state: TrackState, goal: Goal
    ) -> tuple[TrackedFrame, TrackState]:
        """Follow the bone's box into the next frame, and fit in it (section 3.1)."""
        watch, is_near = Stopwatch(), state.n_lost == 0
        left_from_bone = state.predict(pictures.captured_ns, self.model.centre_mm)
        # The box comes from the pictures, and the start from the box.
        box = self.boxes.follow(state.box, pictures.left, state.left_from_bone)
        expected = self.boxes.starts(left_from_bone, box)[0]
        times = RowTimes.of_pair(self.meter, state, pictures)
        view, margins = (NEAR_VIEW, NEAR_BOX) if is_near else (WIDE_VIEW, WIDE_BOX)
        predicted = self.rectify_pose(left_from_bone)
        frame = self.begin(pictures, expected, view, watch, times, predicted)
        with self.begin_checks(frame) if is_near else nullcontext() as checks:
            fits = [self.find_fit(frame, margins)]
            best = self.judge_fits(replace(frame, checks=checks), fits, goal)
        best = best.with_cause(self.find_cause(frame, state, best))
        return self.update(best, replace(state, box=box), frame)

    def find_fit(self, frame: Frame, margins: Margins) -> Fit | None:
        """The fit around the start; None out of view."""
        # The best view near it.                      equations (2), (3) of section 3.1
        start = self._find_view(frame)
        # Its surface.                                equations (2), (3) of algorithm 1
        measured = self.measure(frame, start, margins)
        if measured is None:
            return None
        # The pose, and the pose on the contour.      equations (1), (4) of section 3.1
        estimate = self.estimate(frame, measured, start)
        frame.watch.lap("estimate")
        return Fit(estimate, measured)

    def _find_view(self, frame: Frame) -> RigidTransform:
        """The pose of the best view."""
        region = self.meter.find_region(frame.start, NEAR_BOX)
        if self._aspects is None or region is None:
            return frame.start
        pair = replace(frame.pair, box=region[0])
        view = find_best_view(pair, self.model, self._aspects, frame.start)
        frame.watch.lap("estimate")
        return view

    def measure(self, frame: Frame, start: RigidTransform, margins: Margins) -> Measurement | None:
        """What is matched around a pose: sum of gradients, left-right check, Gaussian filter."""
        region = self.meter.find_region(start, margins)
        if region is None:
            return None
        box, band_px = region
        answer = match_baseline(replace(frame.pair, box=box), band_px, fills=self.fills_occlusions)
        frame.watch.add(answer.timings)
        return self.meter.take_surface(answer.disparity, max(self.n_points, self.n_among))

    def estimate(self, frame: Frame, measured: Measurement, start: RigidTransform) -> PoseEstimate:
        """The pose by ICP, refined on the contour."""
        found = solve_icp(measured.scene, self.model, start, self.n_points).estimate
        pose = self.judge.outline.refine(frame.pair, found.camera_from_bone, measured.disparity)
        refined = solution_at(measured.scene, self.model, pose).estimate
        reasons = tuple(dict.fromkeys((*found.reasons, *refined.reasons)))
        return replace(refined, iterations=found.iterations, reasons=reasons)

    def find_for_glance(self, frame: Frame) -> Iterable[Fit | None]:
        """The one fit around the start."""
        return [self.find_fit(frame, NEAR_BOX)]

    def register(
        self, pictures: StereoPictures, prior: Prior, goal: Goal, on_progress: Progress = ignore
    ) -> list[TrackedFrame]:
        """The one fit that a rough pose leads to; nothing without a pose."""
        start = prior.left_from_bone.get(self.model.bone.name)
        if start is None:
            return []
        frame = self.begin(pictures, start)
        fit = self.find_fit(frame, WIDE_BOX)
        if fit is None or len(fit.measured.cloud) == 0:
            return [self.judge.lost(Reason.NO_SURFACE, frame.watch)]
        return [self.judge.judge(frame, fit, goal)]
