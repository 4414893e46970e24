"""Composition root: the only place that turns a configuration into opened devices."""

from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Literal

import numpy as np

from calibration.targets.boards import Board
from calibration.targets.drawing import drawn, rastered
from drivers.clock import Clock, ManualClock, SystemClock
from drivers.depthai_settings import DepthaiSettings
from drivers.depthai_stereo import DepthaiStereo
from drivers.escvp21_projector import BAUD_RATE as ESCVP21_BAUD_RATE
from drivers.escvp21_projector import EscVp21Projector
from drivers.fixed_mirror import FixedMirror
from drivers.interfaces import DeviceSet, Display, MirrorMount, ProjectorControl, StereoCamera
from drivers.no_projector import NoProjector
from drivers.opencv_stereo import OpencvStereo, OpencvStereoSettings
from drivers.pjlink_line import TcpConnection
from drivers.pjlink_projector import PjlinkProjector
from drivers.replay_camera import ReplayCamera, ReplaySettings
from drivers.serial_port import SerialAddress
from drivers.uvc_settings import UvcSettings
from drivers.window_display import WindowDisplay
from drivers.window_process import WindowSettings
from drivers.zaber_line import BAUD_RATE as ZABER_BAUD_RATE
from drivers.zaber_mirror import ZaberMirror
from navapp.config import (
    Configuration,
    DisplaySection,
    FaultSection,
    MirrorSection,
    ProjectorSection,
    SimulationSection,
)
from navapp.errors import ConfigurationError, DeviceError, RigError, WrongDevice
from navapp.geometry import Rectifier, RigidTransform, StereoRig, TriangleMesh, read_rig
from navapp.geometry.transform import FloatArray
from sim_devices.camera import Scene, SimulatedCamera
from sim_devices.display import SimulatedDisplay
from sim_devices.faults import Fault, FaultKind, FaultScript
from sim_devices.hand import Hand
from sim_devices.rigs import WORKING_DISTANCE_MM
from sim_devices.scenario import Scenario
from sim_devices.sensor import SensorModel
from sim_devices.sheet import PrintedSheet, SheetInView, SheetScene
from sim_devices.truth import TruthOracle
from sim_devices.world import World

_ENTRY_POINTS = "navapp.devices"
# Of a simulated board: finer than any picture shows it.
_SHEET_PX_PER_MM, _MOST_SHEET_PX, _SHEET_MARGIN_MM = 12.0, 6000.0, 8.0
# A board that waits to be photographed needs no more frames than this.
_STEPPED_CAPTURE_HZ = 5.0


@dataclass(frozen=True, slots=True, eq=False)
class Simulation:
    """What the simulated room hands to its caller, apart from the devices.

    Attributes:
        bones: name -> surface as planned.
        side: of the knee.
        targets: `bone/name` -> point, mm, bone coordinates.
        curves: vessels and nerves beside the femur.
        nominal_left_from_bone: how the knee was laid on the table; rough starts.
        approach_axis, approach_half_angle_deg: of the approach cone.
        oracle: the truth, for evaluation after the run only.
        set_stage: tells the room which stage is in force.
    """

    bones: Mapping[str, TriangleMesh]
    side: Literal["left", "right"]
    targets: Mapping[str, FloatArray]
    curves: Mapping[str, FloatArray]
    nominal_left_from_bone: Mapping[str, RigidTransform]
    approach_axis: FloatArray
    approach_half_angle_deg: float
    oracle: TruthOracle
    set_stage: Callable[[str], None]


@dataclass(frozen=True, slots=True, eq=False)
class OpenedDevices:
    """Opened devices with the rig that took the pictures."""

    devices: DeviceSet
    rig: StereoRig
    reopen_camera: Callable[[], StereoCamera]
    simulation: Simulation | None = None


def open_live(
    configuration: Configuration, *, is_headless: bool, board: Board | None = None
) -> OpenedDevices:
    """Open the configured devices.

    Args:
        configuration: in force.
        board: that is held into a simulated view, when the configuration says so.
        is_headless: nobody watches; a simulated camera then waits to be read.

    Raises:
        DeviceError, RigError, ConfigurationError.
    """
    if configuration.camera.backend == "simulated":
        return _open_simulated(configuration, board, is_headless=is_headless)
    return _open_real(configuration)


@dataclass(frozen=True, slots=True, eq=False)
class OpenedCapture:
    """An opened camera that need not be calibrated yet.

    Attributes:
        camera: opened.
        clock: of its frames.
        reopen: opens it again when it was lost.
        hand: holds the board in front of simulated cameras, else None.
    """

    camera: StereoCamera
    clock: Clock
    reopen: Callable[[], StereoCamera]
    hand: Hand | None = None


def open_capture(configuration: Configuration, board: Board, *, is_headless: bool) -> OpenedCapture:
    """Open the configured camera in front of a board; a simulated one sees a simulated board.

    Args:
        configuration: in force; it need not name a rig.
        board: what a simulated camera is shown.
        is_headless: nobody watches; a simulated camera then waits to be read.

    Raises:
        DeviceError, ConfigurationError.
    """
    if configuration.camera.backend != "simulated":
        clock = SystemClock()
        camera = real_camera(configuration, clock)
        camera.open()
        return OpenedCapture(camera, clock, _reopener(camera, camera.open))
    settings = configuration.camera.simulated
    hand = _hand_with(board, settings.seed)
    scene = SheetScene(_printed(board), hand.left_from_body)
    is_stepped = is_headless if settings.stepped is None else settings.stepped
    rate_hz = configuration.camera.rate_hz
    sim_clock: Clock = ManualClock() if is_stepped else SystemClock()
    simulated = SimulatedCamera(
        scene,
        sim_clock,
        is_stepped=is_stepped,
        rate_hz=min(rate_hz, _STEPPED_CAPTURE_HZ) if is_stepped else rate_hz,
        scale=settings.scale,
        sensor=SensorModel(seed=settings.seed, is_grey=settings.grey),
        faults=FaultScript(tuple(_fault(section) for section in settings.faults)),
        skew_ns=round(settings.skew_ms * 1e6),
    )
    simulated.open()
    return OpenedCapture(simulated, sim_clock, _reopener(simulated, simulated.open), hand)


def _printed(board: Board) -> PrintedSheet:
    drawing = drawn(board)
    px_per_mm = min(_SHEET_PX_PER_MM, _MOST_SHEET_PX / max(board.size_mm))
    left_mm, top_mm = drawing.low_mm - _SHEET_MARGIN_MM
    white = rastered(drawing, px_per_mm, _SHEET_MARGIN_MM)
    return PrintedSheet(white, px_per_mm, float(left_mm), float(top_mm))


def _hand_with(board: Board, seed: int) -> Hand:
    """A hand that holds the board's middle in front of the left camera."""
    middle_mm = board.points_mm.mean(axis=0)
    place_mm = np.array([0.0, 0.0, WORKING_DISTANCE_MM]) - middle_mm
    return Hand(RigidTransform.from_parts("left", "board", np.eye(3), place_mm), middle_mm, seed)


def open_recording(
    source: str, settings: ReplaySettings, rig: StereoRig, configuration: Configuration
) -> OpenedDevices:
    """Open a recorded source as the camera of a stepped session.

    Raises:
        SequenceError: the source; RigError: pictures of another size than the rig's.
    """
    clock = ManualClock()
    camera = ReplayCamera(source, clock, settings, rig_id=rig.rig_id)
    _open_fitting(camera, rig)
    devices = _device_set(configuration, camera, clock, rig, is_live=False)
    return OpenedDevices(devices, rig, _no_reopening)


def _configured_rig(configuration: Configuration) -> StereoRig:
    """The rig file that the configuration names.

    Raises:
        ConfigurationError: it names none.
    """
    if configuration.camera.rig is None:
        raise ConfigurationError(
            "no rig is configured", subject="camera.rig", remedy="give --rig or [camera] rig"
        )
    return read_rig(configuration.camera.rig)


def _open_simulated(
    configuration: Configuration, board: Board | None, *, is_headless: bool
) -> OpenedDevices:
    settings = configuration.camera.simulated
    world = World(_scenario(settings))
    is_stepped = is_headless if settings.stepped is None else settings.stepped
    clock: Clock = ManualClock() if is_stepped else SystemClock()
    camera = SimulatedCamera(
        _with_board(world, board, settings),
        clock,
        is_stepped=is_stepped,
        rate_hz=configuration.camera.rate_hz,
        scale=settings.scale,
        sensor=SensorModel(seed=settings.seed, is_grey=settings.grey),
        faults=FaultScript(tuple(_fault(section) for section in settings.faults)),
        skew_ns=round(settings.skew_ms * 1e6),
    )
    if configuration.camera.rig is not None:
        rig = _configured_rig(configuration)
    else:
        rig = world.rig if settings.scale == 1.0 else world.rig.scaled(settings.scale)
    _open_fitting(camera, rig)
    reopen = _reopener(camera, lambda: _open_fitting(camera, rig))
    devices = _device_set(configuration, camera, clock, rig)
    return OpenedDevices(devices, rig, reopen, _simulation(world, camera))


def _with_board(world: World, board: Board | None, settings: SimulationSection) -> Scene:
    """The room, with a board held into the view when there is one to be shown."""
    if board is None or settings.board_s is None:
        return world
    hand = _hand_with(board, settings.seed)
    from_s, to_s = settings.board_s
    shown_ns = (round(from_s * 1e9), round(to_s * 1e9))
    return SheetInView(world, _printed(board), hand.left_from_body, shown_ns)


def _scenario(settings: SimulationSection) -> Scenario:
    return Scenario(
        seed=settings.seed,
        side=settings.side,
        sex=settings.sex,
        age_group=settings.age_group,
        cartilage_mm=settings.cartilage_mm,
        motion=settings.motion,
        instrument=settings.instrument,
    )


def _fault(section: FaultSection) -> Fault:
    kind = FaultKind(section.kind)
    return Fault(kind, section.start_s, section.duration_s, section.delay_s, section.turn_deg)


def _simulation(world: World, camera: SimulatedCamera) -> Simulation:
    anatomy = world.anatomy
    joint_z_mm = float(anatomy.bones["femur"].vertices_mm[:, 2].min())
    return Simulation(
        bones=dict(anatomy.bones),
        side=world.scenario.side,
        targets={name: np.array(point) for name, point in anatomy.landmarks.items()},
        # Beyond the joint a vessel follows the tibia: with the knee flexed it is elsewhere.
        curves={
            name: np.asarray(points)[np.asarray(points)[:, 2] > joint_z_mm]
            for name, points in anatomy.curves.items()
        },
        nominal_left_from_bone={
            "femur": world.nominal_left_from_femur,
            "tibia": world.nominal_left_from_tibia,
        },
        approach_axis=np.asarray(world.approach_axis),
        approach_half_angle_deg=world.approach_half_angle_deg,
        oracle=TruthOracle(world, camera.world_time_ns),
        set_stage=world.set_stage,
    )


def _open_real(configuration: Configuration) -> OpenedDevices:
    clock = SystemClock()
    rig = _configured_rig(configuration)
    camera = real_camera(configuration, clock, rig.rig_id)
    _open_fitting(camera, rig)
    reopen = _reopener(camera, lambda: _open_fitting(camera, rig))
    return OpenedDevices(_device_set(configuration, camera, clock, rig), rig, reopen)


def real_camera(configuration: Configuration, clock: Clock, rig_id: str = "") -> StereoCamera:
    """The configured camera, not opened yet; any but the simulated one.

    Raises:
        ConfigurationError, UsageError: no such backend, or settings that mean nothing.
    """
    if configuration.camera.backend == "opencv":
        return _usb_camera(configuration, clock, rig_id)
    if configuration.camera.backend == "depthai":
        return _oak_camera(configuration, clock, rig_id)
    return _third_party_camera(configuration, clock)


def _usb_camera(configuration: Configuration, clock: Clock, rig_id: str) -> StereoCamera:
    section = configuration.camera.opencv
    eye = UvcSettings(
        section.fourcc,
        section.width,
        section.height,
        configuration.camera.rate_hz,
        section.controls,
        section.max_age_ms,
    )
    settings = OpencvStereoSettings(section.left, section.right, eye, section.max_skew_ms)
    return OpencvStereo(settings, clock, rig_id=rig_id)


def _oak_camera(configuration: Configuration, clock: Clock, rig_id: str) -> StereoCamera:
    section = configuration.camera.depthai
    settings = DepthaiSettings(
        section.device,
        section.width,
        section.height,
        configuration.camera.rate_hz,
        section.controls,
    )
    return DepthaiStereo(settings, clock, rig_id=rig_id)


def _third_party_camera(configuration: Configuration, clock: Clock) -> StereoCamera:
    """A camera of the entry-point group `navapp.devices`, entry `camera.NAME`."""
    from importlib.metadata import entry_points

    name = configuration.camera.backend
    found = [entry for entry in entry_points(group=_ENTRY_POINTS) if entry.name == f"camera.{name}"]
    if not found:
        raise ConfigurationError(
            f"there is no camera backend '{name}'",
            subject="camera.backend",
            remedy="use simulated, opencv or depthai, or install the package that provides it",
        )
    settings = (configuration.camera.model_extra or {}).get(name, {})
    try:
        camera: StereoCamera = found[0].load()(settings, clock)
    except (ImportError, AttributeError, TypeError) as error:
        raise DeviceError(f"camera backend '{name}' cannot be loaded: {error}") from error
    return camera


def _device_set(
    configuration: Configuration,
    camera: StereoCamera,
    clock: Clock,
    rig: StereoRig,
    *,
    is_live: bool = True,
) -> DeviceSet:
    """The camera as it is, the others opened; when one cannot be opened, all are closed.

    A recording lights no display, moves no mirror and asks no projector.
    """
    projector: ProjectorControl = NoProjector()
    mirror: MirrorMount = FixedMirror(configuration.mirror.calibrated_deg)
    display: Display = SimulatedDisplay(clock, rig.width, rig.height)
    if is_live:
        projector, mirror = _projector(configuration.projector), _mirror(configuration.mirror)
        display = _display(configuration.display, clock, rig)
    devices = DeviceSet(camera, display, projector, mirror, clock)
    with ExitStack() as undo:
        undo.callback(devices.close)
        for device in (display, mirror, projector):
            device.open()
        undo.pop_all()
    return devices


def _projector(settings: ProjectorSection) -> ProjectorControl:
    if settings.backend == "pjlink":
        return _pjlink_projector(settings)
    if settings.backend == "escvp21":
        address = SerialAddress(settings.port, ESCVP21_BAUD_RATE)
        return EscVp21Projector(address, SystemClock(), settings.serial)
    return NoProjector()


def _mirror(settings: MirrorSection) -> MirrorMount:
    if settings.backend == "zaber":
        address = SerialAddress(settings.port, ZABER_BAUD_RATE)
        axis = (settings.device, settings.axis)
        return ZaberMirror(address, SystemClock(), settings.serial, axis)
    return FixedMirror(settings.calibrated_deg)


def _open_fitting(camera: StereoCamera, rig: StereoRig) -> None:
    """Open a camera; it is closed again when it is not the one that the rig was made with."""
    Rectifier(rig)  # refuses cameras that do not stand side by side, before anything is opened
    camera.open()
    info = camera.info
    if (info.width, info.height) != (rig.width, rig.height):
        camera.close()
        raise RigError(
            f"the pictures of {info.name} are {info.width}x{info.height}, "
            f"the rig was calibrated at {rig.width}x{rig.height}",
            subject=info.name,
            remedy="use the rig file that belongs to these pictures",
        )
    if any(rig.serials) and any(info.serials) and info.serials != rig.serials:
        camera.close()
        raise WrongDevice(
            f"camera {info.name} has serial numbers {' and '.join(info.serials)}, "
            f"the rig was calibrated with {' and '.join(rig.serials)}",
            subject=info.name,
            remedy="connect the cameras of the rig, left and right as calibrated",
        )


def _reopener(camera: StereoCamera, open_again: Callable[[], None]) -> Callable[[], StereoCamera]:
    """Opens the camera again, and refuses another one that was put in its place."""
    serials = camera.info.serials

    def reopen() -> StereoCamera:
        open_again()
        found = camera.info.serials
        if found != serials:
            camera.close()
            raise WrongDevice(
                f"camera {camera.info.name} has serial numbers {found}, it began with {serials}",
                subject=camera.info.name,
                remedy="connect the cameras that it began with",
            )
        return camera

    return reopen


def _no_reopening() -> StereoCamera:
    raise DeviceError("a recording cannot be reopened")


def _display(settings: DisplaySection, clock: Clock, rig: StereoRig) -> Display:
    if settings.backend == "window" and settings.size_px is not None:
        flips = (settings.flip_horizontally, settings.flip_vertically)
        return WindowDisplay(clock, WindowSettings(settings.output, *settings.size_px, *flips))
    return SimulatedDisplay(clock, rig.width, rig.height)


def _pjlink_projector(settings: ProjectorSection) -> PjlinkProjector:
    connect = partial(TcpConnection, settings.host, settings.tcp_port)
    password = "" if settings.password_file is None else _password(Path(settings.password_file))
    return PjlinkProjector(settings.host, SystemClock(), connect, password)


def _password(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8").rstrip("\r\n")
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigurationError(
            f"the password file {path} cannot be read",
            subject="projector.password_file",
            remedy="write the projector's PJLink password into it, readable by you alone",
        ) from error
