"""Opens the devices of a session, from a configuration or a recording."""

from collections.abc import Callable
from dataclasses import dataclass, replace

from calibration.targets.boards import Board
from drivers.clock import Clock, ManualClock, SystemClock
from drivers.interfaces import DeviceSet, StereoCamera
from drivers.memory_camera import MemoryCamera
from drivers.replay_camera import ReplayCamera, ReplaySettings
from navapp.config import Configuration
from navapp.devices.cameras import make_real_camera
from navapp.devices.peripherals import make_device_set
from navapp.devices.rig_match import make_reopener, open_matching, read_configured_rig
from navapp.devices.simulated_cloth import with_cloth
from navapp.devices.simulated_mirror import make_look
from navapp.devices.simulated_room import (
    Pace,
    Simulation,
    make_simulated_camera,
    make_world,
    simulation_of,
    with_board,
    with_tool,
)
from navapp.errors import DeviceError
from navapp.geometry import StereoRig
from navapp.values.pictures import Look
from sim_devices.camera import SimulatedCamera
from sim_devices.display import SimulatedDisplay
from sim_devices.world import World


@dataclass(frozen=True, slots=True, eq=False)
class OpenedDevices:
    """Opened devices with the rig that took the pictures."""

    devices: DeviceSet
    rig: StereoRig
    reopen_camera: Callable[[], StereoCamera]
    simulation: Simulation | None = None
    look: Look | None = None  # of an eye into a simulated mirror, for showing only


def open_live(
    configuration: Configuration,
    *,
    is_headless: bool,
    board: Board | None = None,
    has_mirror: bool = False,
) -> OpenedDevices:
    """Open the configured devices.

    Args:
        configuration: in force.
        board: that is held into a simulated view, when the configuration says so.
        is_headless: nobody watches; a simulated camera then waits to be read.
        has_mirror: the simulated display is seen in the built-in simulated mirror.

    Raises:
        DeviceError, RigError, ConfigurationError.
    """
    if configuration.camera.backend == "simulated":
        opened, world, camera = _open_simulated(configuration, board, is_headless=is_headless)
        return _with_look(opened, world, camera) if has_mirror else opened
    return _open_real(configuration)


def open_recording(
    source: str, settings: ReplaySettings, rig: StereoRig, configuration: Configuration
) -> OpenedDevices:
    """Open a recorded source as the camera of a stepped session.

    Raises:
        SequenceError: the source; RigError: pictures of another size than the rig's.
    """
    clock = ManualClock()
    camera = ReplayCamera(source, clock, settings, rig_id=rig.rig_id, row_delay_ns=rig.row_delay_ns)
    open_matching(camera, rig)
    devices = make_device_set(configuration, camera, clock, rig, is_live=False)
    return OpenedDevices(devices, rig, _no_reopening)


def _open_simulated(
    configuration: Configuration, board: Board | None, *, is_headless: bool
) -> tuple[OpenedDevices, World, SimulatedCamera]:
    settings = configuration.camera.simulated
    world = make_world(settings, configuration.camera.rate_hz)
    pace = Pace.of(settings, is_headless=is_headless)
    covered = with_cloth(with_tool(world, settings), world, settings)
    scene = with_board(covered, board, settings)
    camera = make_simulated_camera(scene, settings, pace, configuration.camera.rate_hz)
    if configuration.camera.rig is not None:
        rig = read_configured_rig(configuration)
    else:
        rig = world.rig if settings.scale == 1.0 else world.rig.scale(settings.scale)
    simulation = simulation_of(world, camera)
    opened = _open_devices(configuration, camera, pace.clock, rig, simulation)
    return opened, world, camera


def _with_look(opened: OpenedDevices, world: World, camera: SimulatedCamera) -> OpenedDevices:
    """With an eye that sees the site, and the display when it is a simulated one."""
    devices = opened.devices
    if not isinstance(devices.display, SimulatedDisplay):
        return opened
    return replace(opened, look=make_look(world, camera, devices.display, devices.clock))


def _open_real(configuration: Configuration) -> OpenedDevices:
    clock = SystemClock()
    rig = read_configured_rig(configuration)
    camera = make_real_camera(configuration, clock, rig.rig_id)
    return _open_devices(configuration, camera, clock, rig)


def _open_devices(
    configuration: Configuration,
    camera: StereoCamera,
    clock: Clock,
    rig: StereoRig,
    simulation: Simulation | None = None,
) -> OpenedDevices:
    open_matching(camera, rig)
    reopen = make_reopener(camera, lambda: open_matching(camera, rig))
    devices = make_device_set(configuration, camera, clock, rig)
    return OpenedDevices(devices, rig, reopen, simulation)


def _no_reopening() -> StereoCamera:
    raise DeviceError("a recording cannot be reopened")


def make_memory_devices(
    camera: MemoryCamera, clock: Clock, rig: StereoRig, configuration: Configuration
) -> DeviceSet:
    """The devices of a stepped session on frames in memory; nothing real is lit or moved."""
    camera.open()
    return make_device_set(configuration, camera, clock, rig, is_live=False)
