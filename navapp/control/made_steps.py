"""The steps of a session: cuts, holes and parts that are made, and the faces of cuts measured."""

from collections import Counter, deque
from collections.abc import Mapping, Sequence

from drivers.frames import StereoFrame
from navapp.control.states import StepKind, StepLine
from navapp.control.trackers import Trackers
from navapp.errors import UsageError
from navapp.geometry.mesh import TriangleMesh
from navapp.resection import CutBone, Thickness, measure_thickness
from navapp.values import (
    DrillAxis,
    Measured,
    MeasuredFace,
    MeasuredHole,
    Plan,
    PlannedStep,
    PoseEstimate,
    ResectionPlane,
    StageSpec,
    Status,
    TrackedFrame,
    join_measured,
)

# All chosen. So many measurements of a face make it known; the newest so many are kept.
_ENOUGH, _KEPT = 3, 60


class MadeSteps:
    """What has been made of the session's bones; started and asked from the loop alone.

    Faces are measured in turns that are counted in frames, one in each: a recorded session replays
    to them.

    Args:
        plan: with the steps.
        trackers: of its bones.
        made: names of steps that are made from the start.
        frames_between: a face is measured in every so many frames; with 1, all in each.

    Raises:
        UsageError: the plan has no such step.
    """

    def __init__(
        self, plan: Plan, trackers: Trackers, made: Sequence[str] = (), frames_between: int = 1
    ) -> None:
        self._plan, self._trackers = plan, trackers
        self._frames_between = frames_between
        self._n_frames = 0
        self._measured: dict[str, deque[Measured]] = {}
        # What all measurements of a step say together, and how much of it was seen last.
        self._joined: dict[str, Measured] = {}
        self._seen: dict[str, float | None] = {}
        # As of `StepLine`.
        self._n_made: Counter[str] = Counter()
        self._last_faces: dict[str, MeasuredFace] = {}
        self._thicknesses: dict[str, Thickness | None] = {}
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
        self._forget(name)
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
        self._forget(name)
        self._last_faces.pop(name, None)
        bone = self._trackers.bone(step.bone).restore(name)
        self._trackers.set_bone(bone)
        return bone

    def forget_faces(self, bone: str) -> None:
        """What was measured with an earlier registration of a bone counts no longer."""
        known = self._trackers.bones.get(bone)
        if known is None or not any(name in self._seen for name in known.made):
            return
        for name in known.made:
            self._forget(name)
        if known.faces:
            self._trackers.set_bone(known.without_faces())

    def _forget(self, name: str) -> None:
        for known in (self._measured, self._joined, self._seen, self._thicknesses):
            known.pop(name, None)

    @property
    def names(self) -> frozenset[str]:
        """Of all steps that are made, of all bones."""
        return frozenset(name for bone in self._trackers.bones.values() for name in bone.made)

    def version(self, bone: str) -> int:
        """Of a bone; 0 without a model of it."""
        known = self._trackers.bones.get(bone)
        return 0 if known is None else known.version

    def surface(self, bone: str) -> TriangleMesh | None:
        """What is left of a bone; None: all of it, or it has no model."""
        known = self._trackers.bones.get(bone)
        return None if known is None else known.surface

    def describe(self, stage: StageSpec) -> tuple[StepLine, ...]:
        """The steps of a stage: planned, made, cuts measured."""
        bone = self._trackers.bones.get(stage.bone)
        made = {} if bone is None else bone.made
        return tuple(
            self._describe(name, step, is_made=name in made)
            for name, step in self._plan.steps_of(stage).items()
        )

    def _describe(self, name: str, step: PlannedStep, *, is_made: bool) -> StepLine:
        joined = self._joined.get(name)
        return StepLine(
            name,
            is_made,
            joined if isinstance(joined, MeasuredFace) else None,
            self._seen.get(name),
            _kind_of(step),
            self._n_made[name],
            self._last_faces.get(name),
            joined if isinstance(joined, MeasuredHole) else None,
            self._thicknesses.get(name),
        )

    def measure(
        self, frame: StereoFrame, tracked: TrackedFrame | None, *, is_accepted: bool
    ) -> dict[str, Measured]:
        """Faces and holes of a bone in a frame in which its pose is OK: one in its turn, or all.

        With a pose that nobody has accepted they are told, where every frame tells what it can, but
        not kept.
        """
        turn, rest = divmod(self._n_frames, self._frames_between)
        self._n_frames += 1
        if tracked is None or tracked.verdict.status is not Status.OK or rest:
            return {}
        bone, is_each = self._trackers.bone(tracked.bone), self._frames_between == 1
        # A part covers the faces that it sits on.
        names = () if bone.parts else (*bone.cuts, *bone.holes)
        if names and not is_each:
            names = (names[turn % len(names)],)
        if tracked.estimate is None or not (is_accepted or is_each):
            return {}
        looked = {name: self._look(frame, bone, tracked.estimate, name) for name in names}
        found = {name: one for name, one in looked.items() if one is not None and one.is_told}
        if is_accepted:
            self._keep(bone, looked, found)
        return found

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
            self._seen[name] = None if one is None else one.seen_share
        for name, told in found.items():
            self._measured.setdefault(name, deque(maxlen=_KEPT)).append(told)
            joined = join_measured(tuple(self._measured[name]))
            self._joined[name] = joined
            if isinstance(joined, MeasuredFace):
                self._last_faces[name] = joined
                self._thicknesses[name] = measure_thickness(bone.planned.mesh, joined)
        self._learn(bone)

    def _learn(self, bone: CutBone) -> None:
        """Where faces have become known, less of the bone beside them is unsure."""
        known = {
            name: face
            for name in bone.unmeasured
            if len(self._measured.get(name, ())) >= _ENOUGH
            and isinstance(face := self._joined[name], MeasuredFace)
        }
        if known:
            self._trackers.set_bone(bone.with_faces(known))


def _kind_of(step: PlannedStep) -> StepKind:
    if isinstance(step, ResectionPlane):
        return "cut"
    return "hole" if isinstance(step, DrillAxis) else "part"
