"""Tools that are seen where a test wants them."""

import numpy as np
from numpy.typing import ArrayLike

from navapp.geometry.transform import RigidTransform
from navapp.tools.paper import as_designed
from navapp.tools.plate import Plate
from navapp.tools.tool import SeenTool, Tool

TIP_MM = np.array([2.0, 78.0, 112.0])


def tool_of(
    plate: Plate | None = None,
    tip_mm: ArrayLike = TIP_MM,
    tip_sigma_mm: float = 0.05,
    axis: ArrayLike | None = None,
    axis_sigma_rad: float = 0.0,
) -> Tool:
    """A calibrated tool."""
    plate = plate or Plate()
    return Tool(
        plate,
        as_designed(plate),
        np.array(tip_mm, dtype=np.float64),
        tip_sigma_mm**2 * np.eye(3),
        None if axis is None else np.array(axis, dtype=np.float64),
        axis_sigma_rad,
    )


def seen_at(
    tool: Tool, pose: RigidTransform | None = None, covariance: ArrayLike | None = None
) -> SeenTool:
    """That tool with its plate at the left camera's origin unless told otherwise."""
    return SeenTool(
        tool,
        pose or RigidTransform.identity("left", "plate"),
        1e-12 * np.eye(6) if covariance is None else np.array(covariance, dtype=np.float64),
        0.9,
        5,
    )
