"""Motion of a stage in phases of constant acceleration; microsteps and seconds."""

import math
from dataclasses import dataclass


@dataclass(slots=True)
class StageModel:
    """What differs between stages."""

    serial: int = 990123  # number
    steps_per_turn: int = 384_000  # microsteps
    highest: int = 128_000  # of the range that begins with 0
    speed: float = 26_000.0  # microsteps/s
    acceleration: float = 100_000.0  # microsteps/s^2
    unhomed_steps: float = 21_000.0  # how far from home it stands when it gets power


@dataclass(frozen=True, slots=True)
class Travel:
    """A motion from a place, as a function of time."""

    start_ns: int  # when it began
    start: float  # place then
    speed: float  # then, per s
    phases: tuple[tuple[float, float], ...]  # duration s, acceleration per s^2

    @property
    def end_ns(self) -> int:
        """When it stands."""
        return self.start_ns + round(sum(duration for duration, _ in self.phases) * 1e9)

    def at(self, now_ns: int) -> tuple[float, float]:
        """Place and speed."""
        place, speed, left_s = self.start, self.speed, max(0, now_ns - self.start_ns) / 1e9
        for duration_s, acceleration in self.phases:
            t = min(left_s, duration_s)
            place += speed * t + 0.5 * acceleration * t * t
            speed += acceleration * t
            left_s -= t
        return place, speed


def travel_to(start_ns: int, start: float, end: float, speed: float, acceleration: float) -> Travel:
    """From rest to rest: speeds up, keeps its speed when the way is long enough, slows down."""
    distance = abs(end - start)
    sign = math.copysign(1.0, end - start)
    ramp_s = min(speed / acceleration, math.sqrt(distance / acceleration))
    cruise_s = (distance - acceleration * ramp_s**2) / speed
    gain = sign * acceleration
    return Travel(
        start_ns, start, 0.0, ((ramp_s, gain), (max(0.0, cruise_s), 0.0), (ramp_s, -gain))
    )


def travel_to_rest(start_ns: int, start: float, speed: float, acceleration: float) -> Travel:
    """Slows down at once."""
    phase = (abs(speed) / acceleration, math.copysign(acceleration, -speed))
    return Travel(start_ns, start, speed, (phase,))
