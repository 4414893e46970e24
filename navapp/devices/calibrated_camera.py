"""Opens the configured, calibrated camera; a simulated one sees a scene that the caller makes."""

from collections.abc import Callable
from dataclasses import dataclass

from drivers.clock import Clock, SystemClock
from drivers.interfaces import StereoCamera
from navapp.config import Configuration
from navapp.devices.cameras import make_real_camera
from navapp.devices.rig_match import open_matching, read_configured_rig
from navapp.devices.simulated_room import Pace, make_simulated_camera
from navapp.geometry import StereoRig
from sim_devices.camera import Scene
from sim_devices.rigs import make_default_rig


@dataclass(frozen=True, slots=True, eq=False)
class CalibratedCamera:
    """An opened camera with the rig that it was calibrated as."""

    camera: StereoCamera
    clock: Clock  # of its frames
    rig: StereoRig


def open_calibrated(
    configuration: Configuration, make_scene: Callable[[StereoRig], Scene], *, is_headless: bool
) -> CalibratedCamera:
    """Open it.

    Args:
        configuration: in force.
        make_scene: what a simulated rig sees.
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
        return CalibratedCamera(camera, clock, rig)
    settings, pace = section.simulated, Pace.of(section.simulated, is_headless=is_headless)
    true_rig = make_default_rig()
    camera = make_simulated_camera(make_scene(true_rig), settings, pace, section.rate_hz)
    rig = true_rig if settings.scale == 1.0 else true_rig.scale(settings.scale)
    if section.rig is not None:
        rig = read_configured_rig(configuration)
    open_matching(camera, rig)
    return CalibratedCamera(camera, pace.clock, rig)
