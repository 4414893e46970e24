"""The steps of a session: cuts, holes and parts that are made; cuts and holes are measured."""

from collections import Counter, deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from drivers.frames import StereoFrame
from navapp.control.rest_watch import RestWatch
from navapp.control.states import StepLine
from navapp.control.trackers import Trackers
from navapp.errors import UsageError
from navapp.geometry.mesh import TriangleMesh
from navapp.resection import (
    CaliperPoint,
    CutBone,
    Thickness,
    find_face,
    list_caliper_points,
    measure_thickness,
    needs_caliper,
)
from navapp.values import (
    BoneModel,
    Measured,
    MeasuredFace,
    Plan,
    PlannedStep,
    PoseEstimate,
    ResectionPlane,
    StageSpec,
    Status,
    TrackedFrame,
    join_measured,
    kind_of,
)

# All chosen. So many measurements of a face make it known; the newest so many are kept.
_ENOUGH, _KEPT = 3, 60


@dataclass
class _Known:
    """What is known of a step that is made."""

    measured: deque[Measured] = field(default_factory=lambda: deque(maxlen=_KEPT))
    joined: Measured | None = None  # what all of them say together
    seen_share: float | None = None  # of face or rim, in the newest look
    last: Measured | None = None  # as of `StepLine.last_measured`
    thickness: Thickness | None = None
    remaining_mm: tuple[float, ...] = ()  # as a caliper read it

    def add(self, one: Measured, bone: BoneModel) -> None:
        """One more measurement of it."""
        self.measured.append(one)
        self.joined = self.last = join_measured(tuple(self.measured))
        if isinstance(self.joined, MeasuredFace):
            self.thickness = measure_thickness(bone, self.joined)


class MadeSteps:
    """What has been made of the session's bones; started and asked from the loop alone.

    Cuts and holes are measured in turns that are counted in frames, one in each: a recorded session
    replays to them.

    Args:
        plan: with the steps.
        trackers: of its bones.
        made: names of steps that are made from the start.
        frames_between: one is measured in every so many frames; with 1, all in each.

    Raises:
        UsageError: the plan has no such step.
    """

    def __init__(
        self, plan: Plan, trackers: Trackers, made: Sequence[str] = (), frames_between: int = 1
    ) -> None:
        self._plan, self._trackers = plan, trackers
        self._frames_between = frames_between
        self._n_frames = 0
        self._known: dict[str, _Known] = {}
        self._n_made: Counter[str] = Counter()
        self._rest_watches: dict[str, RestWatch] = {}  # by bone
        self._caliper_points = {
            name: _find_caliper_points(plan.bones[step.bone], step)
            for name, step in plan.content.steps.items()
            if step.bone in plan.bones and needs_caliper(step)
        }
        for name in made:
            self.confirm(name)

    def confirm(self, name: str) -> CutBone:
        """A planned step has been made: its bone as it is now.

        Raises:
            UsageError: the plan has no such step or no model of its bone, or it is confirmed.
        """
        step = self._plan.content.steps.get(name)
        if step is None:
            names = ", ".join(self._plan.content.steps)
            remedy = f"choose of {names}" if names else "make the plan with --contents"
            raise UsageError(f"the plan has no step '{name}'", subject=name, remedy=remedy)
        if step.bone not in self._plan.bones:
            raise UsageError(
                f"the plan has no model of the {step.bone}, on which '{name}' is made",
                subject=name,
                remedy="make the plan with that bone",
            )
        known = self._trackers.bone(step.bone)
        if name in known.made:
            raise UsageError(f"'{name}' is confirmed already", subject=name)
        self._known[name] = _Known()
        self._n_made[name] += 1
        bone = known.make(name, step)
        self._trackers.set_bone(bone)
        return bone

    def withdraw(self, name: str) -> CutBone:
        """A step has not been made after all.

        Raises:
            UsageError: it was not said to be made.
        """
        step = self._plan.content.steps.get(name)
        bones = self._trackers.bones
        if step is None or step.bone not in bones or name not in bones[step.bone].made:
            raise UsageError(f"'{name}' was not confirmed", subject=name)
        del self._known[name]
        bone = self._trackers.bone(step.bone).restore(name)
        self._trackers.set_bone(bone)
        return bone

    def read_thickness(self, name: str, thickness_mm: Sequence[float]) -> CutBone:
        """The thickness below a cut was read with a caliper: its bone, followed by that face.

        Raises:
            UsageError: no such cut is made, its bone is followed by more than a face, or the
                readings do not tell one (`find_face`).
        """
        step = self._plan.content.steps.get(name)
        bones = self._trackers.bones
        if step is None or step.bone not in bones or name not in bones[step.bone].cuts:
            raise UsageError(
                f"'{name}' is no cut that was confirmed", subject=name, remedy="confirm it first"
            )
        if not needs_caliper(step):
            raise UsageError(
                f"the {step.bone} is followed by its surface, whatever is left below '{name}'",
                subject=name,
                remedy="read no thickness of it",
            )
        known = bones[step.bone]
        face = find_face(known.planned, known.cuts[name], thickness_mm)
        bone = known.with_caliper_face(name, face)
        self._trackers.set_bone(bone)
        # No picture has measured it: what its step tells is the thickness alone.
        told = self._known[name]
        told.thickness = measure_thickness(known.planned, face)
        told.remaining_mm = tuple(thickness_mm)
        return bone

    def forget_measured(self, bone: str) -> None:
        """What was measured with an earlier registration of a bone counts no longer."""
        bones = self._trackers.bones
        for name in bones[bone].made if bone in bones else ():
            if name not in bones[bone].caliper_faces:
                self._known[name] = _Known(last=self._known[name].last)
        if bone in bones and bones[bone].faces:
            self._trackers.set_bone(bones[bone].without_faces())

    def version(self, bone: str) -> int:
        """Of a bone; 0 without a model of it."""
        known = self._trackers.bones.get(bone)
        return 0 if known is None else known.version

    def surface(self, bone: str) -> TriangleMesh | None:
        """What is left of a bone; None: all of it, or it has no model."""
        known = self._trackers.bones.get(bone)
        return None if known is None else known.surface

    def describe(self, stage: StageSpec) -> tuple[StepLine, ...]:
        """The steps of a stage: planned, made, measured."""
        bone = self._trackers.bones.get(stage.bone)
        made = {} if bone is None else bone.made
        return tuple(
            self._describe(name, step, is_made=name in made)
            for name, step in self._plan.steps_of(stage).items()
        )

    def _describe(self, name: str, step: PlannedStep, *, is_made: bool) -> StepLine:
        known = self._known.get(name, _Known())
        caliper_points, caliper_refusal = self._caliper_points.get(name, ((), ""))
        return StepLine(
            name,
            kind_of(step),
            is_made,
            known.joined,
            known.seen_share,
            self._n_made[name],
            known.last,
            known.thickness,
            caliper_points,
            caliper_refusal,
            known.remaining_mm,
        )

    def measure(
        self, frame: StereoFrame, tracked: TrackedFrame | None, *, is_accepted: bool
    ) -> dict[str, Measured]:
        """Faces and holes of a bone in a frame in which its pose is OK: one in its turn, or all.

        With a pose that nobody has accepted they are told, where every frame tells what it can, but
        not kept. None are in frames that are not exposed at once while the bone moves.
        """
        turn, rest = divmod(self._n_frames, self._frames_between)
        self._n_frames += 1
        if tracked is None or tracked.estimate is None or tracked.verdict.status is not Status.OK:
            return {}
        watch = self._rest_watch(tracked.bone)
        if not watch.is_at_rest(frame, tracked.estimate.camera_from_bone) or rest:
            return {}
        bone, is_each = self._trackers.bone(tracked.bone), self._frames_between == 1
        # A part covers the faces that it sits on.
        measurable = (name for name in bone.cuts if name not in bone.caliper_faces)
        names = () if bone.parts else (*measurable, *bone.whole_holes)
        if names and not is_each:
            names = (names[turn % len(names)],)
        if not (is_accepted or is_each):
            return {}
        looked = {name: self._look(frame, bone, tracked.estimate, name) for name in names}
        found = {name: one for name, one in looked.items() if one is not None and one.is_told}
        if is_accepted:
            self._keep(bone, looked, found)
        return found

    def _rest_watch(self, bone: str) -> RestWatch:
        if bone not in self._rest_watches:
            corners_mm = self._trackers.corners_mm(bone)
            self._rest_watches[bone] = RestWatch(corners_mm, self._trackers.row_delay_ns)
        return self._rest_watches[bone]

    def _look(
        self, frame: StereoFrame, bone: CutBone, estimate: PoseEstimate, name: str
    ) -> Measured | None:
        if name in bone.holes:
            return self._trackers.measure_hole(frame, bone, estimate, name)
        return self._trackers.measure_face(frame, bone, estimate, name)

    def _keep(
        self, bone: CutBone, looked: Mapping[str, Measured | None], found: Mapping[str, Measured]
    ) -> None:
        for name, one in looked.items():
            self._known[name].seen_share = None if one is None else one.seen_share
        for name, told in found.items():
            self._known[name].add(told, bone.planned)
        self._learn(bone)

    def _learn(self, bone: CutBone) -> None:
        """Where faces have become known, less of the bone beside them is unsure."""
        known = {
            name: face
            for name in bone.unmeasured
            if len(self._known[name].measured) >= _ENOUGH
            and isinstance(face := self._known[name].joined, MeasuredFace)
        }
        if known:
            self._trackers.set_bone(bone.with_faces(known))


def _find_caliper_points(
    bone: BoneModel, cut: ResectionPlane
) -> tuple[tuple[CaliperPoint, ...], str]:
    """Where a caliper is read below a cut, or why the plan allows no reading."""
    try:
        return list_caliper_points(bone, cut), ""
    except UsageError as error:
        return (), str(error)
