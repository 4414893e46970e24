"""Tracks a bone by its face."""

from collections.abc import Iterable
from dataclasses import replace

from navapp.face_tracking.face_outline import FaceOutline
from navapp.face_tracking.face_plane import face_twists
from navapp.face_tracking.face_search import FaceSearch
from navapp.geometry.rig import StereoRig
from navapp.geometry.zbuffer import RenderedView
from navapp.registration.verdict import Agreement, Goal
from navapp.resection import CutBone, FaceMeter
from navapp.tracking.checks import PairCheck
from navapp.tracking.frame import Fit, Frame, ignore
from navapp.tracking.judging import PoseJudge
from navapp.tracking.motion import TrackState
from navapp.tracking.settings import TrackerSettings
from navapp.tracking.surface_meter import SurfaceMeter
from navapp.tracking.tracker import Tracker
from navapp.values import MeasuredFace, Prior, Reason, StereoPictures, Stopwatch, TrackedFrame
from navapp.values.progress import Progress


class FaceJudge(PoseJudge):
    """Judges poses of a bone that is known by its face: never better than the face is known."""

    def __init__(self, meter: SurfaceMeter, settings: TrackerSettings, face: MeasuredFace) -> None:
        super().__init__(meter, settings)
        self.outline = FaceOutline(meter.model, meter.geometry, face)
        self._face = face

    def _settle(
        self, frame: Frame, fit: Fit, check: PairCheck, counts_unmeasured: bool
    ) -> tuple[Fit, RenderedView | None, Agreement | None]:
        """As of any judge, with the face's own error in the covariance."""
        fit, view, agreement = super()._settle(frame, fit, check, counts_unmeasured)
        fixed, _ = face_twists(self._face, fit.pose, self._meter.model.centre_mm)
        covariance = fit.estimate.covariance + fixed @ self._face.covariance @ fixed.T
        estimate = replace(fit.estimate, covariance=covariance)
        return replace(fit, estimate=estimate), view, agreement


class FaceTracker(Tracker):
    """Tracks a bone of which a known face is seen, from a pose that is near.

    It does not search: a bone that moved further than from frame to frame is lost.

    Args:
        rig: of the pictures.
        bone: with a face that a caliper told (`CutBone.caliper_faces`).
        settings: of the tracker.
    """

    def __init__(
        self, rig: StereoRig, bone: CutBone, settings: TrackerSettings | None = None
    ) -> None:
        super().__init__(rig, bone.model, settings)
        face = bone.model.face
        if face is None:
            raise ValueError(f"the {bone.planned.name} has no known face")
        self.tells_foreground = "fill" not in self.settings.leaves_out
        self.judge = FaceJudge(self.meter, self.settings, face)
        others = [cut for name, cut in bone.known_cuts.items() if name not in bone.caliper_faces]
        self._search = FaceSearch(
            self.meter, self.judge.outline, face, FaceMeter(rig, bone.planned), others,
            has_part=bool(bone.parts),
        )  # fmt: skip

    def track(
        self, pictures: StereoPictures, state: TrackState, goal: Goal
    ) -> tuple[TrackedFrame, TrackState]:
        """Follow the bone into the next frame."""
        frame = self.begin_predicted(pictures, state)
        best = self.look_near(frame, goal)
        if state.n_lost == 0:
            best = self.follow_closer(frame, best, lambda again: self.look_near(again, goal))
        return self.update(best.with_cause(self.find_cause(frame, state, best)), state, frame)

    def find_for_glance(self, frame: Frame) -> Iterable[Fit | None]:
        """Where plane and outline rest next to the start."""
        fit = self._search.find(frame)
        return () if fit is None else (fit,)

    def register(
        self, pictures: StereoPictures, prior: Prior, goal: Goal, on_progress: Progress = ignore
    ) -> list[TrackedFrame]:
        """The bone next to the prior's pose of it; lost without one."""
        start = prior.left_from_bone.get(self.model.bone.name)
        if start is None:
            return [self.judge.lost(Reason.BONE_LOST, Stopwatch())]
        return [self.look_near(self.begin(pictures, start), goal)]
