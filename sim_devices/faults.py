"""Scripted faults of a simulated camera."""

import math
from dataclasses import dataclass
from enum import Enum


class FaultKind(Enum):
    """What can go wrong."""

    UNPLUG = "unplug"
    """Gone from the bus: reading and opening fail; it must be opened again."""
    FREEZE = "freeze"
    """The same picture and capture time again and again, as from a stalled camera."""
    DROP = "drop"
    """Frames vanish."""
    DELAY = "delay"
    """Frames come late."""
    BLACKOUT_LEFT = "blackout_left"
    """No light reaches the left sensor."""
    BLACKOUT_RIGHT = "blackout_right"
    """No light reaches the right sensor."""
    WRONG_SERIAL = "wrong_serial"
    """Opened now, it is another camera."""
    TURN = "turn"
    """The right camera is turned where it stands, as if somebody had bumped into it."""


@dataclass(frozen=True, slots=True)
class Fault:
    """One fault: active for `start_s` <= t < `start_s` + `duration_s`.

    Raises:
        ValueError: a negative or missing time, a turn that is no number.
    """

    kind: FaultKind  # what goes wrong
    start_s: float  # since the camera was opened for the first time
    duration_s: float  # infinite for a fault that stays
    delay_s: float = 0.3  # of a DELAY: how much later frames come
    # of a TURN, about the right camera's axes: x moves its picture up and down, y sideways, z turns
    # it in its plane.
    turn_deg: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        if not (math.isfinite(self.start_s) and self.start_s >= 0.0):
            raise ValueError("start_s must not be negative")
        if not self.duration_s > 0.0:
            raise ValueError("duration_s must be positive")
        if not (math.isfinite(self.delay_s) and self.delay_s >= 0.0):
            raise ValueError("delay_s must not be negative")
        if not all(math.isfinite(angle) for angle in self.turn_deg):
            raise ValueError("turn_deg must be three numbers")

    @property
    def start_ns(self) -> int:
        """`start_s` in ns."""
        return round(self.start_s * 1e9)

    def is_active(self, elapsed_ns: int) -> bool:
        """Whether it happens at that time since the first opening."""
        if math.isinf(self.duration_s):
            return elapsed_ns >= self.start_ns
        return self.start_ns <= elapsed_ns < self.start_ns + round(self.duration_s * 1e9)


@dataclass(frozen=True, slots=True)
class FaultScript:
    """Faults by time; without any, all goes well."""

    faults: tuple[Fault, ...] = ()

    def is_active(self, kind: FaultKind, elapsed_ns: int) -> bool:
        """Whether a fault of that kind happens at that time since the first opening."""
        return any(fault.kind is kind and fault.is_active(elapsed_ns) for fault in self.faults)

    def delay_ns(self, elapsed_ns: int) -> int:
        """How late frames exposed at that time come."""
        delays_s = (
            fault.delay_s
            for fault in self.faults
            if fault.kind is FaultKind.DELAY and fault.is_active(elapsed_ns)
        )
        return round(max(delays_s, default=0.0) * 1e9)

    def turn_rad(self, elapsed_ns: int) -> tuple[float, float, float]:
        """Rotation vector by which the right camera is turned then; of several turns the last."""
        turns_deg = [
            fault.turn_deg
            for fault in self.faults
            if fault.kind is FaultKind.TURN and fault.is_active(elapsed_ns)
        ]
        x, y, z = turns_deg[-1] if turns_deg else (0.0, 0.0, 0.0)
        return math.radians(x), math.radians(y), math.radians(z)

    def first_moment_ns(self, kind: FaultKind, after_ns: int, until_ns: int) -> int | None:
        """The first moment of `after_ns` <= t <= `until_ns` at which that fault happens."""
        moments_ns = [
            max(fault.start_ns, after_ns)
            for fault in self.faults
            if fault.kind is kind and fault.is_active(max(fault.start_ns, after_ns))
        ]
        first_ns = min(moments_ns, default=None)
        return first_ns if first_ns is not None and first_ns <= until_ns else None
