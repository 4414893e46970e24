"""Makes display, projector and mirror as configured."""

from contextlib import ExitStack
from functools import partial
from pathlib import Path

from drivers.clock import Clock, SystemClock
from drivers.escvp21_projector import BAUD_RATE as ESCVP21_BAUD_RATE
from drivers.escvp21_projector import EscVp21Projector
from drivers.fixed_mirror import FixedMirror
from drivers.interfaces import (
    DeviceSet,
    Display,
    MirrorMount,
    ProjectorControl,
    ProjectorStatus,
    StereoCamera,
)
from drivers.no_projector import NoProjector
from drivers.pjlink_line import TcpConnection
from drivers.pjlink_projector import PjlinkProjector
from drivers.serial_port import SerialAddress
from drivers.window_display import WindowDisplay
from drivers.window_process import WindowSettings
from drivers.zaber_line import BAUD_RATE as ZABER_BAUD_RATE
from drivers.zaber_mirror import ZaberMirror
from navapp.config import Configuration, DisplaySection, MirrorSection, ProjectorSection
from navapp.errors import ConfigurationError
from navapp.geometry import StereoRig
from sim_devices.display import SimulatedDisplay

_MOTION_S = 60.0


def make_device_set(
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
    rig_px = rig.width, rig.height
    display: Display = SimulatedDisplay(clock, *rig_px)
    if is_live:
        projector, mirror = _projector(configuration.projector), _mirror(configuration.mirror)
        settings = configuration.display
        display = make_window_display(settings, clock, rig_px) or SimulatedDisplay(
            clock, *(settings.size_px or rig_px)
        )
    devices = DeviceSet(camera, display, projector, mirror, clock)
    with ExitStack() as undo:
        undo.callback(devices.close)
        for device in (display, mirror, projector):
            device.open()
        undo.pop_all()
    return devices


def make_window_display(
    settings: DisplaySection, clock: Clock, picture_px: tuple[int, int] | None = None
) -> WindowDisplay | None:
    """The configured window, not opened yet; None when the display is a simulated one.

    Args:
        settings: of the display.
        clock: of the session.
        picture_px: width and height of a window on the desktop that has none configured; None:
            no such window will do.

    Raises:
        ConfigurationError: a window on the desktop is configured where none will do.
    """
    if settings.backend == "desktop" and picture_px is None:
        raise ConfigurationError(
            "a window of the desktop is for looking only",
            subject="display.backend",
            remedy='set it to "window", which covers an output',
        )
    size_px = settings.size_px or picture_px
    if settings.backend == "simulated" or size_px is None:
        return None
    flips = (settings.flip_horizontally, settings.flip_vertically)
    is_framed = settings.backend == "desktop"
    return WindowDisplay(clock, WindowSettings(settings.output, *size_px, *flips, is_framed))


def read_projector(settings: ProjectorSection) -> ProjectorStatus | None:
    """What the configured projector says of itself; None without one.

    Raises:
        DeviceError: it does not answer.
    """
    if settings.backend == "none":
        return None
    projector = _projector(settings)
    with ExitStack() as undo:
        undo.callback(projector.close)
        projector.open()
        return projector.status()


def set_mirror(settings: MirrorSection) -> None:
    """Bring the configured mount to its calibrated angle; a fixed one stands there.

    Raises:
        DeviceError: it does not answer, or not move.
    """
    mirror = _mirror(settings)
    with ExitStack() as undo:
        undo.callback(mirror.close)
        mirror.open()
        if not mirror.info.is_movable:
            return
        if mirror.position_deg() is None:
            mirror.home(_MOTION_S)
        mirror.move_to(settings.calibrated_deg, _MOTION_S)


def read_display_name(settings: DisplaySection) -> str:
    """By which the opened display will be known; a window without `output` is opened for it.

    Raises:
        DeviceError: it cannot be opened.
    """
    clock = SystemClock()
    display: Display = make_window_display(settings, clock) or SimulatedDisplay(clock)
    if settings.output or display.info.is_simulated:
        return display.info.name
    with ExitStack() as undo:
        undo.callback(display.close)
        display.open()
        return display.info.name


def _projector(settings: ProjectorSection) -> ProjectorControl:
    if settings.backend == "pjlink":
        return _pjlink_projector(settings)
    if settings.backend == "escvp21":
        address = SerialAddress(settings.port, ESCVP21_BAUD_RATE)
        return EscVp21Projector(address, SystemClock(), settings.serial)
    return NoProjector()


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


def _mirror(settings: MirrorSection) -> MirrorMount:
    if settings.backend == "zaber":
        address = SerialAddress(settings.port, ZABER_BAUD_RATE)
        axis = (settings.device, settings.axis)
        return ZaberMirror(address, SystemClock(), settings.serial, axis)
    return FixedMirror(settings.calibrated_deg)
