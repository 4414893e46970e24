"""A room without pictures: black frames, and trackers that answer what the test says."""

import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from drivers.clock import Clock, ManualClock
from drivers.fixed_mirror import FixedMirror
from drivers.frames import StereoFrame
from drivers.interfaces import (
    CameraInfo,
    DeviceSet,
    MirrorMount,
    ProjectorControl,
    StereoCamera,
)
from drivers.no_projector import NoProjector
from navapp.control.board_watch import BoardWatch
from navapp.control.calibrated_display import CalibratedDisplay
from navapp.control.check_points import LocateCorners
from navapp.control.commands import (
    Accept,
    Command,
    Register,
    Reject,
)
from navapp.control.controller import SessionController
from navapp.control.event_log import SessionHooks
from navapp.control.executors import Executor, InlineExecutor, Job, ThreadExecutor
from navapp.control.eye_preview import EyePreview, Look
from navapp.control.frame_result import FrameResult
from navapp.control.specification import SessionSpecification
from navapp.control.states import (
    DeviceLine,
    Event,
    Snapshot,
)
from navapp.errors import DeviceLost, DeviceTimeout, EndOfSequence
from navapp.geometry.camera import Camera
from navapp.geometry.rig import StereoRig
from navapp.geometry.transform import RigidTransform, rotation_from_vector
from navapp.tools.tool import Tool, ToolKind
from navapp.tracking import Goal, TrackState
from navapp.values import (
    BoneModel,
    FrameTimings,
    Plan,
    PoseEstimate,
    Prior,
    Reason,
    Status,
    StereoPictures,
    TrackedFrame,
    Verdict,
)
from sim_devices.display import SimulatedDisplay
from tests.registration.shapes import grid_mesh

WIDTH, HEIGHT = 320, 240
PERIOD_NS = 66_000_000
# Rows that neither the banner nor the mark reaches: on black pictures they show guides only.
CLEAR = slice(60, 180)


def a_rig(name: str = "sim:rig") -> StereoRig:
    matrix = np.array([[200.0, 0, 159.5], [0, 200.0, 119.5], [0, 0, 1]])
    camera = Camera(matrix, np.zeros(0), WIDTH, HEIGHT)
    shift = RigidTransform.from_parts("right", "left", np.eye(3), (-60.0, 0.0, 0.0))
    return StereoRig(camera, camera, shift, ("L1", "R1"), name=name)


def a_plan(*bones: str) -> Plan:
    mesh = grid_mesh(lambda x, y: 0.01 * (x * x + y * y), 40.0, 8.0)
    return Plan({name: BoneModel(name, mesh, "right") for name in bones or ("femur", "tibia")})


def a_pose(bone: str = "femur", x_mm: float = 0.0, turn_deg: float = 0.0) -> RigidTransform:
    rotation = rotation_from_vector((0.0, np.radians(turn_deg), 0.0))
    return RigidTransform.from_parts("left", bone, rotation, (x_mm, 0.0, 300.0))


def answer(
    status: Status = Status.OK,
    *reasons: Reason,
    pose: RigidTransform | None = None,
    has_pose: bool = True,
) -> TrackedFrame:
    """What a tracker says of a frame."""
    pose = pose or a_pose()
    # 0.1 mm and 1 mrad.
    covariance = np.diag([1e-2] * 3 + [1e-6] * 3)
    estimate = PoseEstimate(pose, covariance, 500, 0.9, 0.2, 0.2, 3, True)
    bound = 0.8 if has_pose else None
    verdict = Verdict(status, bound, reasons, 0.7, 0.0, 0.9, 0.2, 0.2)
    return TrackedFrame(pose.source, estimate if has_pose else None, verdict, FrameTimings())


def a_frame(captured_ns: int = 10**9, sequence: int = 0) -> StereoFrame:
    picture = np.zeros((HEIGHT, WIDTH), dtype=np.uint8)
    return StereoFrame(picture, picture, captured_ns, captured_ns, 0, sequence, "rig")


@dataclass
class Script:
    """What the fake trackers answer; changed by the test as it goes."""

    found: list[TrackedFrame] = field(default_factory=lambda: [answer()])
    tracked: TrackedFrame = field(default_factory=answer)
    tracked_of: dict[str, TrackedFrame] = field(default_factory=dict)
    assessed: TrackedFrame = field(default_factory=answer)
    gate: threading.Event | None = None
    started: threading.Event = field(default_factory=threading.Event)
    error: Exception | None = None
    calls: list[str] = field(default_factory=list)
    tracks: list[tuple[str, TrackState, Goal]] = field(default_factory=list)
    priors: list[Prior] = field(default_factory=list)
    pictures: list[StereoPictures] = field(default_factory=list)
    on_track: Callable[[str], object] = lambda bone: None


class FakeTracker:
    """Stands for a `navapp.tracking.Tracker`."""

    def __init__(self, script: Script, bone: BoneModel) -> None:
        self.script, self.bone = script, bone

    def register(self, pictures, prior, goal, on_progress=lambda share: None):
        self.script.calls.append(f"register {self.bone.name}")
        self.script.priors.append(prior)
        self.script.pictures.append(pictures)
        self.script.started.set()
        on_progress(0.5)
        if self.script.gate is not None:
            self.script.gate.wait(10.0)
        on_progress(1.0)
        if self.script.error is not None:
            raise self.script.error
        return list(self.script.found)

    def track(self, pictures, state: TrackState, goal):
        self.script.calls.append(f"track {self.bone.name}")
        return self._follow(pictures, state, goal)

    def glance(self, pictures, state: TrackState, goal):
        self.script.calls.append(f"glance at {self.bone.name}")
        return self._follow(pictures, state, goal)

    def _follow(self, pictures, state: TrackState, goal):
        self.script.pictures.append(pictures)
        self.script.tracks.append((self.bone.name, state, goal))
        self.script.on_track(self.bone.name)
        tracked = self.script.tracked_of.get(self.bone.name, self.script.tracked)
        return tracked, state.update(tracked, pictures.captured_ns, np.zeros(3))

    def assess(self, pictures, left_from_bone, goal):
        self.script.calls.append(f"assess {self.bone.name}")
        self.script.pictures.append(pictures)
        tracked = self.script.assessed
        if tracked.estimate is None:
            return tracked
        return replace(tracked, estimate=replace(tracked.estimate, camera_from_bone=left_from_bone))


class SlowExecutor(InlineExecutor):
    """Holds jobs back until they are let go."""

    def __init__(self) -> None:
        self.held: list[Job[Any]] = []

    def start(self, job: Job[Any]) -> None:
        self.held.append(job)

    def let_go(self) -> None:
        while self.held:
            self.held.pop(0).run()


class FakeCamera:
    """Black pictures, one a read; moves the manual clock by a period each."""

    def __init__(self, clock: ManualClock, n_frames: int | None = None) -> None:
        self._clock = clock
        self._sequence = 0
        self._n_frames = n_frames
        self.is_open = False
        self.is_silent = False
        self.error: Exception | None = None
        self.opening_error: Exception | None = None

    @property
    def info(self) -> CameraInfo:
        return CameraInfo("fake camera", "fake", False, True, WIDTH, HEIGHT, ("L1", "R1"))

    def open(self) -> None:
        if self.opening_error is not None:
            raise self.opening_error
        self.is_open = True

    def read(self, timeout_s: float) -> StereoFrame:
        if not self.is_open:
            raise DeviceLost("the fake camera is closed")
        if self.error is not None:
            raise self.error
        if self.is_silent:
            self._clock.advance_ns(round(timeout_s * 1e9))
            raise DeviceTimeout("no frame")
        if self._n_frames is not None and self._sequence >= self._n_frames:
            raise EndOfSequence("over")
        self._clock.advance_ns(PERIOD_NS)
        frame = a_frame(self._clock.now_ns(), self._sequence)
        self._sequence += 1
        return frame

    def set(self, control: str, value: float) -> float:
        raise NotImplementedError

    def close(self) -> None:
        self.is_open = False


class Bench:
    """A controller on fakes, and what came out of it."""

    def __init__(
        self,
        *,
        executor: Executor | None = None,
        plan: Plan | None = None,
        prior: Prior | None = None,
        others: tuple[str, ...] = (),
        overlay_valid_ms: float = 500.0,
        layers: tuple[str, ...] | None = None,
        made_steps: tuple[str, ...] = (),
        has_gates: bool = False,
        tools: Mapping[ToolKind, Tool] | None = None,
        can_reopen: bool = True,
        camera: StereoCamera | None = None,
        clock: Clock | None = None,
        projector: ProjectorControl | None = None,
        mirror: MirrorMount | None = None,
        hooks: SessionHooks | None = None,
        board_watch: BoardWatch | None = None,
        locate_corners: LocateCorners | None = None,
        make_display: Callable[[Clock, int, int], SimulatedDisplay] = SimulatedDisplay,
        calibrated_display: CalibratedDisplay | None = None,
        display_delay_ms: float = 0.0,
        look: Look | None = None,
    ) -> None:
        self.script = Script()
        self.trackers: dict[str, FakeTracker] = {}
        self.clock = clock or ManualClock(10**9)
        self.camera = camera or FakeCamera(self.clock)
        if isinstance(self.camera, FakeCamera):
            self.camera._clock = self.clock
        self.display = make_display(self.clock, WIDTH, HEIGHT)
        self.events: list[Event] = []
        self.results: list[FrameResult] = []
        self.take_overs: list[int] = []
        self.camera.open()
        self.display.open()
        given = hooks or SessionHooks()
        self.controller = SessionController(
            DeviceSet(
                self.camera, self.display, projector or NoProjector(),
                mirror or FixedMirror(45.0), self.clock,
            ),
            SessionSpecification(
                a_rig(),
                plan or a_plan(),
                prior or Prior({"femur": a_pose()}),
                others=others,
                overlay_valid_ms=overlay_valid_ms,
                display=calibrated_display,
                display_delay_ms=display_delay_ms,
                layers=layers,
                made_steps=made_steps,
                has_gates=has_gates,
                tools=tools or {},
            ),
            executor=executor or InlineExecutor(),
            board_watch=board_watch,
            locate_corners=locate_corners,
            eye=EyePreview(look, InlineExecutor()),
            make_tracker=self._make_tracker,
            hooks=replace(
                given,
                on_frame=(self.results.append, *given.on_frame),
                on_event=(self.events.append, *given.on_event),
                on_take_over=(self.take_overs.append, *given.on_take_over),
                reopen_camera=self._reopen if can_reopen else None,
            ),
        )  # fmt: skip

    def _make_tracker(self, rig, bone: BoneModel, settings, aspects) -> FakeTracker:
        self.trackers[bone.name] = FakeTracker(self.script, bone)
        return self.trackers[bone.name]

    def _reopen(self) -> StereoCamera:
        self.camera.open()
        return self.camera

    @property
    def snapshot(self) -> Snapshot:
        return self.controller.snapshot

    @property
    def state(self) -> str:
        return self.snapshot.state.value

    @property
    def shows_guides(self) -> bool:
        """Anything is drawn over the black video."""
        return bool(self.display.visible_image()[CLEAR].any())

    @property
    def is_dark(self) -> bool:
        return not self.display.visible_image().any()

    def frames(self, n: int = 1) -> Snapshot:
        for _ in range(n):
            self.controller.step()
        return self.snapshot

    def until(self, condition: Callable[[], bool], within_s: float) -> None:
        """Go on, frame by frame, until it is so."""
        end_s = time.monotonic() + within_s
        while not condition():
            assert time.monotonic() < end_s
            self.frames(1)
            time.sleep(0.02)

    def line(self, kind: str) -> DeviceLine:
        """Of the devices panel."""
        return next(line for line in self.snapshot.devices if line.kind == kind)

    def do(self, command: Command) -> Snapshot:
        """Give a command and have it handled."""
        self.controller.submit(command)
        return self.controller.step()

    def accept(self) -> Snapshot:
        """What is under review, whether it was seen or not."""
        return self.do(Accept(None))

    def reject(self) -> Snapshot:
        """What is under review, whether it was seen or not."""
        return self.do(Reject(None))

    def refused(self) -> str:
        """What was refused last."""
        return next((e.text for e in reversed(self.events) if e.kind == "refused"), "")


def navigating(bench: Bench) -> Bench:
    """Registered, accepted, and one frame on."""
    bench.frames(1)
    bench.do(Register())
    bench.frames(1)
    bench.accept()
    bench.frames(1)
    assert bench.state == "navigating"
    return bench


@contextmanager
def hanging_registration() -> Iterator[Bench]:
    """A bench whose registration has begun on its worker and waits for the script's gate."""
    bench = Bench(executor=ThreadExecutor())
    gate = bench.script.gate = threading.Event()
    try:
        bench.frames(1)
        bench.do(Register())
        bench.frames(1)
        assert bench.script.started.wait(5.0)
        yield bench
    finally:
        gate.set()
        bench.controller.close()


def wait_for(condition: Callable[[], bool], what: str, timeout_s: float = 10.0) -> None:
    """Poll something that another thread brings about."""
    end = time.monotonic() + timeout_s
    while not condition():
        assert time.monotonic() < end, f"waited in vain for {what}"
        time.sleep(0.002)


LOST = answer(Status.LOST, Reason.COVERAGE_LOW)
GONE = answer(Status.LOST, Reason.OUT_OF_VIEW, has_pose=False)
DOUBTED = answer(Status.DEGRADED, Reason.TRE_TOO_LARGE)
