"""The session controller: owns the loop, the states and the devices.

    OFFLINE -> STARTING -> READY -> REGISTERING -> REVIEW -> NAVIGATING <-> SUSPENDED
    FAULT from everywhere, and back to READY or SUSPENDED when the camera returns.

`step` handles one command or one frame and returns a snapshot. The controller never sees the truth.
"""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field, replace

from drivers.frames import StereoFrame
from drivers.interfaces import DeviceSet, PowerState, StereoCamera
from navapp.control.executors import Executor, JobCancelled
from navapp.control.interlocks import navigable
from navapp.control.pictures import Image, compose, fitted
from navapp.control.rates import RateMeter
from navapp.control.registering import Candidate, Registration
from navapp.control.results import FrameListener, FrameResult
from navapp.control.sources import FrameSource, open_source
from navapp.control.stages import STAGES, stage_by_number
from navapp.control.states import (
    Accept,
    Blank,
    Cancel,
    Command,
    DeviceHealth,
    DeviceLine,
    EnterStage,
    Event,
    EventLevel,
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
from navapp.tracking import Line, LineSettings, TrackState
from navapp.tracking.line import Goal
from navapp.values import (
    OverlayMode,
    OverlayPicture,
    Plan,
    Prior,
    StageSpec,
    StageTimings,
    Status,
    TrackedFrame,
    Verdict,
)

_EVENTS_SHOWN = 60
_RECONNECT_EVERY_NS = 1_000_000_000
_SILENT_AFTER_NS = 1_000_000_000


@dataclass(frozen=True, slots=True)
class SessionOptions:
    """What a session is started with.

    Attributes:
        line: settings of the line.
        first_stage: stage in force at the start.
        overlay_valid_ms: how long a picture may stay on the display without a newer one.
        rig_name: for the title; begins with `sim:` for simulated rigs.
    """

    line: LineSettings = field(default_factory=LineSettings)
    first_stage: StageSpec = STAGES[0]
    overlay_valid_ms: float = 250.0
    rig_name: str = ""


@dataclass(frozen=True, slots=True)
class SessionHooks:
    """Who is told what; all called from the thread that steps the controller."""

    on_frame: tuple[FrameListener, ...] = ()
    on_event: tuple[Callable[[Event], None], ...] = ()
    on_command: tuple[Callable[[Command, int], None], ...] = ()
    on_take_over: tuple[Callable[[int], None], ...] = ()
    on_stage: tuple[Callable[[str], None], ...] = ()
    reopen_camera: Callable[[], StereoCamera] | None = None


class SessionController:
    """Runs one session on an opened set of devices."""

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
        self._devices = devices
        self._rig = rig
        self._plan = plan
        self._prior = prior
        self._executor = executor
        self._options = options or SessionOptions()
        self._hooks = hooks or SessionHooks()
        self._clock = devices.clock
        self._commands: deque[Command] = deque()
        self._lock = threading.Lock()
        self._events: deque[Event] = deque(maxlen=_EVENTS_SHOWN)
        self._meter = RateMeter()
        self._lines: dict[str, Line] = {}
        self._tracks: dict[str, TrackState] = {}
        self._candidates: list[Candidate] = []
        self._registration: Registration | None = None
        self._tracked: TrackedFrame | None = None
        self._tracked_at_ns = 0
        self._state = SessionState.STARTING
        self._stage = self._options.first_stage
        self._is_blanked = False
        self._is_over = False
        self._camera_trouble = ""
        self._display_trouble = ""
        self._retry_at_ns = 0
        self._last_frame_ns = self._clock.now_ns()
        self._last_sequence = -1
        self._preview: Image | None = None
        self._source: FrameSource | None = open_source(devices.camera)
        self._enter_stage(self._stage)
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
            self._is_blanked = True
            self._devices.display.blank()

    def step(self, timeout_s: float = 0.2) -> Snapshot:
        """Handle one command, or one frame; return at the latest after the time given."""
        with self._lock:
            command = self._commands.popleft() if self._commands else None
        if command is not None:
            self._handle(command)
        else:
            self._take_over_registration(self._last_sequence + 1)
            frame = self._next_frame(timeout_s)
            if frame is not None:
                self._handle_frame(frame)
        self._snapshot = self._decided()
        return self._snapshot

    def close(self) -> None:
        """End everything; the display first."""
        self._devices.display.blank()
        self._is_over = True
        if self._registration is not None:
            self._registration.cancel()
        self._executor.close()
        if self._source is not None:
            self._source.close()
        self._devices.close()
        self._state = SessionState.OFFLINE
        self._snapshot = self._decided()

    # -- frames ---------------------------------------------------------------------------------

    def _next_frame(self, timeout_s: float) -> StereoFrame | None:
        if self._source is None:
            self._reconnect_when_due(timeout_s)
            return None
        try:
            return self._source.take(timeout_s)
        except EndOfSequence:
            self._is_over = True
            self._event("end", "the sequence is at its end")
        except DeviceError as error:
            self._camera_lost(error)
        return None

    def _handle_frame(self, frame: StereoFrame) -> None:
        self._last_frame_ns = self._clock.now_ns()
        self._last_sequence = frame.sequence
        if self._state is SessionState.STARTING:
            self._change(SessionState.READY, "pictures arrive")
        self._tracked = self._look_for_bone(frame)
        self._tracked_at_ns = frame.captured_ns
        self._change_with_verdict()
        snapshot = self._decided()
        picture, overlay_ms = self._show(frame, snapshot)
        timings = self._tracked.timings if self._tracked is not None else StageTimings()
        timings = replace(timings, overlay=overlay_ms)
        result = FrameResult(
            frame, self._state, self._stage, self._tracked, picture, timings, snapshot.is_navigable
        )
        is_stepped = self._devices.camera.info.is_stepped
        age_ms = (self._clock.now_ns() - frame.captured_ns) / 1e6
        self._meter.add(timings.total if is_stepped else age_ms, frame.skew_ns)
        for listener in self._hooks.on_frame:
            listener(result)

    def _look_for_bone(self, frame: StereoFrame) -> TrackedFrame | None:
        """Register, review or follow, as the state asks."""
        line = self._line()
        if line is None:
            return None
        if self._state is SessionState.REGISTERING:
            if self._registration is None:
                self._registration = Registration(
                    line, frame, self._prior, self._goal(), self._executor
                )
                self._take_over_registration(frame.sequence)
            return self._candidates[0].tracked if self._candidates else None
        if self._state is SessionState.REVIEW:
            return self._review(line, frame)
        if self._state in (SessionState.NAVIGATING, SessionState.SUSPENDED):
            tracked, track = line.track(
                frame.left, frame.right, frame.captured_ns, self._tracks[self._stage.bone],
                self._goal(),
            )  # fmt: skip
            self._tracks[self._stage.bone] = track
            return tracked
        return None

    def _review(self, line: Line, frame: StereoFrame) -> TrackedFrame:
        """Follow the candidate, or judge a proposed pose where it stands."""
        candidate = self._candidates[0]
        if candidate.is_held:
            pose = candidate.track.left_from_bone
            tracked = line.assess(frame.left, frame.right, pose, self._goal())
            track = candidate.track
        else:
            tracked, track = line.track(
                frame.left, frame.right, frame.captured_ns, candidate.track, self._goal()
            )
        self._candidates[0] = replace(candidate, tracked=tracked, track=track)
        return tracked

    def _change_with_verdict(self) -> None:
        if self._tracked is None:
            return
        is_lost = self._tracked.verdict.status is Status.LOST
        if self._state is SessionState.NAVIGATING and is_lost:
            why = self._tracked.verdict.reasons
            text = f"bone lost: {why[0].value}" if why else "bone lost"
            self._change(SessionState.SUSPENDED, text, EventLevel.ALARM)
        elif self._state is SessionState.SUSPENDED and not is_lost:
            self._change(SessionState.NAVIGATING, "bone found again")

    def _show(self, frame: StereoFrame, snapshot: Snapshot) -> tuple[OverlayPicture, float]:
        """Compose, show until it expires, keep a preview."""
        import time

        started_ns = time.perf_counter_ns()
        image = compose(frame.left, snapshot, self._rig, self._plan, self._mark())
        valid_until_ns = frame.captured_ns + round(self._options.overlay_valid_ms * 1e6)
        overlay_ms = (time.perf_counter_ns() - started_ns) / 1e6
        display = self._devices.display
        if not self._is_blanked:
            try:
                display.show(fitted(image, display.info.width, display.info.height), valid_until_ns)
                self._display_trouble = ""
            except DeviceError as error:
                if not self._display_trouble:
                    self._event("device", str(error), EventLevel.ALARM)
                self._display_trouble = str(error)
        self._preview = make_preview(image)
        age_ns = self._clock.now_ns() - frame.captured_ns
        return OverlayPicture(image, valid_until_ns, OverlayMode.VIDEO, age_ns), overlay_ms

    # -- registration ---------------------------------------------------------------------------

    def _take_over_registration(self, next_sequence: int) -> None:
        """Bring the candidates of a finished registration under review."""
        registration = self._registration
        if registration is None or not registration.is_due(next_sequence):
            return
        self._registration = None
        for listener in self._hooks.on_take_over:
            listener(next_sequence)
        if isinstance(registration.error, JobCancelled):
            return
        if registration.error is not None:
            raise registration.error
        self._candidates = registration.candidates()
        if self._candidates:
            best = self._candidates[0]
            bound = best.tracked.verdict.predicted_tre_mm
            text = f"candidate 1 of {best.count}" + (
                "" if bound is None else f", predicted error {bound:.2f} mm"
            )
            self._change(SessionState.REVIEW, text)
            return
        failure = registration.failure()
        why = failure.verdict.reasons if failure is not None else ()
        text = why[0].value if why else f"no start pose is known for the {self._stage.bone}"
        self._change(SessionState.READY, f"registration failed: {text}", EventLevel.WARNING)

    def _drop_registration(self) -> None:
        if self._registration is not None:
            self._registration.cancel()
            self._registration = None
        self._candidates = []

    # -- commands -------------------------------------------------------------------------------

    def _handle(self, command: Command) -> None:
        for listener in self._hooks.on_command:
            listener(command, self._last_sequence)
        handlers: dict[type, Callable[[], None]] = {
            Register: self._on_register,
            Cancel: self._on_cancel,
            Accept: self._on_accept,
            Reject: self._on_reject,
            Blank: self._on_blank,
            Show: self._on_show,
            Reconnect: self._on_reconnect,
            Quit: self._on_quit,
        }
        if isinstance(command, Propose):
            self._on_propose(command)
        elif isinstance(command, EnterStage):
            self._on_enter_stage(command)
        else:
            handlers[type(command)]()

    def _on_register(self) -> None:
        if self._line() is None or self._state is SessionState.FAULT:
            self._refuse("register", "it needs a camera and a bone in the plan")
            return
        self._drop_registration()
        self._tracked = None
        self._change(SessionState.REGISTERING, f"searching for the {self._stage.bone}")

    def _on_cancel(self) -> None:
        if self._state is not SessionState.REGISTERING:
            self._refuse("cancel", "no registration is running")
            return
        self._drop_registration()
        self._fall_back("registration cancelled")

    def _on_propose(self, command: Propose) -> None:
        if self._line() is None or self._state is SessionState.FAULT:
            self._refuse("propose", "it needs a camera and a bone in the plan")
            return
        self._drop_registration()
        track = TrackState.at_rest(command.left_from_bone, self._last_frame_ns)
        unknown = TrackedFrame(self._stage.bone, None, _unknown_verdict(), StageTimings())
        self._candidates = [Candidate(track, unknown, is_held=True)]
        self._change(SessionState.REVIEW, "a pose was proposed by hand")

    def _on_accept(self) -> None:
        if self._state is not SessionState.REVIEW:
            self._refuse("accept", "no candidate is under review")
            return
        candidate = self._candidates[0]
        verdict = candidate.tracked.verdict
        if verdict.status is Status.LOST:
            self._refuse("accept", "the judge calls this candidate lost")
            return
        self._tracks[self._stage.bone] = candidate.track
        self._candidates = []
        bound = verdict.predicted_tre_mm
        error = "" if bound is None else f", predicted error {bound:.2f} mm"
        self._change(SessionState.NAVIGATING, f"registration accepted{error}")

    def _on_reject(self) -> None:
        if self._state is not SessionState.REVIEW:
            self._refuse("reject", "no candidate is under review")
            return
        candidate = self._candidates.pop(0)
        self._tracked = None
        text = f"candidate {candidate.number} of {candidate.count} rejected by the operator"
        if self._candidates:
            self._event("reject", text)
        else:
            self._fall_back(text)

    def _on_blank(self) -> None:
        self._is_blanked = True
        self._devices.display.blank()
        self._event("blank", "display blanked by the operator")

    def _on_show(self) -> None:
        if self._is_blanked:
            self._is_blanked = False
            self._event("show", "display shown again")

    def _on_enter_stage(self, command: EnterStage) -> None:
        try:
            stage = stage_by_number(command.number)
        except UsageError as error:
            self._refuse("stage", str(error))
            return
        if stage is not self._stage:
            self._enter_stage(stage)

    def _on_reconnect(self) -> None:
        if self._source is None:
            self._retry_at_ns = 0
        else:
            self._refuse("reconnect", "no device is lost")

    def _on_quit(self) -> None:
        self._is_over = True
        self._devices.display.blank()
        self._event("quit", "session ended by the operator")

    def _enter_stage(self, stage: StageSpec) -> None:
        """Make a stage the one in force; its bone may have to be registered."""
        is_other_bone = stage.bone != self._stage.bone
        self._stage = stage
        for listener in self._hooks.on_stage:
            listener(stage.name)
        self._event("stage", f"stage {stage.number} {stage.name} entered")
        if is_other_bone and self._state not in (SessionState.STARTING, SessionState.FAULT):
            self._drop_registration()
            self._tracked = None
            self._fall_back(f"the {stage.bone} is now the bone to follow")

    def _fall_back(self, text: str) -> None:
        """To where the session stands without a candidate."""
        is_known = self._stage.bone in self._tracks
        self._change(SessionState.SUSPENDED if is_known else SessionState.READY, text)

    # -- devices --------------------------------------------------------------------------------

    def _camera_lost(self, error: DeviceError) -> None:
        """Dark, and try to open it again from time to time."""
        self._devices.display.blank()
        self._camera_trouble = str(error)
        if self._source is not None:
            self._source.close()
            self._source = None
        self._drop_registration()
        self._tracked = None
        self._retry_at_ns = self._clock.now_ns() + _RECONNECT_EVERY_NS
        self._change(SessionState.FAULT, str(error), EventLevel.ALARM)

    def _reconnect_when_due(self, timeout_s: float) -> None:
        now_ns = self._clock.now_ns()
        if now_ns < self._retry_at_ns:
            # A stepped clock only moves when somebody waits.
            self._clock.wait_until_ns(min(self._retry_at_ns, now_ns + round(timeout_s * 1e9)))
            return
        self._retry_at_ns = now_ns + _RECONNECT_EVERY_NS
        reopen = self._hooks.reopen_camera
        if reopen is None:
            self._is_over = True
            return
        try:
            camera = reopen()
        except DeviceError as error:
            self._camera_trouble = str(error)
            return
        self._devices = replace(self._devices, camera=camera)
        self._source = open_source(camera)
        self._camera_trouble = ""
        self._last_frame_ns = self._clock.now_ns()
        self._state = SessionState.READY
        self._fall_back(f"camera {camera.info.name} is back")

    def _device_lines(self) -> tuple[DeviceLine, ...]:
        camera, display = self._devices.camera.info, self._devices.display.info
        mirror, projector = self._devices.mirror.info, self._devices.projector.status()
        is_absent = projector.power is PowerState.ABSENT
        return (
            DeviceLine(
                "camera",
                camera.name,
                DeviceHealth.LOST if self._camera_trouble else DeviceHealth.OK,
                self._camera_trouble or f"{camera.width}x{camera.height}",
            ),
            DeviceLine(
                "display",
                display.name,
                DeviceHealth.TROUBLE if self._display_trouble else DeviceHealth.OK,
                self._display_trouble or f"{display.width}x{display.height}",
            ),
            DeviceLine(
                "projector",
                self._devices.projector.name,
                DeviceHealth.ABSENT if is_absent else DeviceHealth.OK,
                projector.power.value,
            ),
            DeviceLine(
                "mirror",
                mirror.name,
                DeviceHealth.OK if mirror.is_movable else DeviceHealth.ABSENT,
                "movable" if mirror.is_movable else "fixed",
            ),
        )

    # -- small parts ----------------------------------------------------------------------------

    def _line(self) -> Line | None:
        """The line of the active bone; None when the plan has no model of it."""
        name = self._stage.bone
        if name not in self._lines and name in self._plan.bones:
            self._lines[name] = Line(self._rig, self._plan.bones[name], self._options.line)
        return self._lines.get(name)

    def _goal(self) -> Goal:
        return Goal(self._plan.targets_of(self._stage.targets), self._stage.tolerance_mm)

    def _mark(self) -> str:
        return "SIMULATED" if self._devices.camera.info.is_simulated else ""

    def _change(self, state: SessionState, text: str, level: EventLevel = EventLevel.INFO) -> None:
        self._state = state
        self._event("state", text, level)

    def _refuse(self, what: str, why: str) -> None:
        self._event("refused", f"{what} refused: {why}", EventLevel.WARNING)

    def _event(self, kind: str, text: str, level: EventLevel = EventLevel.INFO) -> None:
        event = Event(self._clock.now_ns(), kind, text, level, self._last_sequence)
        self._events.append(event)
        for listener in self._hooks.on_event:
            listener(event)

    def _decided(self) -> Snapshot:
        """The snapshot with the interlocks' answer in it."""
        now_ns = self._clock.now_ns()
        tracked = self._tracked
        is_silent = self._source is not None and now_ns - self._last_frame_ns > _SILENT_AFTER_NS
        draft = Snapshot(
            time_ns=now_ns,
            state=self._state,
            stage=self._stage,
            stages=STAGES,
            reasons=(),
            is_blanked=self._is_blanked,
            verdict=None if tracked is None else tracked.verdict,
            left_from_bone=None if tracked is None else tracked.left_from_bone,
            is_candidate=self._state is SessionState.REVIEW and tracked is not None,
            pose_age_ms=None if tracked is None else (now_ns - self._tracked_at_ns) / 1e6,
            preview=self._preview,
            rates=self._meter.rates(0 if self._source is None else self._source.n_dropped),
            devices=self._device_lines(),
            events=tuple(self._events),
            progress=self._progress(),
            rig_name=self._options.rig_name,
            plan_name=self._plan.name,
            plan_digest=self._plan.digest,
            side=self._side(),
            sequence=self._last_sequence,
            is_bone_planned=self._stage.bone in self._plan.bones,
            is_camera_silent=is_silent,
            is_over=self._is_over,
        )
        return replace(draft, reasons=navigable(draft))

    def _progress(self) -> Progress | None:
        if self._registration is not None:
            return Progress(f"searching for the {self._stage.bone}", self._registration.progress)
        if self._state is SessionState.STARTING:
            return Progress("waiting for the first picture", 0.0)
        return None

    def _side(self) -> str:
        bone = self._plan.bones.get(self._stage.bone)
        return "" if bone is None or bone.side is None else bone.side


def _unknown_verdict() -> Verdict:
    """Of a pose that no frame has judged yet: it cannot be accepted."""
    return Verdict(Status.LOST)
