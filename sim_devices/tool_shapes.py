"""The tools of the simulated room: what their plates, shafts and tips are."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from navapp.geometry.transform import FloatArray, rotation_from_vector
from sim_devices.printed_plate import PlateLayout, print_plate
from sim_devices.sheet import PrintedSheet

SimulatedTool = Literal["pointer", "drill"]
# The plate leans against the shaft, so that it faces the cameras while the shaft points away.
_TIPS_MM: dict[SimulatedTool, tuple[float, float, float]] = {
    "pointer": (2.0, 78.0, 112.0),
    "drill": (-3.0, 70.0, 128.0),
}
_AXES: dict[SimulatedTool, tuple[float, float, float]] = {
    "pointer": (0.0, 0.55, 0.835),
    "drill": (0.01, 0.40, 0.9165),
}
_RADIUS_MM: dict[SimulatedTool, float] = {"pointer": 3.0, "drill": 4.0}
_SHAFT_MM = 118.0
# How a tool's maker errs: where the tip is, how the axis lies, how further faces are folded.
_TIP_OFF_MM, _AXIS_OFF_RAD, _FOLD_MM, _FOLD_RAD = 0.5, 0.01, 0.1, 0.006


@dataclass(frozen=True, slots=True, eq=False)
class ToolShape:
    """A tool as it really is, in the frame of its plate's first face, mm."""

    faces: tuple[PrintedSheet, ...]
    tool_from_faces: FloatArray  # (faces, 4, 4)
    tip_mm: FloatArray  # (3,)
    axis: FloatArray  # (3,) unit, towards the tip
    shaft_mm: float  # length of the shaft
    radius_mm: float  # of the shaft


def make_tool(
    name: SimulatedTool,
    layouts: tuple[PlateLayout, ...],
    tool_from_faces: FloatArray,
    seed: int,
    errors: float = 1.0,
) -> ToolShape:
    """A tool with these faces; `errors` scales what printer and maker do wrong."""
    rng = np.random.default_rng([seed, len(name)])
    faces = np.array(tool_from_faces, dtype=np.float64)
    for face in faces[1:]:
        turn = rotation_from_vector(errors * _FOLD_RAD * rng.standard_normal(3))
        face[:3, :3] = turn @ face[:3, :3]
        face[:3, 3] += errors * _FOLD_MM * rng.standard_normal(3)
    axis = np.array(_AXES[name])
    axis = rotation_from_vector(errors * _AXIS_OFF_RAD * rng.standard_normal(3)) @ axis
    return ToolShape(
        tuple(print_plate(layout, seed, errors) for layout in layouts),
        faces,
        np.array(_TIPS_MM[name]) + errors * _TIP_OFF_MM * rng.standard_normal(3),
        axis / np.linalg.norm(axis),
        _SHAFT_MM,
        _RADIUS_MM[name],
    )
