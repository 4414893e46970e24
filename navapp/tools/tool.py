"""A calibrated tool, and where it is seen."""

from dataclasses import dataclass
from datetime import date
from typing import Literal, get_args

import numpy as np

from navapp.geometry.transform import FloatArray, RigidTransform, twist_slopes
from navapp.tools.paper import Paper
from navapp.tools.plate import Plate

ToolKind = Literal["pointer", "drill"]
TOOL_KINDS: tuple[ToolKind, ...] = get_args(ToolKind)
_CHI2_3_95 = 7.815
# 95 % of an angle whose two components are normal with one standard deviation.
_RAYLEIGH_95 = 2.448


@dataclass(frozen=True, slots=True, eq=False)
class Tool:
    """A plate with a tip; all in the plate's frame, mm."""

    plate: Plate
    paper: Paper  # as the calibration found it
    tip_mm: FloatArray  # (3,)
    tip_covariance_mm2: FloatArray  # (3, 3)
    # (3,) unit, towards the tip; None: nobody has turned the tool about itself.
    axis: FloatArray | None = None
    axis_sigma_rad: float = 0.0  # standard deviation across, each of two components
    made_on: date | None = None
    rig_id: str = ""  # of the rig that saw it


@dataclass(frozen=True, slots=True, eq=False)
class SeenTool:
    """A tool in one pair of pictures."""

    tool: Tool
    left_from_plate: RigidTransform
    covariance: FloatArray  # (6, 6) twist about the plate's origin, left camera's axes; mm, rad
    seen_share: float  # of the plate's edges, in the eye that sees less
    captured_ns: int

    @property
    def tip_mm(self) -> FloatArray:
        """(3,) in the left camera."""
        place: FloatArray = self.left_from_plate.apply(self.tool.tip_mm)
        return place

    @property
    def axis(self) -> FloatArray | None:
        """(3,) unit, in the left camera's axes."""
        return None if self.tool.axis is None else self.left_from_plate.rotate(self.tool.axis)

    @property
    def tip_covariance_mm2(self) -> FloatArray:
        """(3, 3) in the left camera's axes: of the pose, and of the calibration."""
        turn = self.left_from_plate.rotation
        by_pose = twist_slopes((turn @ self.tool.tip_mm)[None])[0]
        seen = by_pose @ self.covariance @ by_pose.T
        return np.asarray(seen + turn @ self.tool.tip_covariance_mm2 @ turn.T)

    @property
    def tip_bound_mm(self) -> float:
        """95 % bound of the tip's error in the left camera, along its least certain direction."""
        return bound_of(self.tip_covariance_mm2)

    @property
    def axis_bound_rad(self) -> float:
        """95 % bound of the axis' angle; meaningless without an axis."""
        turns = self.covariance[3:, 3:]
        variance = float(np.linalg.eigvalsh(turns)[-1]) + self.tool.axis_sigma_rad**2
        return angle_bound_rad(variance)


def bound_of(covariance_mm2: FloatArray) -> float:
    """95 % bound of a place's error, along its least certain direction, mm."""
    return float(np.sqrt(_CHI2_3_95 * max(np.linalg.eigvalsh(covariance_mm2)[-1], 0.0)))


def angle_bound_rad(variance_rad2: float) -> float:
    """95 % bound of a direction's error, of a variance across in each of two components."""
    return _RAYLEIGH_95 * float(np.sqrt(variance_rad2))
