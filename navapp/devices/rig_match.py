"""Opens a camera and refuses it when it is not the one that the rig was calibrated with."""

from collections.abc import Callable

from drivers.interfaces import StereoCamera
from navapp.config import Configuration
from navapp.errors import ConfigurationError, RigError, WrongDevice
from navapp.geometry import Rectifier, StereoRig, read_rig


def read_configured_rig(configuration: Configuration) -> StereoRig:
    """The rig file that the configuration names.

    Raises:
        ConfigurationError: it names none.
    """
    if configuration.camera.rig is None:
        raise ConfigurationError(
            "no rig is configured", subject="camera.rig", remedy="give --rig or [camera] rig"
        )
    return read_rig(configuration.camera.rig)


def open_matching(camera: StereoCamera, rig: StereoRig) -> None:
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


def make_reopener(
    camera: StereoCamera, open_again: Callable[[], None]
) -> Callable[[], StereoCamera]:
    """Opens the camera again; refuses another one in its place, or other pictures of the same."""
    first = camera.info

    def reopen() -> StereoCamera:
        open_again()
        found = camera.info
        if found.serials != first.serials:
            camera.close()
            raise WrongDevice(
                f"camera {found.name} has serial numbers {found.serials}, "
                f"it began with {first.serials}",
                subject=found.name,
                remedy="connect the cameras that it began with",
            )
        if (found.width, found.height) != (first.width, first.height):
            camera.close()
            raise WrongDevice(
                f"the pictures of {found.name} are {found.width}x{found.height}, "
                f"they began as {first.width}x{first.height}",
                subject=found.name,
                remedy="set the camera to the size that it began with",
            )
        return camera

    return reopen
