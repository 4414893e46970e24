"""The trackers of a session's bones: made when they are needed, shared by loop and worker."""

import threading
from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from drivers.frames import StereoFrame
from navapp.face_tracking import FaceTracker
from navapp.geometry.rig import StereoRig
from navapp.geometry.transform import FloatArray
from navapp.preop import build_aspects
from navapp.resection import CutBone, FaceMeter, HoleMeter
from navapp.tracking import Goal, Tracker, TrackerSettings, make_tracker
from navapp.values import (
    AspectGraph,
    BoneModel,
    MeasuredFace,
    MeasuredHole,
    Plan,
    PoseEstimate,
    Prior,
    Reason,
    StageSpec,
    Status,
    TrackedFrame,
)
from navapp.values.progress import Progress

# What is said of a bone that was found, but of which too little is matched.
_LOOSE = frozenset({Reason.COVERAGE_LOW, Reason.POSE_UNCERTAIN})

# Makes the tracker of one bone; the aspects are None where no search needs them.
MakeTracker = Callable[[StereoRig, BoneModel, TrackerSettings, AspectGraph | None], Tracker]


class Trackers:
    """One tracker for each bone; usable from several threads.

    A search without a start pose needs the aspects of its bone. They take seconds to build, so they
    are built at the first such search, and the bone's tracker is replaced by one that has them.
    Trackers are made outside of the lock: no thread waits for what another one makes.

    Args:
        rig: of the pictures.
        plan: with the bones' models and the targets.
        prior: where the bones may be before a first registration.
        settings: of all trackers.
        make_tracker: makes one.
    """

    def __init__(
        self,
        rig: StereoRig,
        plan: Plan,
        prior: Prior,
        settings: TrackerSettings,
        make_tracker: MakeTracker = make_tracker,
    ) -> None:
        self._rig, self._plan, self._prior, self._settings = rig, plan, prior, settings
        self._make_tracker = make_tracker
        # By bone: where an operator has said that it is, instead of the prior.
        self._starts: dict[str, Prior] = {}
        self._lock = threading.Lock()
        self._bones = {name: CutBone(bone) for name, bone in plan.bones.items()}
        # By name and version of the bone: what is made of an old one is never used for a new one.
        self._trackers: dict[tuple[str, int], Tracker] = {}
        self._with_aspects: dict[tuple[str, int], Tracker] = {}
        self._face_meters: dict[str, FaceMeter] = {}
        self._hole_meters: dict[str, HoleMeter] = {}

    def set_start(self, bone: str, start: Prior) -> None:
        """From now on a bone is searched for where an operator has said that it is.

        An empty start: from the prior again. The prior's approach cone stays: it tells from which
        side the patient is seen.
        """
        with self._lock:
            if start.is_empty:
                self._starts.pop(bone, None)
            else:
                self._starts[bone] = self._prior.replaced_by(start)

    def start(self, bone: str) -> Prior:
        """Where a bone is searched for."""
        with self._lock:
            return self._starts.get(bone, self._prior)

    def tracker(self, bone: str) -> Tracker:
        """The tracker that follows a bone."""
        with self._lock:
            now = self._bones[bone]
            key = bone, now.version
            known = self._with_aspects.get(key) or self._trackers.get(key)
        if known is not None:
            return known
        # The production chain needs no views to follow a bone; those of the paper do.
        is_ours = self._settings.method == "bimcc"
        aspects = None if is_ours else self._plan.aspects.get(bone)
        made = self._make(now, aspects)
        with self._lock:
            return self._with_aspects.get(key) or self._trackers.setdefault(key, made)

    def bone(self, name: str) -> CutBone:
        """A bone as it is now."""
        with self._lock:
            return self._bones[name]

    @property
    def bones(self) -> Mapping[str, CutBone]:
        """All of them as they are now."""
        with self._lock:
            return dict(self._bones)

    def set_bone(self, bone: CutBone) -> None:
        """From now on a bone is another one: its tracker is made anew."""
        name = bone.planned.name
        with self._lock:
            self._bones[name] = bone
            for made in (self._trackers, self._with_aspects):
                for key in [key for key in made if key[0] == name]:
                    del made[key]

    def measure_face(
        self, frame: StereoFrame, bone: CutBone, estimate: PoseEstimate, name: str
    ) -> MeasuredFace | None:
        """The face of a cut in a frame; None when it is not seen."""
        with self._lock:
            meter = self._face_meters.get(bone.planned.name)
        if meter is None:
            new = FaceMeter(self._rig, bone.planned)
            with self._lock:
                meter = self._face_meters.setdefault(bone.planned.name, new)
        known = bone.faces.get(name)
        expected = None if known is None else known.as_plane
        others = tuple(cut for other, cut in bone.known_cuts.items() if other != name)
        return meter.measure(
            frame.left, frame.right, estimate, bone.cuts[name], others, expected=expected
        )

    def measure_hole(
        self, frame: StereoFrame, bone: CutBone, estimate: PoseEstimate, name: str
    ) -> MeasuredHole | None:
        """The mouth of a hole in a frame; None when it is not seen."""
        with self._lock:
            meter = self._hole_meters.setdefault(
                bone.planned.name, HoleMeter(self._rig, bone.planned)
            )
        return meter.measure(frame.left, frame.right, estimate, bone.holes[name])

    def corners_mm(self, bone: str) -> FloatArray:
        """(8, 3) of the box around a bone's model."""
        vertices = self._plan.bones[bone].mesh.vertices_mm
        ends = np.stack([vertices.min(axis=0), vertices.max(axis=0)])
        which = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)])
        corners: FloatArray = ends[which, np.arange(3)]
        return corners

    @property
    def row_delay_ns(self) -> int:
        """Of the rig: each row is exposed later by this than the row above it."""
        return self._rig.row_delay_ns

    @property
    def follows_refused(self) -> bool:
        """Whether poses that the judge refuses are carried on."""
        return self._settings.follows_refused

    def goal(self, stage: StageSpec) -> Goal:
        """What the poses of a stage's bone are judged by."""
        return Goal(self._plan.targets_of(stage.targets), stage.tolerance_mm)

    def register(
        self,
        stage: StageSpec,
        frame: StereoFrame,
        on_progress: Progress = lambda share: None,
    ) -> list[TrackedFrame]:
        """Search for a stage's bone in a frame; best answer first, empty without any start."""
        start, goal = self.start(stage.bone), self.goal(stage)
        tracker, bone = self._searching_tracker(stage.bone, start), self.bone(stage.bone)
        answers = tracker.register(frame, start, goal, on_progress)
        return self._look_closer(stage, bone, frame, answers)

    def _look_closer(
        self, stage: StageSpec, bone: CutBone, frame: StereoFrame, answers: list[TrackedFrame]
    ) -> list[TrackedFrame]:
        """The same answers, or a better first one of a cut bone that was found, but too loosely.

        Where its faces are, relative to the cameras, the same picture tells, whatever the error of
        the pose: then less of the bone beside them is unsure, and more of it is matched. The faces
        themselves fix nothing.
        """
        if not bone.unmeasured or not answers or answers[0].estimate is None:
            return answers
        best, estimate = answers[0], answers[0].estimate
        if best.verdict.status is not Status.DEGRADED or not _LOOSE.issuperset(
            best.verdict.reasons
        ):
            return answers
        faces = {
            name: face
            for name in bone.unmeasured
            if (face := self._face_beside(frame, bone, estimate, name)) is not None and face.is_told
        }
        if not faces:
            return answers
        tracker = self._make(bone.with_faces(faces), None)
        prior = Prior({stage.bone: estimate.camera_from_bone})
        closer = tracker.register(frame, prior, self.goal(stage))
        is_better = bool(closer) and closer[0].verdict.rank < best.verdict.rank
        return [closer[0], *answers[1:]] if is_better else answers

    def _face_beside(
        self, frame: StereoFrame, bone: CutBone, estimate: PoseEstimate, name: str
    ) -> MeasuredFace | None:
        """A face relative to a pose, whatever the pose's own error."""
        exact = replace(estimate, covariance=np.zeros((6, 6)))
        return self.measure_face(frame, bone, exact, name)

    def _searching_tracker(self, bone: str, start: Prior) -> Tracker:
        """The bone's tracker, with aspects when there is no pose to start from."""
        cone = start.cones.get(bone)
        # A face is found from a pose alone.
        is_by_face = self._is_tracked_by_face(self.bone(bone))
        if is_by_face or bone in start.left_from_bone or cone is None or cone.axis is None:
            return self.tracker(bone)
        with self._lock:
            now = self._bones[bone]
            key = bone, now.version
            known = self._with_aspects.get(key)
        if known is not None:
            return known
        built = self._plan.aspects.get(bone)
        # What was built beforehand has the edges of the whole bone.
        if built is None or now.made:
            aspects = build_aspects(now.model, cone.axis, cone.half_angle_deg)
        else:
            aspects = built.within(cone)
        made = self._make(now, aspects)
        with self._lock:
            self._trackers.pop(key, None)
            return self._with_aspects.setdefault(key, made)

    def _make(self, bone: CutBone, aspects: AspectGraph | None) -> Tracker:
        if self._is_tracked_by_face(bone):
            return FaceTracker(self._rig, bone, self._settings)
        # Other methods do not count a caliper's errors: they track what is left beside the cut.
        bone = replace(bone, caliper_faces={}) if bone.caliper_faces else bone
        return self._make_tracker(self._rig, bone.model, self._settings, aspects)

    def _is_tracked_by_face(self, bone: CutBone) -> bool:
        return bool(bone.caliper_faces) and self._settings.method == "bimcc"
