"""Opens cameras and a display in the mirror for the alignment of crosses; simulated ones, too."""

import math
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibration.targets.boards import Board
from drivers.clock import Clock, SystemClock
from drivers.interfaces import Display, StereoCamera
from navapp.config import Configuration
from navapp.devices.cameras import make_real_camera
from navapp.devices.peripherals import make_window_display, set_mirror
from navapp.devices.rig_match import make_reopener, open_matching, read_configured_rig
from navapp.devices.simulated_board import make_hand, print_board
from navapp.devices.simulated_room import Pace, make_simulated_camera
from navapp.errors import ConfigurationError
from navapp.geometry import StereoRig
from navapp.geometry.transform import FloatArray
from navapp.values.pictures import EyeLook
from sim_devices.aligning_eye import AligningEye
from sim_devices.camera import SimulatedCamera
from sim_devices.display import SimulatedDisplay
from sim_devices.hand import Hand
from sim_devices.mirror_setups import draw_setup
from sim_devices.rigs import make_default_rig
from sim_devices.sheet import SheetScene

# A board that lies still needs no more frames than this.
_STEPPED_HZ = 5.0
# Enough for what the eye's small picture shows.
_EYE_SHEET_PX_PER_MM = 5.0
_ALIGNMENT_SD_PX = 0.7


class PracticeEye:
    """A simulated eye that looks at the corners of the board in a simulated hand.

    Attributes:
        pitch_mm: of the monitor, from its diagonal to a tenth of an inch, as a data sheet says.
        glass_mm: of the plate, likewise, to a whole millimetre.
        reads_upside_down: the eye sees the rows of the monitor's picture rise upwards.
    """

    def __init__(
        self, board: Board, hand: Hand, camera: SimulatedCamera, display: SimulatedDisplay,
        clock: Clock, eye: AligningEye,
    ) -> None:  # fmt: skip
        self._points_mm, self._hand, self._camera = board.points_mm, hand, camera
        self._display, self._clock, self._eye = display, clock, eye
        self._sheet = print_board(board, _EYE_SHEET_PX_PER_MM)
        panel = eye.setup.panel
        diagonal_inch = panel.pitch_mm * math.hypot(panel.width_px, panel.height_px) / 25.4
        self.pitch_mm = panel.pitch_mm * round(diagonal_inch, 1) / diagonal_inch
        self.glass_mm = float(max(1, round(eye.setup.plate.thickness_mm)))
        self.reads_upside_down = eye.setup.reads_upside_down

    def look(self, corner: int | None, number: int) -> NDArray[np.uint8]:
        """(h, w, 3) BGR around a corner of the board, or its middle, at the look of that number."""
        pose = self._hand.left_from_body(self._world_ns())
        shown = self._display.visible_image()
        point = self._points_mm.mean(axis=0) if corner is None else self._points_mm[corner]
        return self._eye.see(shown, self._sheet, pose, pose.apply(point), number)

    def aim_px(self, corner: int, number: int) -> FloatArray:
        """(2,) px of the display's picture where the eye puts a cross on a corner."""
        pose = self._hand.left_from_body(self._world_ns())
        return self._eye.aim_px(pose.apply(self._points_mm[corner]), number)

    def _world_ns(self) -> int:
        return self._camera.world_time_ns(self._clock.now_ns())


@dataclass(frozen=True, slots=True, eq=False)
class OpenedAlignment:
    """Opened cameras, their rig, and the display that is seen in the mirror."""

    camera: StereoCamera
    display: Display
    clock: Clock  # of both
    rig: StereoRig
    reopen: Callable[[], StereoCamera]  # opens the camera again when it was lost
    # hand, look, practice: of the simulated room; its eye may be watched by looks, and asked by
    # nobody but the script that stands for the operator. None with real devices.
    hand: Hand | None = None
    look: EyeLook | None = None
    practice: PracticeEye | None = None

    def close(self) -> None:
        """Both, the display first so that it is dark."""
        with ExitStack() as stack:
            stack.callback(self.camera.close)
            stack.callback(self.display.close)


def open_mirror_alignment(
    configuration: Configuration, board: Board, *, is_headless: bool
) -> OpenedAlignment:
    """Open the configured camera and display; simulated ones stand in one simulated room.

    Args:
        configuration: in force.
        board: what a simulated hand holds.
        is_headless: nobody watches; a simulated camera then waits to be read.

    Raises:
        DeviceError, RigError, ConfigurationError; also when only one of the two is simulated.
    """
    is_simulated = configuration.camera.backend == "simulated"
    if is_simulated != (configuration.display.backend == "simulated"):
        raise ConfigurationError(
            f"no eye sees the board of a camera '{configuration.camera.backend}' and a display "
            f"'{configuration.display.backend}' at once",
            subject="display.backend",
            remedy="configure both as real devices, or both as simulated",
        )
    if is_simulated:
        return _open_simulated(configuration, board, is_headless=is_headless)
    clock = SystemClock()
    rig, window = (
        read_configured_rig(configuration),
        make_window_display(configuration.display, clock),
    )
    assert window is not None  # noqa: S101 (for the type checker: the backend says so)
    camera = make_real_camera(configuration, clock, rig.rig_id)
    set_mirror(configuration.mirror)
    return _open_all(camera, window, clock, rig)


def _open_simulated(
    configuration: Configuration, board: Board, *, is_headless: bool
) -> OpenedAlignment:
    settings, rate_hz = configuration.camera.simulated, configuration.camera.rate_hz
    pace, hand = Pace.of(settings, is_headless=is_headless), make_hand(board, settings.seed)
    eye = make_practice_eye(settings.seed)
    panel = eye.setup.panel
    size = panel.width_px, panel.height_px
    if configuration.display.size_px not in (None, size):
        raise ConfigurationError(
            f"the simulated monitor in the mirror is {size[0]}x{size[1]}",
            subject="display.size_px",
            remedy="leave it out",
        )
    scene = SheetScene(print_board(board), hand.left_from_body)
    rate_hz = min(rate_hz, _STEPPED_HZ) if pace.is_stepped else rate_hz
    camera = make_simulated_camera(scene, settings, pace, rate_hz)
    rig = make_default_rig()
    if configuration.camera.rig is not None:
        rig = read_configured_rig(configuration)
    elif settings.scale != 1.0:
        rig = rig.scale(settings.scale)
    display = SimulatedDisplay(pace.clock, *size)
    practice = PracticeEye(board, hand, camera, display, pace.clock, eye)
    return _open_all(camera, display, pace.clock, rig, hand, practice)


def make_practice_eye(seed: int) -> AligningEye:
    """The eye of the simulated room of that seed, and the mirror that it looks into."""
    setup = draw_setup(np.random.default_rng([seed, 31]))
    return AligningEye(setup, seed, _ALIGNMENT_SD_PX)


def _open_all(
    camera: StereoCamera, display: Display, clock: Clock, rig: StereoRig,
    hand: Hand | None = None, practice: PracticeEye | None = None,
) -> OpenedAlignment:  # fmt: skip
    with ExitStack() as undo:
        undo.callback(camera.close)
        undo.callback(display.close)
        display.open()
        open_matching(camera, rig)
        undo.pop_all()
    reopen = make_reopener(camera, lambda: open_matching(camera, rig))
    look = None if practice is None else make_eye_look(practice)
    return OpenedAlignment(camera, display, clock, rig, reopen, hand, look, practice)


def make_eye_look(practice: PracticeEye) -> EyeLook:
    """What the eye sees, and nothing else of it."""

    def look(corner: int | None, number: int) -> NDArray[np.uint8]:
        return practice.look(corner, number)

    return look
