"""The session controller: owns the loop, the states and the devices.

    OFFLINE -> STARTING -> READY -> REGISTERING -> REVIEW -> NAVIGATING <-> SUSPENDED
    FAULT from everywhere: when the camera is lost, and back to READY or SUSPENDED when it returns;
    when the rig has moved, and never back.

`step` handles one command or one frame and returns a snapshot. The controller never sees the truth.
"""

import threading
from collections import deque
from dataclasses import replace

from drivers.clock import Clock
from drivers.frames import StereoFrame
from drivers.interfaces import DeviceSet
from navapp.control.beside_femur import BesideFemur
from navapp.control.board_watch import BoardWatch
from navapp.control.bone_motion import BoneMotion
from navapp.control.bone_tracks import BoneTracks
from navapp.control.camera_link import CameraLink
from navapp.control.check_points import LocateCorners
from navapp.control.command_handler import CommandHandler
from navapp.control.commands import Blank, Command
from navapp.control.device_handlers import MirrorHandler, ProjectorHandler
from navapp.control.device_monitor import MonitoredDevices, tell_changes
from navapp.control.display_link import DisplayLink
from navapp.control.event_log import EventLog, SessionHooks
from navapp.control.executors import Executor, InlineExecutor
from navapp.control.eye_preview import EyePreview
from navapp.control.frame_presenter import FramePresenter
from navapp.control.frame_result import FrameResult
from navapp.control.gate_keeper import GateKeeper
from navapp.control.gates import Gates
from navapp.control.interlocks import MAX_POSE_AGE_MS, grow_older
from navapp.control.layer_choice import LayerChoice
from navapp.control.made_steps import MadeSteps
from navapp.control.mirror_checking import MirrorChecking
from navapp.control.mirror_judging import MirrorJudge
from navapp.control.other_bones import AskedBones, OtherBones
from navapp.control.patient_checking import PatientChecking
from navapp.control.pictures import Composer
from navapp.control.rates import RateMeter
from navapp.control.registration_job import RegistrationJob
from navapp.control.rig_watch import RigWatch
from navapp.control.session import Session
from navapp.control.snapshot_maker import SnapshotMaker
from navapp.control.specification import SessionSpecification
from navapp.control.states import SessionState, Snapshot, StepLine, ToolReading
from navapp.control.tool_watch import ToolWatch
from navapp.control.trackers import MakeTracker, Trackers
from navapp.errors import DeviceError, EndOfSequence, NavappError
from navapp.geometry.rectification import rectifier_of
from navapp.geometry.rig import StereoRig
from navapp.overlay import DepthMarks
from navapp.tools.tool import ToolKind
from navapp.tracking import make_tracker
from navapp.values import FrameTimings, StageSpec


class SessionController:
    """Runs one session on an opened set of devices.

    Attributes:
        lost_device: why the camera is lost; None when it is not.
    """

    def __init__(
        self,
        devices: DeviceSet,
        specification: SessionSpecification,
        *,
        executor: Executor,
        other_executor: Executor | None = None,
        hooks: SessionHooks | None = None,
        board_watch: BoardWatch | None = None,
        locate_corners: LocateCorners | None = None,
        eye: EyePreview | None = None,
        make_tracker: MakeTracker = make_tracker,
    ) -> None:
        """Bring the devices to their places; no frame is taken yet.

        Args:
            devices: opened; closed with the controller.
            specification: of the session.
            executor: runs first registrations.
            other_executor: runs searches for the other bones; None: at once.
            hooks: who is told what.
            board_watch: looks for a known length; None: nobody does.
            locate_corners: of a board, for the check of the mirror; None: no board is known.
            eye: looks into a simulated mirror; None: nobody does.
            make_tracker: makes the tracker of a bone.
        """
        hooks = hooks or SessionHooks()
        rig, plan = specification.rig, specification.plan
        self._devices = devices
        self._mirror_checking = MirrorChecking(
            specification.display, rectifier_of(rig).geometry, locate_corners
        )
        composer = Composer(rig, plan, self._mirror_checking.view)
        self._eye = eye or EyePreview(None, InlineExecutor())
        self._executor = executor
        self._camera = CameraLink(devices.camera, devices.clock, hooks.reopen_camera)
        self._display = DisplayLink(devices.display)
        self.lost_device: DeviceError | None = None
        self._queue: deque[Command] = deque()
        self._lock = threading.Lock()
        self._session = _make_session(
            devices.clock, specification, hooks, executor, other_executor or InlineExecutor(),
            make_tracker,
        )  # fmt: skip
        self._tools = ToolWatch(specification.tools, rig, plan)
        self._patient = PatientChecking(
            self._session, self._tools, plan, rig, specification.check_minutes
        )
        gates = self._gates = GateKeeper(
            self._session,
            Gates(
                plan, self._session,
                are_asked=specification.has_gates, check_minutes=specification.check_minutes,
                rig_made_on=_made_on(rig),
            ),
            self._patient,
        )  # fmt: skip
        self._rig_watch = RigWatch(self._session, self._display, BoneMotion(rig, plan), board_watch)
        self._presenter = FramePresenter(
            self._session, self._display, composer, self._mirror_checking, self._eye,
            DepthMarks(rig), min(specification.overlay_valid_ms, MAX_POSE_AGE_MS),
        )  # fmt: skip
        self._monitored = MonitoredDevices(
            ProjectorHandler(devices.projector, specification.display_model),
            MirrorHandler(devices.mirror, specification.calibrated_mirror_deg),
        )
        self._commands = CommandHandler(
            self._session, self._camera, self._display, self._rig_watch, self._monitored,
            self._mirror_checking, self._eye, plan, gates, self._patient,
        )  # fmt: skip
        self._maker = SnapshotMaker(
            self._session, self._camera, self._display, self._monitored, self._mirror_checking,
            _make_mirror_judge(specification, composer), self._eye, specification,
            self._rig_watch, gates, self._tools, self._patient, hooks.recorder,
        )  # fmt: skip
        self._snapshot = self._maker.make()

    @property
    def failure(self) -> NavappError | None:
        """Why the session stands in FAULT; None when it does not."""
        return self._session.rig_error or self.lost_device

    def steps_of(self, stage: StageSpec) -> tuple[StepLine, ...]:
        """The steps of a stage: planned, made, measured."""
        return self._session.steps_of(stage)

    @property
    def snapshot(self) -> Snapshot:
        """The newest one, as of when it was made."""
        return self._snapshot

    def snapshot_now(self) -> Snapshot:
        """The newest one, judged at this moment; callable from any thread."""
        # The operator may have blanked the display while a step hangs.
        newest = replace(self._snapshot, is_blanked=self._display.is_blanked)
        return grow_older(newest, self._session.now_ns)

    def submit(self, command: Command) -> None:
        """Queue a command; callable from any thread, never blocks."""
        with self._lock:
            self._queue.append(command)
        if isinstance(command, Blank):
            # The operator's hand comes before everything else, also before a step that hangs.
            self._display.blank()

    def darken(self) -> None:
        """Turn the display dark, now; callable from any thread, also while a step hangs."""
        self._display.darken()

    def step(self, timeout_s: float = 0.2) -> Snapshot:
        """Handle one command, or one frame; return at the latest after the time given."""
        session = self._session
        with self._lock:
            command = self._queue.popleft() if self._queue else None
        if command is not None:
            session.tell_command(command)
            self._commands.handle(command, self._maker.make())
        else:
            session.take_over(session.sequence + 1)
            self._rig_watch.take_over()
            frame = self._next_frame(timeout_s)
            if frame is not None:
                self._handle_frame(frame)
        self._monitored.tell_answers(session)
        before, self._snapshot = self._snapshot, self._make_snapshot()
        if self._snapshot.device_reasons:
            self._display.darken()
        else:
            self._presenter.withdraw(before, self._snapshot)
        tell_changes(session, before, self._snapshot)
        return self._snapshot

    def close(self) -> None:
        """End everything: dark first, then what moves; safe to call twice."""
        self._display.darken()
        self._monitored.close()
        # Last of the three: an attempt to open a lost display may take many seconds.
        self._display.close()
        self._session.close()
        self._executor.close()
        self._rig_watch.close()
        self._eye.close()
        self._camera.close()
        self._devices.close()
        self._session.go_offline()
        self._snapshot = self._maker.make()

    def _make_snapshot(self) -> Snapshot:
        """As of now; what it says may end a check of the mirror."""
        snapshot = self._maker.make()
        if not snapshot.has_mirror:
            return snapshot
        self._mirror_checking.check_session(snapshot)
        return self._maker.make()

    def _next_frame(self, timeout_s: float) -> StereoFrame | None:
        session = self._session
        if self._camera.is_down:
            if self._camera.wait_for_return(timeout_s):
                self.lost_device = None
                session.fall_back(f"camera {self._camera.camera.info.name} is back")
            return None
        try:
            return self._camera.take(timeout_s)
        except EndOfSequence:
            session.end("end", "the sequence is at its end")
        except DeviceError as error:
            self._display.darken()
            self.lost_device = error
            session.lose_camera(str(error), can_return=self._camera.can_return)
        return None

    def _handle_frame(self, frame: StereoFrame) -> None:
        session = self._session
        session.begin_frame(frame)
        self._mirror_checking.keep_frame(frame)
        session.look_for_bone(frame)
        self._rig_watch.check_frame(frame)
        snapshot = self._make_snapshot()
        picture, overlay_ms = self._presenter.show(frame, snapshot)
        version = session.bone_version
        # Only now: the active bone's picture never waits for another bone.
        others = session.follow_others(frame)
        measured = session.measure_steps(frame)
        tools = self._follow_tools(frame)
        timings = FrameTimings() if session.tracked is None else session.tracked.timings
        result = FrameResult(
            frame,
            session.state,
            session.stage,
            session.tracked,
            picture,
            replace(timings, overlay_ms=overlay_ms),
            snapshot.is_navigable,
            others,
            measured,
            version,
            session.measure_limb(frame, others),
            tools,
        )
        # The age of a frame that waits to be read says when it was asked for.
        is_stepped = self._camera.camera.info.is_stepped
        session.end_frame(result, None if is_stepped else picture.pose_age_ns / 1e6)

    def _follow_tools(self, frame: StereoFrame) -> dict[ToolKind, ToolReading]:
        """Look for tools in a frame, and take the touch that the operator has asked for."""
        session = self._session
        is_accepted = session.state is SessionState.NAVIGATING
        tools = self._tools.follow(
            frame, session.tracked if is_accepted else None, session.stage,
            session.bone_version, session.bone_surface,
        )  # fmt: skip
        answer = self._patient.add(tools.get("pointer"), session.stage)
        if answer is not None:
            self._gates.take_check(answer)
        return tools


def _make_mirror_judge(
    specification: SessionSpecification, composer: Composer
) -> MirrorJudge | None:
    display, view = specification.display, composer.mirror_view
    if display is None or view is None:
        return None
    return MirrorJudge(display, view, specification.plan)


def _make_session(
    clock: Clock,
    specification: SessionSpecification,
    hooks: SessionHooks,
    executor: Executor,
    other_executor: Executor,
    make_tracker: MakeTracker,
) -> Session:
    plan = specification.plan
    trackers = Trackers(
        specification.rig,
        plan,
        specification.prior,
        specification.tracker_settings,
        make_tracker,
    )
    tracks, log = BoneTracks(trackers), EventLog(clock, hooks)
    asked = AskedBones(specification.others, specification.is_each, specification.is_live)
    beside = BesideFemur(trackers, plan, other_executor)
    return Session(
        clock,
        log,
        tracks,
        RegistrationJob(trackers, executor),
        OtherBones(tracks, plan, beside, asked, log.tell_other_take_over),
        MadeSteps(plan, trackers, specification.made_steps, specification.frames_between_faces),
        specification.stage,
        LayerChoice(specification.layers),
        RateMeter(specification.display_delay_ms, specification.display_delay_bound_ms),
    )


def _made_on(rig: StereoRig) -> str:
    """The day of a rig's calibration; empty when nobody said."""
    made_on = None if rig.quality is None else rig.quality.made_on
    return "" if made_on is None else made_on.isoformat()
