"""The configured camera of this world: USB, OAK, or of an installed package."""

from drivers.clock import Clock
from drivers.depthai_settings import DepthaiSettings
from drivers.depthai_stereo import DepthaiStereo
from drivers.interfaces import StereoCamera
from drivers.opencv_stereo import OpencvStereo, OpencvStereoSettings
from drivers.uvc_settings import UvcSettings
from navapp.config import Configuration
from navapp.errors import ConfigurationError, DeviceError

_ENTRY_POINTS = "navapp.devices"


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
