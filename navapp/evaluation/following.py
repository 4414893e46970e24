"""One method on one sequence: registered once, then followed."""

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
from navapp.evaluation.methods import OURS
from navapp.evaluation.sequence import KnownSequence
from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.transform import RigidTransform
from navapp.tracking import Method, Part
from navapp.values import PoseEstimate, Status, Verdict

# A bone that so many searches have not found is not searched for any more.
MOST_REGISTRATIONS = 5


class Operator:
    """The operator of a test: registers, accepts what is OK, and does nothing more.

    What is not OK is rejected and searched for again in the next frame; the last search is accepted
    if it is not lost. With `follows_refused` all but a lost one is accepted, and a lost one is left
    under review and followed.
    """

    def __init__(self, *, follows_refused: bool) -> None:
        self.follows_refused = follows_refused
        self.n_registrations = 0
        self.has_accepted = False

    def commands(self, snapshot: Snapshot) -> list[Command]:
        """What to do now."""
        if snapshot.state in (SessionState.STARTING, SessionState.READY):
            if self.n_registrations == MOST_REGISTRATIONS:
                return []
            self.n_registrations += 1
            return [Register()]
        if snapshot.state is not SessionState.REVIEW:
            return []
        status = Status.LOST if snapshot.verdict is None else snapshot.verdict.status
        if status is Status.LOST and self.follows_refused:
            return []
        is_last = self.follows_refused or self.n_registrations == MOST_REGISTRATIONS
        is_enough = is_accepted(status, is_last=is_last)
        self.has_accepted |= is_enough
        return [(Accept if is_enough else Reject)(snapshot.candidate_id)]


def is_accepted(status: Status, *, is_last: bool) -> bool:
    """Whether a pose is accepted: an OK one; after the last search any that is not LOST."""
    return status is Status.OK or (is_last and status is not Status.LOST)


@dataclass(frozen=True, slots=True, eq=False)
class FrameAnswer:
    """What a method said of one frame."""

    pose: RigidTransform | None  # left camera from bone
    estimate: PoseEstimate | None  # of that pose
    verdict: Verdict | None  # None: the bone was not looked for
    total_ms: float  # that the frame took, from rectification to overlay
    is_search: bool  # a registration was made in it

    @property
    def status(self) -> Status:
        """The judge's word; LOST where the bone was not looked for."""
        return Status.LOST if self.verdict is None else self.verdict.status

    @property
    def is_ok(self) -> bool:
        """The judge believes the pose."""
        return self.status is Status.OK


@dataclass(frozen=True, slots=True, eq=False)
class Answers:
    """What a method said of a sequence."""

    frames: tuple[FrameAnswer, ...]  # all of the sequence
    # until the first registration whose pose was followed, with those that failed before; None:
    # none was.
    registration_s: float | None
    n_registrations: int  # searches that were made
    surface: TriangleMesh  # of the bone, as it is drawn

    @property
    def poses(self) -> list[RigidTransform | None]:
        """Left camera from bone, of every frame."""
        return [frame.pose for frame in self.frames]


def follow(
    sequence: KnownSequence, method: Method, leaves_out: frozenset[Part] = frozenset()
) -> Answers:
    """Register the bone in the first frame, and follow it to the last one.

    The truth is not read. The paper's two methods carry on what our judge refuses, so that they can
    be measured; its word on them is kept. Of ours, parts may be left out.

    Raises:
        NavappError: the session ended in a fault: a picture that cannot be read.
    """
    follows_refused = method != OURS
    operator = Operator(follows_refused=follows_refused)
    recorder = _Recorder(operator)
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
            hooks=SessionHooks(on_frame=(recorder.take,)),
        )
        undo.callback(controller.close)
        surface = controller.snapshot.bone_surface or sequence.plan.bones[sequence.stage.bone].mesh
        recorder.begin()
        run_headless(controller, operator)
        if controller.failure is not None:
            raise controller.failure
    return recorder.answer(surface)


class _Recorder:
    """Notes what is said of frames as they come, and when."""

    def __init__(self, operator: Operator) -> None:
        self._operator = operator
        self._frames: list[FrameAnswer] = []
        self._n_searches = 0  # that were made before the newest frame
        self._taken_s: list[float] = []  # when each frame was done
        self._began_s = 0.0

    def begin(self) -> None:
        """Times count from now."""
        self._began_s = time.perf_counter()

    def take(self, result: FrameResult) -> None:
        """Note the answer to a frame."""
        tracked = result.tracked
        is_search = self._operator.n_registrations > self._n_searches
        self._n_searches = self._operator.n_registrations
        self._taken_s.append(time.perf_counter() - self._began_s)
        self._frames.append(
            FrameAnswer(
                None if tracked is None else tracked.left_from_bone,
                None if tracked is None else tracked.estimate,
                None if tracked is None else tracked.verdict,
                result.timings.total_ms,
                is_search,
            )
        )

    def answer(self, surface: TriangleMesh) -> Answers:
        """All answers that were noted."""
        n_registrations = self._operator.n_registrations
        return Answers(tuple(self._frames), self._find_start_s(), n_registrations, surface)

    def _find_start_s(self) -> float | None:
        """When the search was done whose pose was followed."""
        if self._operator.follows_refused:
            started = [place for place, one in enumerate(self._frames) if one.pose is not None][:1]
        else:
            # What was accepted is the last search; those before it were rejected.
            searches = [place for place, one in enumerate(self._frames) if one.is_search]
            started = searches[-1:] if self._operator.has_accepted else []
        return self._taken_s[started[0]] if started else None
