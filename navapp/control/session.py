"""What a session knows: where it stands, what it looks for, what was found, what happened."""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

from drivers.clock import Clock
from drivers.frames import StereoFrame
from navapp.control.camera_link import Reopen
from navapp.control.other_bones import OtherBones
from navapp.control.pictures import Image
from navapp.control.pursuit import Pursuit
from navapp.control.rates import RateMeter
from navapp.control.recorder import RecordingStopped
from navapp.control.results import FrameListener
from navapp.control.states import Command, Event, EventLevel, SessionState
from navapp.errors import RigError, UsageError
from navapp.values import Reason, StageSpec, Status, TrackedFrame, Verdict

_EVENTS_SHOWN = 60


@dataclass(frozen=True, slots=True)
class SessionHooks:
    """Who is told what; all called from the thread that steps the controller."""

    on_frame: tuple[FrameListener, ...] = ()
    on_event: tuple[Callable[[Event], None], ...] = ()
    on_command: tuple[Callable[[Command, int], None], ...] = ()
    on_take_over: tuple[Callable[[int], None], ...] = ()
    on_stage: tuple[Callable[[str], None], ...] = ()
    reopen_camera: Reopen | None = None


class Session:
    """What frames and commands change, and snapshots are made of.

    Attributes:
        clock: of the session.
        hooks: who is told.
        pursuit: of the stage's bone.
        others: the other bones that are followed.
        state: where the session stands.
        stage: in force.
        tracked: the newest answer on the stage's bone, None when there is none that counts.
        tracked_at_ns: when its frame was captured.
        sequence: of the newest handled frame, -1 before the first.
        preview: of the newest picture, None before the first.
        meter: how fast frames are handled.
        is_over: nothing is handled any more.
        rig_error: why the rig is not believed any more; None while it is.
    """

    def __init__(
        self,
        clock: Clock,
        hooks: SessionHooks,
        pursuit: Pursuit,
        others: OtherBones,
        stage: StageSpec,
    ) -> None:
        self.clock = clock
        self.hooks = hooks
        self.pursuit = pursuit
        self.others = others
        self.state = SessionState.STARTING
        self.tracked: TrackedFrame | None = None
        self.tracked_at_ns = 0
        self.sequence = -1
        self.preview: Image | None = None
        self.meter = RateMeter()
        self.is_over = False
        self.rig_error: RigError | None = None
        self._events: deque[Event] = deque(maxlen=_EVENTS_SHOWN)
        self.enter(stage)

    @property
    def events(self) -> tuple[Event, ...]:
        """The newest, oldest first."""
        return tuple(self._events)

    def enter(self, stage: StageSpec) -> None:
        """Put a stage in force and tell the simulated room, if any.

        A stage that the room cannot show is said, not refused.
        """
        self.stage = stage
        # What was judged by the old stage's targets and tolerance says nothing in the new one.
        self.tracked = None
        self.pursuit.forget_verdict()
        self.event("stage", f"stage {stage.number} {stage.name} entered")
        for listener in self.hooks.on_stage:
            try:
                listener(stage.name)
            except UsageError as error:
                self.event("stage", str(error), EventLevel.WARNING)

    def take(self, tracked: TrackedFrame | None, captured_ns: int) -> None:
        """Take over a frame's answer: a bone that is lost suspends, its return resumes."""
        self.tracked, self.tracked_at_ns = tracked, captured_ns
        if tracked is None:
            return
        verdict = tracked.verdict
        is_lost = verdict.status is Status.LOST
        if self.state is SessionState.NAVIGATING and is_lost:
            why = f": {verdict.reasons[0].value}" if verdict.reasons else ""
            self.change(SessionState.SUSPENDED, f"bone lost{why}", EventLevel.ALARM)
        elif self.state is SessionState.SUSPENDED and not is_lost:
            self.change(SessionState.NAVIGATING, "bone found again")

    def follow_others(self, frame: StereoFrame) -> dict[str, TrackedFrame]:
        """Follow another bone into a frame; in a fault none: nothing that is measured counts."""
        if self.state is SessionState.FAULT:
            return {}
        return self.others.follow(self.stage, frame, self.tracked)

    def lose_sight(self) -> None:
        """What the loss of the camera or of the rig does to what is known of the bones."""
        self.pursuit.drop()
        self.others.forget()
        self.tracked = None

    def distrust_rig(self, why: str) -> None:
        """What a rig that has moved does to the session: a fault that does not end."""
        if self.rig_error is not None:
            return
        self.rig_error = RigError(rig_moved_text(why), remedy=Reason.RIG_MOVED.remedy)
        self.lose_sight()
        self.change(SessionState.FAULT, self.rig_error.problem, EventLevel.ALARM)

    def change(self, state: SessionState, text: str, level: EventLevel = EventLevel.INFO) -> None:
        """Stand elsewhere from now on, and tell why."""
        self.state = state
        self.event("state", text, level)

    def fall_back(self, text: str, level: EventLevel = EventLevel.INFO) -> None:
        """To where the session stands without a candidate."""
        if self.rig_error is not None:
            self.change(SessionState.FAULT, text, level)
            return
        is_known = self.pursuit.is_accepted(self.stage)
        self.change(SessionState.SUSPENDED if is_known else SessionState.READY, text, level)

    def event(self, kind: str, text: str, level: EventLevel = EventLevel.INFO) -> None:
        """Keep and tell what has just happened."""
        event = Event(self.clock.now_ns(), kind, text, level, self.sequence)
        self._events.append(event)
        self.tell(self.hooks.on_event, event)

    def tell(self, listeners: tuple[Callable[..., None], ...], *words: object) -> None:
        """Tell all; a recording that cannot go on is an event, not the end of the session."""
        for listener in listeners:
            try:
                listener(*words)
            except RecordingStopped as error:
                self.event("recording", str(error), EventLevel.ALARM)


def rig_moved_text(why: str) -> str:
    """What is said of a rig that has moved, with how that was found."""
    return f"{Reason.RIG_MOVED.value} ({why})"


def with_bound(text: str, verdict: Verdict) -> str:
    """A text with the predicted error, when there is one."""
    bound_mm = verdict.predicted_tre_mm
    return text if bound_mm is None else f"{text}, predicted error {bound_mm:.2f} mm"
