"""A simulated hand that moves a body to a wanted pose, not exactly."""

import threading

import numpy as np
from numpy.typing import ArrayLike

from navapp.geometry.transform import (
    FloatArray,
    RigidTransform,
    vector_from_rotation,
)
from sim_devices.motion import smooth_step

# A hand moves and turns as fast as this, and takes at least so long.
_SPEED_MM_S, _TURN_RAD_S, _LEAST_S = 250.0, 1.5, 0.2
# How well a pose is reached (one standard deviation along and about each axis).
_OFF_MM, _OFF_RAD = 2.0, 0.02
# Tremor of a supported hand: slow waves along each axis.
_TREMOR_HZ = (0.45, 0.83, 1.3)
_TREMOR_MM, _TREMOR_RAD = 0.06, 0.0004
# Wishes beyond this are not followed: nearer than the cameras see, or out of reach.
_NEAREST_MM, _FARTHEST_MM = 150.0, 1500.0


class Hand:
    """Moves a body to wanted poses; all methods may be called from any thread.

    Args:
        left_from_body: where it is held first.
        grip_mm: (3,) where it is held, in the body's frame: it turns about this point.
        seed: of what the hand does not do exactly.
    """

    def __init__(self, left_from_body: RigidTransform, grip_mm: ArrayLike, seed: int = 0) -> None:
        self._grip_mm = np.asarray(grip_mm, dtype=np.float64)
        self._rng = np.random.default_rng([seed, 77])
        self._phases = self._rng.uniform(0.0, 2.0 * np.pi, (len(_TREMOR_HZ), 6))
        self._lock = threading.Lock()
        self._from = self._to = left_from_body
        self._begin_ns, self._takes_s = 0, _LEAST_S
        self._now_ns = 0

    def move_to(self, left_from_body: RigidTransform) -> None:
        """Go there, nearly: the hand ends up a little beside."""
        off = self._rng.normal(0.0, 1.0, 6) * np.repeat((_OFF_MM, _OFF_RAD), 3)
        self._go(left_from_body.move(off, left_from_body.apply(self._grip_mm)))

    def nudge(self, shift_mm: ArrayLike, turn_rad: ArrayLike) -> None:
        """Go on from where the hand wants to be: a shift and a turn along the left camera's axes.

        Args:
            shift_mm: (3,).
            turn_rad: (3,) rotation vector.
        """
        with self._lock:
            wanted = self._to
        twist = np.concatenate([np.asarray(shift_mm, float), np.asarray(turn_rad, float)])
        self._go(wanted.move(twist, wanted.apply(self._grip_mm)))

    def left_from_body(self, time_ns: int) -> RigidTransform:
        """Where it is at a world time; a picture's time is also when commands since then begin."""
        with self._lock:
            self._now_ns = max(self._now_ns, time_ns)
            pose = self._on_its_way(time_ns)
        seconds = time_ns / 1e9
        waves = np.sin(2.0 * np.pi * np.array(_TREMOR_HZ)[:, None] * seconds + self._phases)
        twist = waves.mean(axis=0) * np.repeat((_TREMOR_MM, _TREMOR_RAD), 3)
        return pose.move(twist, pose.apply(self._grip_mm))

    def _go(self, target: RigidTransform) -> None:
        place_mm = target.apply(self._grip_mm)
        if not _NEAREST_MM <= place_mm[2] <= _FARTHEST_MM:
            return
        with self._lock:
            self._from, self._to = self._on_its_way(self._now_ns), target
            away_mm, turn_rad = _between(self._from, target, self._grip_mm)
            needs_s = (
                float(np.linalg.norm(away_mm)) / _SPEED_MM_S,
                float(np.linalg.norm(turn_rad)) / _TURN_RAD_S,
            )
            self._begin_ns, self._takes_s = self._now_ns, max(_LEAST_S, *needs_s)

    def _on_its_way(self, time_ns: int) -> RigidTransform:
        done = smooth_step((time_ns - self._begin_ns) / 1e9 / self._takes_s)
        if done >= 1.0:
            return self._to
        away_mm, turn_rad = _between(self._from, self._to, self._grip_mm)
        twist = done * np.concatenate([away_mm, turn_rad])
        return self._from.move(twist, self._from.apply(self._grip_mm))


def _between(
    a: RigidTransform, b: RigidTransform, grip_mm: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Shift of the grip in mm and rotation vector in rad that lead from one pose to another."""
    return b.apply(grip_mm) - a.apply(grip_mm), vector_from_rotation(b.rotation @ a.rotation.T)
