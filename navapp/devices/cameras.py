"""Makes the configured real camera: USB, OAK, or one of an installed package."""

from drivers.clock import Clock
from drivers.depthai_settings import DepthaiSettings
from drivers.depthai_stereo import DepthaiStereo
from drivers.interfaces import StereoCamera
from drivers.opencv_stereo import OpencvStereo, OpencvStereoSettings
from drivers.uvc_settings import UvcSettings
from navapp.config import Configuration
from navapp.devices.package_camera import make_package_camera


def make_real_camera(configuration: Configuration, clock: Clock, rig_id: str = "") -> StereoCamera:
    """The configured camera, not opened yet; any but the simulated one.

    Raises:
        ConfigurationError, UsageError: no such backend, or settings that mean nothing.
        DeviceError: an installed package that cannot be loaded.
    """
    if configuration.camera.backend == "opencv":
        return _usb_camera(configuration, clock, rig_id)
    if configuration.camera.backend == "depthai":
        return _oak_camera(configuration, clock, rig_id)
    backend = configuration.camera.backend
    settings = (configuration.camera.model_extra or {}).get(backend, {})
    return make_package_camera(backend, settings, clock)


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
