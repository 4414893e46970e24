"""Opens the camera of a guided capture; a simulated one sees a board in a simulated hand."""

from collections.abc import Callable
from dataclasses import dataclass

from calibration.targets.boards import Board
from drivers.clock import Clock, SystemClock
from drivers.interfaces import StereoCamera
from navapp.config import Configuration
from navapp.devices.cameras import make_real_camera
from navapp.devices.rig_match import make_reopener
from navapp.devices.simulated_board import make_hand, print_board
from navapp.devices.simulated_room import Pace, make_simulated_camera
from sim_devices.hand import Hand
from sim_devices.sheet import SheetScene

# A board that waits to be photographed needs no more frames than this.
_STEPPED_CAPTURE_HZ = 5.0


@dataclass(frozen=True, slots=True, eq=False)
class OpenedCapture:
    """An opened camera that need not be calibrated yet."""

    camera: StereoCamera  # opened
    clock: Clock  # of its frames
    reopen: Callable[[], StereoCamera]  # opens it again when it was lost
    hand: Hand | None = None  # holds the board in front of simulated cameras, else None


def open_capture(configuration: Configuration, board: Board, *, is_headless: bool) -> OpenedCapture:
    """Open the configured camera in front of a board; a simulated one sees a simulated board.

    Args:
        configuration: in force; it need not name a rig.
        board: what a simulated camera is shown.
        is_headless: nobody watches; a simulated camera then waits to be read.

    Raises:
        DeviceError, ConfigurationError.
    """
    hand: Hand | None = None
    clock: Clock = SystemClock()
    if configuration.camera.backend == "simulated":
        settings, rate_hz = configuration.camera.simulated, configuration.camera.rate_hz
        pace, hand = Pace.of(settings, is_headless=is_headless), make_hand(board, settings.seed)
        scene, clock = SheetScene(print_board(board), hand.left_from_body), pace.clock
        rate_hz = min(rate_hz, _STEPPED_CAPTURE_HZ) if pace.is_stepped else rate_hz
        camera: StereoCamera = make_simulated_camera(scene, settings, pace, rate_hz)
    else:
        camera = make_real_camera(configuration, clock)
    camera.open()
    return OpenedCapture(camera, clock, make_reopener(camera, camera.open), hand)
