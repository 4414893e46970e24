"""Makes cameras of other packages, entry points `camera.NAME` of group `navapp.devices`."""

from collections.abc import Mapping
from importlib import metadata
from typing import Any

from drivers.clock import Clock
from drivers.interfaces import StereoCamera
from navapp.errors import ConfigurationError, DeviceError, NavappError
from navapp.inventory.camera_packages import GROUP, KIND


def make_package_camera(backend: str, settings: Mapping[str, Any], clock: Clock) -> StereoCamera:
    """A camera of the group, not opened yet.

    Args:
        backend: its entry point is `camera.BACKEND`.
        settings: the table `[camera.BACKEND]`, which nobody but its package has checked.
        clock: of its frames.

    Raises:
        ConfigurationError: no package announces it, or several do.
        DeviceError: its package cannot be loaded, or its factory fails.
    """
    found = [entry for entry in metadata.entry_points(group=GROUP) if entry.name == KIND + backend]
    if not found:
        raise ConfigurationError(
            f"there is no camera backend '{backend}'",
            subject="camera.backend",
            remedy="use simulated, opencv or depthai, or install the package that provides it",
        )
    if len(found) > 1:
        raise ConfigurationError(
            f"{len(found)} installed packages bring a camera backend '{backend}'",
            subject="camera.backend",
            remedy="uninstall all but one of them; navapp devices names them",
        )
    try:
        camera: StereoCamera = found[0].load()(settings, clock)
    except NavappError:
        raise
    except Exception as error:
        raise DeviceError(
            f"camera backend '{backend}' cannot be loaded ({type(error).__name__}: {error})",
            subject="camera.backend",
            remedy="mend or uninstall its package; navapp devices names it",
        ) from error
    return camera
