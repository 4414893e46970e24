"""The trackers of a session's bones: made when they are needed, shared by loop and worker."""

import threading
from collections.abc import Callable

import numpy as np

from drivers.frames import StereoFrame
from navapp.geometry.directions import ViewCone
from navapp.geometry.rig import StereoRig
from navapp.geometry.transform import FloatArray
from navapp.preop import build_aspects
from navapp.tracking import Goal, Tracker, TrackerSettings, make_tracker
from navapp.values import AspectGraph, BoneModel, Plan, Prior, StageSpec, TrackedFrame

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
        self._lock = threading.Lock()
        self._trackers: dict[str, Tracker] = {}
        self._with_aspects: dict[str, Tracker] = {}

    def tracker(self, bone: str) -> Tracker:
        """The tracker that follows a bone."""
        with self._lock:
            known = self._with_aspects.get(bone) or self._trackers.get(bone)
        if known is not None:
            return known
        # The production chain needs no views to follow a bone; those of the paper do.
        is_ours = self._settings.method == "bimcc"
        made = self._make(bone, None if is_ours else self._plan.aspects.get(bone))
        with self._lock:
            return self._with_aspects.get(bone) or self._trackers.setdefault(bone, made)

    def corners_mm(self, bone: str) -> FloatArray:
        """(8, 3) of the box around a bone's model."""
        vertices = self._plan.bones[bone].mesh.vertices_mm
        ends = np.stack([vertices.min(axis=0), vertices.max(axis=0)])
        which = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)])
        corners: FloatArray = ends[which, np.arange(3)]
        return corners

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
        on_progress: Callable[[float], None] = lambda share: None,
    ) -> list[TrackedFrame]:
        """Search for a stage's bone in a frame, from the prior; best answer first, may be empty."""
        tracker, goal = self._searching_tracker(stage.bone), self.goal(stage)
        return tracker.register(frame.left, frame.right, self._prior, goal, on_progress)

    def _searching_tracker(self, bone: str) -> Tracker:
        """The bone's tracker, with aspects when there is no pose to start from."""
        axis = self._prior.axis_for(bone)
        if bone in self._prior.left_from_bone or axis is None:
            return self.tracker(bone)
        with self._lock:
            known = self._with_aspects.get(bone)
        if known is not None:
            return known
        half_angle_deg, built = self._prior.approach_half_angle_deg, self._plan.aspects.get(bone)
        if built is None:
            aspects = build_aspects(self._plan.bones[bone], axis, half_angle_deg)
        else:
            aspects = built.within(ViewCone(axis, half_angle_deg))
        made = self._make(bone, aspects)
        with self._lock:
            self._trackers.pop(bone, None)
            return self._with_aspects.setdefault(bone, made)

    def _make(self, bone: str, aspects: AspectGraph | None) -> Tracker:
        return self._make_tracker(self._rig, self._plan.bones[bone], self._settings, aspects)
