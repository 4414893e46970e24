"""Directions that a camera may look from, and how a body is turned to be seen from one."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from navapp.geometry.transform import FloatArray, read_only, rotation_from_vector


@dataclass(frozen=True, slots=True, eq=False)
class ViewCone:
    """Where the cameras may stand, seen from a body.

    Raises:
        ValueError: the axis has no length, or the half angle is none.
    """

    # (3,) unit, from the body towards the cameras, in its coordinates; None: anywhere.
    axis: FloatArray | None = None
    half_angle_deg: float = 180.0  # around the axis

    def __post_init__(self) -> None:
        if not 0.0 < self.half_angle_deg <= 180.0:
            raise ValueError("the half angle of a view cone lies above 0 and up to 180 degrees")
        if self.axis is None:
            return
        length = float(np.linalg.norm(self.axis))
        if not 0.0 < length < np.inf:
            raise ValueError("the axis of a view cone must have a length")
        object.__setattr__(self, "axis", read_only(np.asarray(self.axis) / length))

    def to_json(self) -> dict[str, Any]:
        """As it stands in files.

        Raises:
            ValueError: it has no axis, and says nothing.
        """
        if self.axis is None:
            raise ValueError("a view cone without an axis is not written")
        return {"axis": self.axis.tolist(), "half_angle_deg": self.half_angle_deg}

    @classmethod
    def from_json(cls, entry: Mapping[str, Any]) -> "ViewCone":
        """What `to_json` gives; without a half angle all directions are inside.

        Raises:
            ValueError, TypeError, KeyError: it is none.
        """
        axis = np.asarray(entry["axis"], dtype=np.float64).reshape(3)
        return cls(axis, float(entry.get("half_angle_deg", 180.0)))

    def off_axis_deg(self, directions: FloatArray) -> FloatArray:
        """(N,) angle of unit vectors (N, 3) from the axis; 0 without one."""
        if self.axis is None:
            return np.zeros(len(directions))
        angle: FloatArray = np.degrees(np.arccos(np.clip(directions @ self.axis, -1.0, 1.0)))
        return angle

    def directions(self, step_deg: float) -> FloatArray:
        """(N, 3) unit vectors about `step_deg` apart inside the cone, its axis among them."""
        n = max(1, round(4.0 * np.pi / (np.radians(step_deg) ** 2 * 0.866)))
        spiral = sphere_spiral(n)
        if self.axis is None:
            return spiral
        angle = self.off_axis_deg(spiral)
        is_taken = (angle <= self.half_angle_deg) & (angle > 0.5 * step_deg)
        return np.vstack([self.axis, spiral[is_taken]])


def sphere_spiral(n: int) -> FloatArray:
    """(n, 3) unit vectors of a golden spiral, spread evenly over the sphere."""
    k = np.arange(n) + 0.5
    z = 1.0 - 2.0 * k / max(n, 1)
    angle = np.pi * (1.0 + np.sqrt(5.0)) * k
    radius = np.sqrt(np.maximum(0.0, 1.0 - z * z))
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle), z])


def make_view_rotation(direction: FloatArray) -> FloatArray:
    """(3, 3) rotation into a camera that a body's direction points at; its roll is arbitrary."""
    forward = -np.asarray(direction) / np.linalg.norm(direction)
    right = np.cross(np.eye(3)[np.abs(forward).argmin()], forward)
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(forward, right), forward])


def turn_between(source: FloatArray, target: FloatArray) -> FloatArray:
    """(3, 3) the smallest rotation that takes the direction of one vector to that of another."""
    a, b = source / np.linalg.norm(source), target / np.linalg.norm(target)
    across = np.cross(a, b)
    sine = float(np.linalg.norm(across))
    if sine < 1e-9:
        if a @ b > 0.0:
            return np.eye(3)
        return rotation_from_vector(np.pi * np.cross(a, make_view_rotation(a)[0]))
    return rotation_from_vector(across * (np.arctan2(sine, float(a @ b)) / sine))


def perpendicular_axes(directions: FloatArray) -> FloatArray:
    """(N, 2, 3) two unit directions perpendicular to each of (N, 3)."""
    ahead = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    least = np.argmin(np.abs(ahead), axis=1)
    first = np.cross(ahead, np.eye(3)[least])
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return np.stack([first, np.cross(ahead, first)], axis=1)


def turn_towards(positions_mm: FloatArray) -> FloatArray:
    """(C, 3, 3) rotations that turn the optical axis into the line of sight of each place."""
    x, y, z = (positions_mm / np.linalg.norm(positions_mm, axis=1, keepdims=True)).T
    # Rodrigues for the turn of (0, 0, 1) into (x, y, z), which is in front: z > 0.
    part = 1.0 / (1.0 + z)
    rotation = np.empty((len(positions_mm), 3, 3))
    rotation[:, 0] = np.column_stack([1.0 - x * x * part, -x * y * part, x])
    rotation[:, 1] = np.column_stack([-x * y * part, 1.0 - y * y * part, y])
    rotation[:, 2] = np.column_stack([-x, -y, z])
    return rotation
