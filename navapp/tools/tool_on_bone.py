"""A tool in the coordinates of a bone: where its tip is, and how it lies to the plan."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from navapp.geometry.transform import FloatArray
from navapp.tools.tool import SeenTool, angle_bound_rad, bound_of
from navapp.values import DrillAxis, PoseEstimate


@dataclass(frozen=True, slots=True, eq=False)
class HoleOffset:
    """How a drill stands to a planned hole."""

    name: str  # in the plan
    off_mm: float  # of the tip from the hole's line
    depth_mm: float  # of the tip along the line, from where it enters the bone
    angle_deg: float | None  # between the axes; None: the tool's is not known
    bound_deg: float | None  # 95 % bound of that angle's error


@dataclass(frozen=True, slots=True, eq=False)
class ToolOnBone:
    """A tool in a bone's coordinates, in one pair of pictures."""

    seen: SeenTool
    bone: str
    tip_mm: FloatArray  # (3,)
    axis: FloatArray | None  # (3,) unit, towards the tip
    covariance_mm2: FloatArray  # (3, 3) of the tip, bone coordinates: tool and bone
    axis_bound_deg: float | None  # 95 %, tool and bone

    @property
    def bound_mm(self) -> float:
        """95 % bound of the tip's error, along its least certain direction."""
        return bound_of(self.covariance_mm2)

    def nearest(self, places: Mapping[str, FloatArray]) -> tuple[str, float] | None:
        """Name and distance (mm) of the nearest of some places (3,), bone coordinates."""
        if not places:
            return None
        distances = {
            name: float(np.linalg.norm(place - self.tip_mm)) for name, place in places.items()
        }
        name = min(distances, key=distances.__getitem__)
        return name, distances[name]

    def hole_offset(self, name: str, hole: DrillAxis) -> HoleOffset:
        """How it stands to a planned hole of this bone."""
        away = self.tip_mm - hole.entry_mm
        depth_mm = float(away @ hole.direction)
        off_mm = float(np.linalg.norm(away - depth_mm * hole.direction))
        if self.axis is None:
            return HoleOffset(name, off_mm, depth_mm, None, None)
        sine = float(np.linalg.norm(np.cross(self.axis, hole.direction)))
        angle_deg = float(np.degrees(np.arctan2(sine, self.axis @ hole.direction)))
        return HoleOffset(name, off_mm, depth_mm, angle_deg, self.axis_bound_deg)


def place_on_bone(
    seen: SeenTool, bone: str, estimate: PoseEstimate, middle_mm: FloatArray
) -> ToolOnBone:
    """Take a tool into a bone's coordinates.

    Args:
        seen: the tool.
        bone: its name.
        estimate: of the bone's pose in the same pair of pictures, in the left camera.
        middle_mm: (3,) mean of the model's vertices, about which that pose's twist turns.
    """
    bone_from_left = estimate.camera_from_bone.inverse()
    tip_mm = bone_from_left.apply(seen.tip_mm)
    of_bone = estimate.predict_covariances(middle_mm, tip_mm[None])[0]
    turn = bone_from_left.rotation
    axis, axis_bound_deg = seen.axis, None
    if axis is not None:
        turns = float(np.linalg.eigvalsh(estimate.rotation_covariance)[-1])
        axis_bound_deg = float(np.degrees(np.hypot(seen.axis_bound_rad, angle_bound_rad(turns))))
        axis = bone_from_left.rotate(axis)
    in_left = seen.tip_covariance_mm2 + of_bone
    return ToolOnBone(seen, bone, tip_mm, axis, np.asarray(turn @ in_left @ turn.T), axis_bound_deg)
