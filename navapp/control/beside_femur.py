"""The tibia beside the femur: found from it, followed behind it, and measured against it."""

from dataclasses import dataclass
from functools import cached_property

from drivers.frames import StereoFrame
from navapp.control.executors import Executor, Job
from navapp.control.trackers import Trackers
from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.joint import KneeSearch, OccludedTracker
from navapp.limb import FEMUR, TIBIA, BoneSurface, Hinge, LimbMeasurement, LimbMeter
from navapp.tracking import Tracker
from navapp.tracking.bimcc_tracker import BimccTracker
from navapp.values import Plan, PoseEstimate, StageSpec, TrackedFrame
from navapp.values.progress import Progress


def may_start_from(bone: str, active: str) -> bool:
    """Whether a bone is found from the active one, without a start of its own."""
    return (bone, active) == (TIBIA, FEMUR)


@dataclass(frozen=True, slots=True, eq=False)
class FoundBone:
    """What a search beside the femur has found, and in which picture."""

    tracked: TrackedFrame
    captured_ns: int
    left_from_femur: RigidTransform  # in that picture
    track_number: int  # of that pose
    spread: FloatArray  # as the search tells it


class BesideFemur:
    """Knows the tibia by the femur; asked from the loop alone, searches run in an executor.

    Args:
        trackers: of the session's bones.
        plan: with their surfaces.
        executor: of the searches.
    """

    def __init__(self, trackers: Trackers, plan: Plan, executor: Executor) -> None:
        self._trackers, self._plan, self._executor = trackers, plan, executor
        self._job: Job[FoundBone] | None = None
        # Of the found pose that is followed; None before one.
        self._spread: FloatArray | None = None

    @cached_property
    def _search(self) -> KneeSearch | None:
        """None without both bones, or when the femur has no condyles."""
        if not {FEMUR, TIBIA} <= set(self._plan.bones):
            return None
        hinge = Hinge.of(self._plan.bones[FEMUR].mesh)
        return None if hinge is None else KneeSearch(hinge)

    @cached_property
    def _limb_meter(self) -> LimbMeter:
        return LimbMeter(self._plan)

    def can_find(self, bone: str, active: str) -> bool:
        """Whether a bone can be found from the active one."""
        is_ours = may_start_from(bone, active) and self._search is not None
        return is_ours and isinstance(self._trackers.tracker(bone), BimccTracker)

    def tracker(
        self, bone: str, left_from_femur: RigidTransform | None, *, is_found: bool
    ) -> Tracker:
        """Of a bone for one pair of pictures: behind the femur where its pose is known.

        One that was found from the femur keeps the spread of that search.
        """
        tracker = self._trackers.tracker(bone)
        if left_from_femur is None or not isinstance(tracker, BimccTracker):
            return tracker
        return self._hide(tracker, left_from_femur, self._spread if is_found else None)

    def keep(self, found: FoundBone) -> None:
        """That pose is followed from now on."""
        self._spread = found.spread

    def _hide(
        self,
        tracker: BimccTracker,
        left_from_femur: RigidTransform,
        spread: FloatArray | None,
    ) -> OccludedTracker:
        mesh = self._trackers.tracker(FEMUR).model.rendered_mesh
        return OccludedTracker(tracker, mesh, left_from_femur, spread)

    @property
    def is_searching(self) -> bool:
        """A search runs."""
        return self._job is not None

    def start(
        self,
        stage: StageSpec,
        frame: StereoFrame,
        left_from_femur: RigidTransform,
        track_number: int,
    ) -> None:
        """Search for a stage's bone, the tibia, in a frame in which the femur's pose is known.

        Raises:
            ValueError: it `can_find` no such bone.
        """
        tracker, search = self._trackers.tracker(stage.bone), self._search
        # Of the femur as it is now: a cut may be confirmed before the search begins.
        femur = self._trackers.tracker(FEMUR).model.rendered_mesh
        goal = self._trackers.goal(stage)
        if search is None or not isinstance(tracker, BimccTracker):
            raise ValueError(f"the {stage.bone} is not found from the femur")

        def look(on_progress: Progress) -> FoundBone:
            hidden = OccludedTracker(tracker, femur, left_from_femur)
            found = search.find(hidden, frame, left_from_femur, goal, on_progress)
            return FoundBone(
                found.tracked, frame.captured_ns, left_from_femur, track_number, found.spread
            )

        self._job = Job(look)
        self._executor.start(self._job)

    def take_due(self, sequence: int) -> FoundBone | None:
        """The result of the search, once, when it may be used in that frame.

        What the search has raised is raised here.
        """
        job = self._job
        if job is None or not self._executor.take_due(job, sequence):
            return None
        self._job = None
        if job.error is not None:
            raise job.error
        return job.result

    def cancel(self) -> None:
        """Stop the search, if one runs; its result is never used."""
        if self._job is not None:
            self._job.cancel()
            self._job = None

    def close(self) -> None:
        """End what runs."""
        self.cancel()
        self._executor.close()

    def measure_limb(self, femur: PoseEstimate, tibia: PoseEstimate) -> LimbMeasurement:
        """Of two poses of one pair of pictures."""
        surfaces = self._surface(FEMUR), self._surface(TIBIA)
        return self._limb_meter.measure(femur, tibia, surfaces)

    def _surface(self, name: str) -> BoneSurface:
        """What is left of a bone: known where it is whole, or every cut's face is measured."""
        bone = self._trackers.bone(name)
        mesh = bone.planned.mesh if bone.surface is None else bone.surface
        unknown = next((f"cut {cut} is not measured" for cut in bone.unmeasured), None)
        if bone.parts:
            unknown = f"a part lies on the {name}"
        return BoneSurface(mesh, bone.faces_bound_mm, unknown)
