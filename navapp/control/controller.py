"""The session controller: owns the loop, the states and the devices.

    OFFLINE -> STARTING -> READY -> REGISTERING -> REVIEW -> NAVIGATING <-> SUSPENDED
    FAULT from everywhere, and back to READY or SUSPENDED when the camera returns.

`step` handles one command or one frame and returns a snapshot. The controller never sees the truth.
"""

import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field, replace

from drivers.frames import StereoFrame
from drivers.interfaces import DeviceSet
from navapp.control.camera_link import CameraLink, Reopen
from navapp.control.device_lines import camera_line, display_line, mirror_line, projector_line
from navapp.control.display_link import DisplayLink
from navapp.control.executors import Executor
from navapp.control.interlocks import navigable
from navapp.control.pictures import Image, compose
from navapp.control.pursuit import Pursuit
from navapp.control.rates import RateMeter
from navapp.control.recorder import RecordingStopped
from navapp.control.results import FrameListener, FrameResult
from navapp.control.stages import STAGES, stage_by_number
from navapp.control.states import (
    Accept,
    Blank,
    Cancel,
    Command,
    EnterStage,
    Event,
    EventLevel,
    Interrupt,
    Progress,
    Propose,
    Quit,
    Reconnect,
    Register,
    Reject,
    SessionState,
    Show,
    Snapshot,
)
from navapp.errors import DeviceError, EndOfSequence, UsageError
from navapp.geometry.rig import StereoRig
from navapp.overlay import make_preview
from navapp.tracking import LineSettings
from navapp.values import (
    LineTimings,
    OverlayMode,
    OverlayPicture,
    Plan,
    Prior,
    StageSpec,
    Status,
    TrackedFrame,
)

_EVENTS_SHOWN = 60


@dataclass(frozen=True, slots=True)
class SessionOptions:
    """What a session is started with.

    Attributes:
        line: settings of the line.
        first_stage: stage in force at the start.
        overlay_valid_ms: how long a picture may stay on the display without a newer one.
        is_recording: the session is kept in a folder.
    """

    line: LineSettings = field(default_factory=LineSettings)
    first_stage: StageSpec = STAGES[0]
    overlay_valid_ms: float = 500.0
    is_recording: bool = False


@dataclass(frozen=True, slots=True)
class SessionHooks:
    """Who is told what; all called from the thread that steps the controller."""

    on_frame: tuple[FrameListener, ...] = ()
    on_event: tuple[Callable[[Event], None], ...] = ()
    on_command: tuple[Callable[[Command, int], None], ...] = ()
    on_take_over: tuple[Callable[[int], None], ...] = ()
    on_stage: tuple[Callable[[str], None], ...] = ()
    reopen_camera: Reopen | None = None


class SessionController:
    """Runs one session on an opened set of devices.

    Attributes:
        lost_device: why the session stands in FAULT; None when it does not.
    """

    def __init__(
        self,
        devices: DeviceSet,
        rig: StereoRig,
        plan: Plan,
        prior: Prior,
        *,
        executor: Executor,
        options: SessionOptions | None = None,
        hooks: SessionHooks | None = None,
    ) -> None:
        self._options = options or SessionOptions()
        self._hooks = hooks or SessionHooks()
        self._devices = devices
        self._clock = devices.clock
        self._rig = rig
        self._plan = plan
        self._executor = executor
        self._pursuit = Pursuit(rig, plan, prior, self._options.line, executor)
        self._camera = CameraLink(devices.camera, devices.clock, self._hooks.reopen_camera)
        self._display = DisplayLink(devices.display)
        self.lost_device: DeviceError | None = None
        self._commands: deque[Command] = deque()
        self._lock = threading.Lock()
        self._events: deque[Event] = deque(maxlen=_EVENTS_SHOWN)
        self._meter = RateMeter()
        self._tracked: TrackedFrame | None = None
        self._tracked_at_ns = 0
        self._preview: Image | None = None
        self._last_sequence = -1
        self._is_over = False
        self._state = SessionState.STARTING
        self._stage = self._options.first_stage
        self._announce_stage()
        self._snapshot = self._decided()

    @property
    def snapshot(self) -> Snapshot:
        """The newest one."""
        return self._snapshot

    def submit(self, command: Command) -> None:
        """Queue a command; callable from any thread, never blocks."""
        with self._lock:
            self._commands.append(command)
        if isinstance(command, Blank):
            # The operator's hand comes before everything else, also before a step that hangs.
            self._display.blank()

    def darken(self) -> None:
        """Turn the display dark, now; callable from any thread, also while a step hangs."""
        self._display.darken()

    def step(self, timeout_s: float = 0.2) -> Snapshot:
        """Handle one command, or one frame; return at the latest after the time given."""
        with self._lock:
            command = self._commands.popleft() if self._commands else None
        if command is not None:
            self._tell(self._hooks.on_command, command, self._last_sequence)
            self._handle(command)
        else:
            self._take_over(self._last_sequence + 1)
            frame = self._next_frame(timeout_s)
            if frame is not None:
                self._handle_frame(frame)
        self._snapshot = self._decided()
        if not (self._snapshot.is_navigable or self._snapshot.is_candidate):
            self._display.withdraw_guides()
        return self._snapshot

    def close(self) -> None:
        """End everything, the display first; safe to call twice."""
        self._display.darken()
        self._is_over = True
        self._pursuit.drop()
        self._executor.close()
        self._camera.close()
        self._devices.close()
        self._state = SessionState.OFFLINE
        self._snapshot = self._decided()

    # -- frames ---------------------------------------------------------------------------------

    def _next_frame(self, timeout_s: float) -> StereoFrame | None:
        if self._camera.is_down:
            if self._camera.wait_for_return(timeout_s):
                self.lost_device = None
                self._fall_back(f"camera {self._camera.camera.info.name} is back")
            return None
        try:
            return self._camera.take(timeout_s)
        except EndOfSequence:
            self._is_over = True
            self._event("end", "the sequence is at its end")
        except DeviceError as error:
            self._display.darken()
            self.lost_device = error
            self._tell(self._hooks.on_command, Interrupt(), self._last_sequence)
            self._interrupt()
            self._change(SessionState.FAULT, str(error), EventLevel.ALARM)
            self._is_over = not self._camera.can_return
        return None

    def _interrupt(self) -> None:
        """What the loss of the camera does to what is known of the bone."""
        self._pursuit.drop()
        self._tracked = None

    def _handle_frame(self, frame: StereoFrame) -> None:
        self._last_sequence = frame.sequence
        if self._state is SessionState.STARTING:
            self._change(SessionState.READY, "pictures arrive")
        self._tracked = self._look_for_bone(frame)
        self._tracked_at_ns = frame.captured_ns
        self._change_with_verdict()
        snapshot = self._decided()
        picture, overlay_ms = self._show(frame, snapshot)
        timings = LineTimings() if self._tracked is None else self._tracked.timings
        result = FrameResult(
            frame,
            self._state,
            self._stage,
            self._tracked,
            picture,
            replace(timings, overlay_ms=overlay_ms),
            snapshot.is_navigable,
        )
        is_stepped = self._camera.camera.info.is_stepped
        self._meter.add(
            result.timings.total_ms if is_stepped else picture.pose_age_ns / 1e6, frame.skew_ns
        )
        self._tell(self._hooks.on_frame, result)

    def _look_for_bone(self, frame: StereoFrame) -> TrackedFrame | None:
        """Register, review or follow, as the state asks."""
        if self._state is SessionState.REGISTERING:
            # A search that began earlier is taken over before a frame, never within one: its
            # answer belongs to another picture and must be followed into this one first.
            is_of_this_frame = self._pursuit.search(self._stage, frame)
            return self._take_over(frame.sequence) if is_of_this_frame else None
        if self._state is SessionState.REVIEW:
            return self._pursuit.review(self._stage, frame)
        if self._state in (SessionState.NAVIGATING, SessionState.SUSPENDED):
            return self._pursuit.follow(self._stage, frame)
        return None

    def _change_with_verdict(self) -> None:
        if self._tracked is None:
            return
        verdict = self._tracked.verdict
        is_lost = verdict.status is Status.LOST
        if self._state is SessionState.NAVIGATING and is_lost:
            why = f": {verdict.reasons[0].value}" if verdict.reasons else ""
            self._change(SessionState.SUSPENDED, f"bone lost{why}", EventLevel.ALARM)
        elif self._state is SessionState.SUSPENDED and not is_lost:
            self._change(SessionState.NAVIGATING, "bone found again")

    def _show(self, frame: StereoFrame, snapshot: Snapshot) -> tuple[OverlayPicture, float]:
        """Compose, show until it expires, keep a preview; also how long composing took."""
        started_ns = time.perf_counter_ns()
        mark = "SIMULATED" if self._is_simulated else ""
        image = compose(frame.left, snapshot, self._rig, self._plan, mark)
        overlay_ms = (time.perf_counter_ns() - started_ns) / 1e6
        valid_until_ns = frame.captured_ns + round(self._options.overlay_valid_ms * 1e6)
        has_guides = snapshot.is_navigable or snapshot.is_candidate
        if self._display.show(image, valid_until_ns, has_guides=has_guides):
            self._event("device", self._display.trouble, EventLevel.ALARM)
        self._preview = make_preview(image)
        age_ns = self._clock.now_ns() - frame.captured_ns
        return OverlayPicture(image, valid_until_ns, OverlayMode.VIDEO, age_ns), overlay_ms

    def _take_over(self, next_sequence: int) -> TrackedFrame | None:
        """Bring a finished registration under review; its best answer, when there is one."""
        outcome = self._pursuit.take_over(next_sequence)
        if outcome is None:
            return None
        self._tell(self._hooks.on_take_over, next_sequence)
        if not outcome.candidates:
            why = f"no start pose is known for the {self._stage.bone}"
            if outcome.failure is not None and outcome.failure.verdict.reasons:
                why = outcome.failure.verdict.reasons[0].value
            self._fall_back(f"registration failed: {why}", EventLevel.WARNING)
            return outcome.failure
        best = outcome.candidates[0].tracked
        bound_mm = best.verdict.predicted_tre_mm
        error = "" if bound_mm is None else f", predicted error {bound_mm:.2f} mm"
        self._change(SessionState.REVIEW, f"candidate 1 of {len(outcome.candidates)}{error}")
        return best

    # -- commands -------------------------------------------------------------------------------

    def _handle(self, command: Command) -> None:
        match command:
            case Register():
                self._on_register()
            case Propose():
                self._on_propose(command)
            case Cancel():
                self._on_cancel()
            case Accept():
                self._on_accept()
            case Reject():
                self._on_reject()
            case Blank():
                self._on_blank()
            case Show():
                self._on_show()
            case EnterStage():
                self._on_enter_stage(command)
            case Reconnect():
                self._camera.retry_now()
            case Interrupt():
                self._interrupt()
                self._fall_back("the camera was lost here when this was recorded")
            case Quit():
                self._is_over = True
                self._display.darken()
                self._event("quit", "session ended by the operator")

    def _on_register(self) -> None:
        if not self._can_look("register"):
            return
        self._pursuit.drop()
        self._tracked = None
        self._change(SessionState.REGISTERING, f"searching for the {self._stage.bone}")

    def _on_propose(self, command: Propose) -> None:
        if not self._can_look("propose"):
            return
        if command.left_from_bone.source != self._stage.bone:
            self._refuse("propose", f"the pose is not one of the {self._stage.bone}")
            return
        self._tracked = None
        self._pursuit.propose(self._stage, command.left_from_bone, self._clock.now_ns())
        self._change(SessionState.REVIEW, "a pose was proposed by hand")

    def _on_cancel(self) -> None:
        if self._state is not SessionState.REGISTERING:
            self._refuse("cancel", "no registration is running")
            return
        self._pursuit.drop()
        self._fall_back("registration cancelled")

    def _on_accept(self) -> None:
        candidate = self._pursuit.candidate
        if self._state is not SessionState.REVIEW or candidate is None:
            self._refuse("accept", "no candidate is under review")
            return
        verdict = candidate.tracked.verdict
        if verdict.status is Status.LOST:
            self._refuse("accept", "the judge calls this candidate lost")
            return
        self._pursuit.accept(self._stage)
        bound_mm = verdict.predicted_tre_mm
        error = "" if bound_mm is None else f", predicted error {bound_mm:.2f} mm"
        self._change(SessionState.NAVIGATING, f"registration accepted{error}")

    def _on_reject(self) -> None:
        if self._state is not SessionState.REVIEW:
            self._refuse("reject", "no candidate is under review")
            return
        rejected = self._pursuit.reject()
        self._tracked = None
        text = f"candidate {rejected.number} of {rejected.count} rejected by the operator"
        if self._pursuit.candidate is None:
            self._fall_back(text)
        else:
            self._event("reject", text)

    def _on_blank(self) -> None:
        self._display.blank()
        self._event("blank", "display blanked by the operator")

    def _on_show(self) -> None:
        if self._display.is_blanked:
            self._display.show_again()
            self._event("show", "display shown again")

    def _on_enter_stage(self, command: EnterStage) -> None:
        try:
            stage = stage_by_number(command.number)
        except UsageError as error:
            self._refuse("stage", str(error))
            return
        if stage is self._stage:
            return
        is_other_bone = stage.bone != self._stage.bone
        self._stage = stage
        # What was judged by the old stage's targets and tolerance says nothing in the new one.
        self._tracked = None
        self._pursuit.forget_verdict()
        self._announce_stage()
        if is_other_bone and self._state not in (SessionState.STARTING, SessionState.FAULT):
            self._pursuit.drop()
            self._fall_back(f"the {stage.bone} is now the bone to follow")

    def _announce_stage(self) -> None:
        """Tell the simulated room, if any; a stage that it cannot show is said, not refused."""
        stage = self._stage
        self._event("stage", f"stage {stage.number} {stage.name} entered")
        for listener in self._hooks.on_stage:
            try:
                listener(stage.name)
            except UsageError as error:
                self._event("stage", str(error), EventLevel.WARNING)

    @property
    def _is_simulated(self) -> bool:
        """The pictures are not of this world; a replayed rig still says so by its name."""
        return self._camera.camera.info.is_simulated or self._rig.name.startswith("sim:")

    def _can_look(self, what: str) -> bool:
        if self._state is SessionState.FAULT:
            self._refuse(what, "the camera is lost")
        elif not self._pursuit.is_planned(self._stage):
            self._refuse(what, f"the plan has no model of the {self._stage.bone}")
        else:
            return True
        return False

    def _fall_back(self, text: str, level: EventLevel = EventLevel.INFO) -> None:
        """To where the session stands without a candidate."""
        is_known = self._pursuit.is_accepted(self._stage)
        self._change(SessionState.SUSPENDED if is_known else SessionState.READY, text, level)

    # -- what is told ---------------------------------------------------------------------------

    def _change(self, state: SessionState, text: str, level: EventLevel = EventLevel.INFO) -> None:
        self._state = state
        self._event("state", text, level)

    def _refuse(self, what: str, why: str) -> None:
        self._event("refused", f"{what} refused: {why}", EventLevel.WARNING)

    def _tell(self, listeners: tuple[Callable[..., None], ...], *words: object) -> None:
        """Tell all; a recording that cannot go on is an event, not the end of the session."""
        for listener in listeners:
            try:
                listener(*words)
            except RecordingStopped as error:
                self._event("recording", str(error), EventLevel.ALARM)

    def _event(self, kind: str, text: str, level: EventLevel = EventLevel.INFO) -> None:
        event = Event(self._clock.now_ns(), kind, text, level, self._last_sequence)
        self._events.append(event)
        self._tell(self._hooks.on_event, event)

    def _decided(self) -> Snapshot:
        """The snapshot with the interlocks' answer in it."""
        now_ns = self._clock.now_ns()
        tracked = self._tracked
        bone = self._plan.bones.get(self._stage.bone)
        draft = Snapshot(
            time_ns=now_ns,
            state=self._state,
            stage=self._stage,
            stages=STAGES,
            reasons=(),
            is_blanked=self._display.is_blanked,
            verdict=None if tracked is None else tracked.verdict,
            left_from_bone=None if tracked is None else tracked.left_from_bone,
            is_candidate=self._state is SessionState.REVIEW and tracked is not None,
            pose_age_ms=None if tracked is None else (now_ns - self._tracked_at_ns) / 1e6,
            preview=self._preview,
            rates=self._meter.rates(self._camera.n_dropped),
            devices=(
                camera_line(self._camera.camera.info, self._camera.trouble),
                display_line(self._display.display.info, self._display.trouble),
                projector_line(self._devices.projector),
                mirror_line(self._devices.mirror),
            ),
            events=tuple(self._events),
            progress=self._progress(),
            rig_name=self._rig.name,
            is_simulated=self._is_simulated,
            is_recording=self._options.is_recording,
            plan_name=self._plan.name,
            plan_digest=self._plan.digest,
            side="" if bone is None or bone.side is None else bone.side,
            sequence=self._last_sequence,
            is_bone_planned=bone is not None,
            is_camera_silent=self._camera.is_silent,
            is_over=self._is_over,
        )
        return replace(draft, reasons=navigable(draft))

    def _progress(self) -> Progress | None:
        share = self._pursuit.progress
        if share is not None:
            return Progress(f"searching for the {self._stage.bone}", share)
        if self._state is SessionState.STARTING:
            return Progress("waiting for the first picture", 0.0)
        return None
