"""Opens the camera of a tool's calibration; a simulated one sees a tool in a simulated hand."""

from dataclasses import dataclass

from drivers.clock import Clock, SystemClock
from drivers.interfaces import StereoCamera
from navapp.config import Configuration
from navapp.devices.cameras import make_real_camera
from navapp.devices.rig_match import open_matching, read_configured_rig
from navapp.devices.simulated_room import Pace, make_simulated_camera
from navapp.devices.simulated_tool import make_pivoting
from navapp.geometry import StereoRig
from navapp.tools.plate import Plate
from navapp.tools.tool import ToolKind
from sim_devices.rigs import make_default_rig
from sim_devices.tool_hand import PivotingHand


@dataclass(frozen=True, slots=True, eq=False)
class OpenedToolCalibration:
    """An opened, calibrated camera in front of a tool."""

    camera: StereoCamera
    clock: Clock  # of its frames
    rig: StereoRig
    hand: PivotingHand | None = None  # holds the tool in front of simulated cameras


def open_tool_calibration(
    configuration: Configuration, kind: ToolKind, plate: Plate, *, is_headless: bool
) -> OpenedToolCalibration:
    """Open the configured camera in front of a tool; a simulated one sees a simulated tool.

    Args:
        configuration: in force.
        kind: of the tool that a simulated camera sees.
        plate: that it carries.
        is_headless: nobody watches; a simulated camera then waits to be read.

    Raises:
        DeviceError, RigError, ConfigurationError.
    """
    section = configuration.camera
    if section.backend != "simulated":
        clock: Clock = SystemClock()
        rig = read_configured_rig(configuration)
        camera: StereoCamera = make_real_camera(configuration, clock, rig.rig_id)
        open_matching(camera, rig)
        return OpenedToolCalibration(camera, clock, rig)
    settings, pace = section.simulated, Pace.of(section.simulated, is_headless=is_headless)
    true_rig = make_default_rig()
    scene, hand = make_pivoting(kind, plate, true_rig, settings.seed)
    camera = make_simulated_camera(scene, settings, pace, section.rate_hz)
    if section.rig is not None:
        rig = read_configured_rig(configuration)
    else:
        rig = true_rig if settings.scale == 1.0 else true_rig.scale(settings.scale)
    open_matching(camera, rig)
    return OpenedToolCalibration(camera, pace.clock, rig, hand)
