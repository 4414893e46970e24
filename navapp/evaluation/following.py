"""One method on one sequence: registered once, then followed, and judged against the truth."""

import math
import time
from contextlib import ExitStack
from dataclasses import dataclass

from drivers.clock import ManualClock
from drivers.memory_camera import MemoryCamera
from navapp.control.commands import Accept, Command, Register, Reject
from navapp.control.controller import SessionController
from navapp.control.event_log import SessionHooks
from navapp.control.executors import InlineExecutor
from navapp.control.frame_result import FrameResult
from navapp.control.runner import run_headless
from navapp.control.specification import specify_session
from navapp.control.states import SessionState, Snapshot
from navapp.devices import make_memory_devices
from navapp.devices.simulated_room import make_sensor
from navapp.evaluation.noise_limit.frame import measure_budget
from navapp.evaluation.pose_errors import measure_pose
from navapp.evaluation.predicted_errors import predict_errors_mm
from navapp.evaluation.scores import ErrorBudget, Followed, FrameScore
from navapp.evaluation.sequence import KnownSequence
from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.rectification import rectifier_of
from navapp.geometry.transform import RigidTransform
from navapp.tracking import Method, Part
from navapp.values import Status, TrackedFrame, Verdict

# A bone that so many searches have not found is not searched for any more.
_MOST_REGISTRATIONS = 5
# One frame of so many has its error budget measured, for time alone.
_BUDGET_EVERY = 5


class Follower:
    """The operator of a test: registers, accepts what is OK, and does nothing more.

    What is not OK is rejected and searched for again in the next frame; the last search is accepted
    if it is not lost. With `follows_refused` all but a lost one is accepted, and a lost one is left
    under review and followed.
    """

    def __init__(self, *, follows_refused: bool) -> None:
        self._follows_refused = follows_refused
        self.n_registrations = 0

    def commands(self, snapshot: Snapshot) -> list[Command]:
        """What to do now."""
        if snapshot.state in (SessionState.STARTING, SessionState.READY):
            if self.n_registrations == _MOST_REGISTRATIONS:
                return []
            self.n_registrations += 1
            return [Register()]
        if snapshot.state is not SessionState.REVIEW:
            return []
        status = Status.LOST if snapshot.verdict is None else snapshot.verdict.status
        if status is Status.LOST and self._follows_refused:
            return []
        is_last = self._follows_refused or self.n_registrations == _MOST_REGISTRATIONS
        is_enough = status is Status.OK or (is_last and status is not Status.LOST)
        return [(Accept if is_enough else Reject)(snapshot.candidate_id)]


@dataclass(frozen=True, slots=True, eq=False)
class Answers:
    """What a method said of a sequence."""

    followed: Followed
    poses: tuple[RigidTransform | None, ...]  # left camera from bone, of every frame
    surface: TriangleMesh  # of the bone, as it is drawn


def follow(
    sequence: KnownSequence, method: Method, leaves_out: frozenset[Part] = frozenset()
) -> Answers:
    """Register the bone in the first frame, and follow it to the last one.

    The paper's two methods carry on what our judge refuses, so that they can be measured; its word
    on them is kept. Of ours, parts may be left out.

    Raises:
        NavappError: the session ended in a fault: a picture that cannot be read.
    """
    follows_refused = method != "bimcc"
    operator = Follower(follows_refused=follows_refused)
    judge = _Judge(sequence, operator, follows_refused=follows_refused)
    clock = ManualClock()
    specification = specify_session(
        sequence.configuration,
        sequence.rig,
        sequence.plan,
        sequence.prior,
        sequence.stage,
        is_live=False,
        method=method,
        follows_refused=follows_refused,
        made_steps=sequence.made_steps,
        leaves_out=leaves_out,
    )
    with ExitStack() as undo:
        camera = MemoryCamera(sequence.frames, clock, is_simulated=sequence.is_simulated)
        devices = make_memory_devices(camera, clock, sequence.rig, sequence.configuration)
        controller = SessionController(
            devices,
            specification,
            executor=InlineExecutor(),
            hooks=SessionHooks(on_frame=(judge.take,)),
        )
        undo.callback(controller.close)
        judge.surface = controller.snapshot.bone_surface or judge.surface
        started_s = time.perf_counter()
        run_headless(controller, operator)
        if controller.failure is not None:
            raise controller.failure
    return judge.result(started_s)


class _Judge:
    """Scores frames as they come; the sequence's truth goes no further."""

    def __init__(
        self, sequence: KnownSequence, operator: Follower, *, follows_refused: bool
    ) -> None:
        self._sequence, self._operator = sequence, operator
        self._follows_refused = follows_refused
        self._n_searches = 0  # that were made before the newest frame
        self._bone = sequence.plan.bones[sequence.stage.bone]
        self._targets_mm = sequence.plan.targets_of(sequence.stage.targets)
        self._rectifier = rectifier_of(sequence.rig)
        self._geometry = self._rectifier.geometry
        self._scores: list[FrameScore] = []
        self._poses: list[RigidTransform | None] = []
        self._registered_s: float | None = None
        self._spent_s = 0.0  # in judging
        self.surface: TriangleMesh = self._bone.mesh  # what is left of the bone

    def take(self, result: FrameResult) -> None:
        """A frame was handled."""
        started_s = time.perf_counter()
        tracked = result.tracked
        pose = None if tracked is None else tracked.left_from_bone
        is_lost = tracked is None or tracked.verdict.status is Status.LOST
        is_kept = pose is not None and (self._follows_refused or not is_lost)
        is_search = self._operator.n_registrations > self._n_searches
        self._n_searches = self._operator.n_registrations
        # A later search replaces one that was rejected.
        if is_kept and (is_search or self._registered_s is None):
            self._registered_s = started_s - self._spent_s
        self._poses.append(pose)
        self._scores.append(self._score(result, is_search=is_search))
        self._spent_s += time.perf_counter() - started_s

    def result(self, started_s: float) -> Answers:
        """Scores of all frames but the one in which the first search was made."""
        registered_s = self._registered_s
        seconds = None if registered_s is None else registered_s - started_s
        followed = Followed(seconds, self._n_searches, tuple(self._scores[1:]))
        return Answers(followed, tuple(self._poses), self.surface)

    def _score(self, result: FrameResult, *, is_search: bool) -> FrameScore:
        place, tracked = len(self._scores), result.tracked
        verdict = None if tracked is None else tracked.verdict
        pose = None if tracked is None else tracked.left_from_bone
        true = self._sequence.truth[place]
        tre_mm, displacement_mm, outline_mm = self._measure(pose, true)
        has_budget = verdict is not None and verdict.status is Status.OK
        return FrameScore(
            index=place,
            status=Status.LOST.value if verdict is None else verdict.status.value,
            reasons=() if verdict is None else tuple(one.value for one in verdict.reasons),
            tre_mm=tre_mm,
            displacement_mm=displacement_mm,
            outline_mm=outline_mm,
            bound_mm=None if verdict is None else verdict.predicted_tre_mm,
            seen=None if verdict is None else verdict.coverage,
            hidden=None if verdict is None else verdict.occluded_fraction,
            total_ms=result.timings.total_ms,
            is_search=is_search,
            claimed_mm=self._predict(tracked),
            rms_ratio=_find_rms_ratio(verdict),
            budget=self._measure_budget(place, pose, true) if has_budget else None,
        )

    def _predict(self, tracked: TrackedFrame | None) -> tuple[float, ...] | None:
        if tracked is None or tracked.estimate is None:
            return None
        return predict_errors_mm(tracked.estimate, self._bone, self._targets_mm)

    def _measure_budget(
        self, place: int, pose: RigidTransform | None, true: RigidTransform | None
    ) -> ErrorBudget | None:
        """Of one frame of some, of our method, where the sensor is known."""
        sequence, camera = self._sequence, self._sequence.configuration.camera
        is_asked = place % _BUDGET_EVERY == 1 and not self._follows_refused
        is_known = sequence.is_simulated and camera.backend == "simulated"
        if not (is_asked and is_known) or pose is None or true is None:
            return None
        if len(self._targets_mm) == 0:
            return None
        return measure_budget(
            sequence.frames[place],
            pose,
            true,
            self.surface,
            self._bone.mesh.centroid_mm,
            self._targets_mm,
            self._rectifier,
            make_sensor(camera.simulated),
        )

    def _measure(
        self, pose: RigidTransform | None, true: RigidTransform | None
    ) -> tuple[float | None, float | None, float | None]:
        if pose is None or true is None:
            return None, None, None
        return measure_pose(
            pose,
            true,
            self._bone,
            self._targets_mm,
            self.surface,
            self._geometry,
            self._sequence.true_targets_mm,
        )


def _find_rms_ratio(verdict: Verdict | None) -> float | None:
    """Residual of the fit over the expected one."""
    if verdict is None or verdict.rms_mm is None or not verdict.expected_rms_mm:
        return None
    ratio = verdict.rms_mm / verdict.expected_rms_mm
    return ratio if math.isfinite(ratio) else None
