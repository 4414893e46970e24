"""Opens the camera of a tool's calibration; a simulated one sees a tool in a simulated hand."""

from navapp.config import Configuration
from navapp.devices.calibrated_camera import CalibratedCamera, open_calibrated
from navapp.devices.simulated_tool import make_pivoting
from navapp.geometry import StereoRig
from navapp.tools.plate import Plate
from navapp.tools.tool import ToolKind
from sim_devices.held_tool import ToolInView
from sim_devices.tool_hand import PivotingHand


def open_tool_calibration(
    configuration: Configuration, kind: ToolKind, plate: Plate, *, is_headless: bool
) -> tuple[CalibratedCamera, PivotingHand | None]:
    """Open the configured camera in front of a tool; a simulated one sees a simulated tool.

    Args:
        configuration: in force.
        kind: of the tool that a simulated camera sees.
        plate: that it carries.
        is_headless: as of `open_calibrated`.

    Returns:
        The camera, and the hand that holds the tool in front of simulated ones.

    Raises:
        DeviceError, RigError, ConfigurationError.
    """
    hands: list[PivotingHand] = []

    def make_scene(rig: StereoRig) -> ToolInView:
        scene, hand = make_pivoting(kind, plate, rig, configuration.camera.simulated.seed)
        hands.append(hand)
        return scene

    opened = open_calibrated(configuration, make_scene, is_headless=is_headless)
    return opened, hands[0] if hands else None
