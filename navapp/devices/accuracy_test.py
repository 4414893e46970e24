"""Opens the camera of an accuracy test; a simulated one sees a pointer in a simulated hand."""

import numpy as np

from navapp.config import Configuration
from navapp.devices.calibrated_camera import CalibratedCamera, open_calibrated
from navapp.devices.simulated_tool import HELD, SIMULATED_PLATES, Table, make_shape
from navapp.geometry import StereoRig
from navapp.geometry.transform import FloatArray, rotation_from_vector
from navapp.tools.accuracy_tasks import Task
from sim_devices.held_tool import ToolInView
from sim_devices.tool_hand import ReachingHand

# The simulated divot plate: five columns and four rows, not quite regular.
_COLUMN_MM, _ROW_MM, _JITTER_MM = 13.0, 11.0, 2.0
# Where its middle is held, in the left camera; the tool is held from the left.
_PLACES_MM = {
    "centre": (25.0, 10.0, 450.0),
    "bottom": (25.0, 40.0, 480.0),
    "top": (25.0, -25.0, 430.0),
    "left": (-5.0, 10.0, 460.0),
    "right": (65.0, 10.0, 450.0),
}
_LEAN_RAD, _ORIENTATIONS = 0.35, ((0.0, 0.0), (0.0, -1.0), (0.0, 1.0))
_PLATE_TURN = (0.15, -0.1, 0.05)


def make_simulated_divots() -> FloatArray:
    """(20, 3) mm, in the divot plate's frame."""
    rng = np.random.default_rng(20)
    column, row = np.meshgrid(np.arange(5) - 2.0, np.arange(4) - 1.5)
    flat = np.column_stack([_COLUMN_MM * column.ravel(), _ROW_MM * row.ravel()])
    return np.column_stack([flat + rng.uniform(-_JITTER_MM, _JITTER_MM, flat.shape), np.zeros(20)])


class SimulatedHand:
    """Does the tasks of a test with a simulated pointer.

    Args:
        hand: that holds it.
        divots_mm: (N, 3) of the divot plate.
    """

    def __init__(self, hand: ReachingHand, divots_mm: FloatArray) -> None:
        self._hand, self._divots_mm = hand, divots_mm
        # Where the divot of each task really was, for judging results only.
        self._true_mm: dict[Task, FloatArray] = {}

    def begin(self, task: Task) -> None:
        """Go there and do it."""
        turn = rotation_from_vector(_PLATE_TURN)
        place = np.array(_PLACES_MM[task.place]) + turn @ self._divots_mm[task.divot]
        lean, axis = (0.0, 0.0), None
        if task.kind == "point":
            lean = _ORIENTATIONS[task.number]
        elif task.kind == "rotation":
            axis = task.number
        self._true_mm[task] = place
        held = rotation_from_vector((_LEAN_RAD * lean[0], _LEAN_RAD * lean[1], 0.0)) @ HELD
        self._hand.go(place, held, axis)

    @property
    def is_there(self) -> bool:
        """It does it, in the newest picture."""
        return self._hand.is_there

    def true_divot_mm(self, task: Task) -> FloatArray:
        """(3,) in the left camera, where the divot of a task was: truth, for judging only."""
        return self._true_mm[task]


def open_accuracy_test(
    configuration: Configuration, divots_mm: FloatArray, *, is_headless: bool
) -> tuple[CalibratedCamera, SimulatedHand | None]:
    """Open the configured camera; a simulated one sees a simulated pointer.

    Args:
        configuration: in force.
        divots_mm: (N, 3) of the divot plate.
        is_headless: as of `open_calibrated`.

    Returns:
        The camera, and the hand that holds the pointer in front of simulated ones.

    Raises:
        DeviceError, RigError, ConfigurationError.
    """
    seed = configuration.camera.simulated.seed
    hands: list[SimulatedHand] = []

    def make_scene(rig: StereoRig) -> ToolInView:
        shape = make_shape("pointer", SIMULATED_PLATES["pointer"], seed)
        hand = ReachingHand(shape, np.array(_PLACES_MM["centre"]), HELD, seed)
        hands.append(SimulatedHand(hand, divots_mm))
        return ToolInView(Table(rig), shape, hand.left_from_tool)

    opened = open_calibrated(configuration, make_scene, is_headless=is_headless)
    return opened, hands[0] if hands else None
