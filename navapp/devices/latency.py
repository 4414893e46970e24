"""Opens a display and a camera that sees it, to measure their delays."""

from contextlib import ExitStack
from dataclasses import dataclass

from drivers.clock import Clock, SystemClock
from drivers.interfaces import Display, StereoCamera
from navapp.config import Configuration
from navapp.devices.cameras import make_real_camera
from navapp.devices.peripherals import make_window_display
from navapp.devices.simulated_room import Pace, make_simulated_camera
from navapp.errors import ConfigurationError
from sim_devices.camera import NOMINAL_EXPOSURE_MS
from sim_devices.lit_display import DisplayInView, LitDisplay

# Of the simulated display; the cameras see its mean brightness alone.
_WIDTH, _HEIGHT = 64, 36


@dataclass(frozen=True, slots=True, eq=False)
class OpenedLatency:
    """A camera and the display in its view; neither need be calibrated."""

    # camera, display: opened.
    camera: StereoCamera
    display: Display
    clock: Clock  # of both

    def close(self) -> None:
        """Both, the display first so that it is dark."""
        with ExitStack() as stack:
            stack.callback(self.camera.close)
            stack.callback(self.display.close)


def open_latency(configuration: Configuration) -> OpenedLatency:
    """Open the configured camera and display; simulated ones see each other, and nothing else.

    Raises:
        DeviceError, ConfigurationError; also when only one of the two is simulated.
    """
    if (configuration.camera.backend == "simulated") != (
        configuration.display.backend == "simulated"
    ):
        raise ConfigurationError(
            f"a camera '{configuration.camera.backend}' cannot see a display "
            f"'{configuration.display.backend}'",
            subject="display.backend",
            remedy="configure both as real devices, or both as simulated",
        )
    clock = SystemClock()
    window = make_window_display(configuration.display, clock)
    if window is None:
        return _open_simulated(configuration)
    return _open_all(OpenedLatency(make_real_camera(configuration, clock), window, clock))


def _open_simulated(configuration: Configuration) -> OpenedLatency:
    settings, shown = configuration.camera.simulated, configuration.display.simulated
    pace = Pace.of(settings, is_headless=True)
    delay_ns = round(shown.delay_ms * 1e6)
    display = LitDisplay(
        pace.clock, _WIDTH, _HEIGHT, delay_ns=delay_ns, refresh_hz=shown.refresh_hz
    )
    view = DisplayInView(display, pace.clock, round(NOMINAL_EXPOSURE_MS * 1e6))
    camera = make_simulated_camera(view, settings, pace, configuration.camera.rate_hz)
    opened = _open_all(OpenedLatency(camera, display, pace.clock))
    view.begin(-camera.world_time_ns(0))
    return opened


def _open_all(devices: OpenedLatency) -> OpenedLatency:
    with ExitStack() as undo:
        undo.callback(devices.close)
        devices.display.open()
        devices.camera.open()
        undo.pop_all()
    return devices
