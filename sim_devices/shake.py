"""Vibration of the lamp arm that carries the cameras."""

import numpy as np

from navapp.geometry.transform import RigidTransform, rotation_from_vector

# From the arm's joint to the cameras.
ARM_MM = 800.0


class ArmShake:
    """The rig swings at the end of its arm: along one direction, and turned as the arm is.

    The arm is stiff and turns about its joint, so that a rig that is moved across the arm by d is
    turned by d / `ARM_MM`.

    Args:
        amplitude_mm: of the rig's place; 0: it stands still.
        frequency_hz: of the swing.
        seed: of the direction.
    """

    def __init__(self, amplitude_mm: float, frequency_hz: float, seed: int) -> None:
        self._amplitude_mm, self._frequency_hz = amplitude_mm, frequency_hz
        first, second = np.random.default_rng([seed, 83]).standard_normal((2, 3))
        self._direction = first / np.linalg.norm(first)
        axis = np.cross(self._direction, second)
        self._axis = axis / np.linalg.norm(axis)

    @property
    def is_still(self) -> bool:
        """Whether nothing shakes."""
        return self._amplitude_mm == 0.0

    def compute_speed_px_s(self, focal_px: float, depth_mm: float) -> float:
        """What a point at that depth moves in the picture at most, px in a second."""
        fastest_mm_s = 2.0 * np.pi * self._frequency_hz * self._amplitude_mm
        return float(fastest_mm_s * focal_px * (1.0 / depth_mm + 1.0 / ARM_MM))

    def left_from_rest(self, time_s: float) -> RigidTransform:
        """From the left camera's frame at rest to its frame now; the identity at time 0."""
        if self.is_still:
            return RigidTransform.identity("left", "left")
        swing_mm = self._amplitude_mm * np.sin(2.0 * np.pi * self._frequency_hz * time_s)
        turn = rotation_from_vector(swing_mm / ARM_MM * self._axis)
        rest_from_left = RigidTransform.from_parts("left", "left", turn, swing_mm * self._direction)
        return rest_from_left.inverse()
