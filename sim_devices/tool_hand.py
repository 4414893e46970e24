"""A scripted hand that holds a tool: it pivots, turns and touches, by the world's time alone."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from navapp.geometry.transform import (
    FloatArray,
    RigidTransform,
    rotation_from_vector,
    vector_from_rotation,
)
from sim_devices.motion import smooth_step
from sim_devices.tool_shapes import ToolShape

ToolDeed = Literal["pivot", "turn"]

# The tip stands in a small hole and slips a little; the plate moves by at most 100 mm/s.
_LEAN_RAD, _LEAN_PERIOD_S, _SPIN_RAD, _SPIN_PERIOD_S = 0.6, 6.0, 0.5, 3.7
_SLIP_MM, _SLIP_HZ = 0.03, (0.7, 1.1, 1.7)
# A turn about itself goes to and fro; the axis wobbles meanwhile.
_TURN_RAD, _TURN_PERIOD_S, _WOBBLE_RAD = 1.0, 8.0, 0.004
# Going from one place to the next, and resting there; no faster than this.
_SPEED_MM_S, _PLATE_SPEED_MM_S, _REST_S, _LIFT_MM = 60.0, 100.0, 1.6, 12.0
# A held tip trembles by this (standard deviation along each axis).
_TREMOR_MM, _TREMOR_HZ = 0.05, (1.3, 2.1, 3.3)


class PivotingHand:
    """Holds the tip in a hole and leans the tool, or turns it about itself.

    Args:
        shape: of the tool.
        hole_mm: (3,) where the tip stands, in the left camera.
        upright: (3, 3) how the tool is held: left camera from plate.
        seed: of slip and wobble.
    """

    def __init__(
        self, shape: ToolShape, hole_mm: FloatArray, upright: FloatArray, seed: int
    ) -> None:
        self._shape, self._hole_mm, self._upright = shape, np.asarray(hole_mm), upright
        self._phases = np.random.default_rng([seed, 91]).uniform(0.0, 2.0 * np.pi, (3, 3))
        self._deed: ToolDeed = "pivot"
        self._n_turns, self._begin_ns, self._now_ns = 0, 0, 0

    def begin(self, deed: ToolDeed) -> None:
        """Do this from now on; every turn is made with the tool leaned otherwise."""
        self._n_turns += deed == "turn"
        self._deed, self._begin_ns = deed, self._now_ns

    def left_from_tool(self, time_ns: int) -> RigidTransform:
        """Where the plate is at a world time."""
        self._now_ns = max(self._now_ns, time_ns)
        seconds = (time_ns - self._begin_ns) / 1e9
        turn = self._pivot(seconds) if self._deed == "pivot" else self._turn(seconds)
        waves = np.sin(2.0 * np.pi * np.array(_SLIP_HZ)[:, None] * seconds + self._phases)
        tip = self._hole_mm + _SLIP_MM * waves.mean(axis=0)
        return RigidTransform.from_parts("left", "tool", turn, tip - turn @ self._shape.tip_mm)

    def _pivot(self, seconds: float) -> FloatArray:
        """Leaned to all sides, on a spiral that goes out and in."""
        around = 2.0 * np.pi * seconds / _LEAN_PERIOD_S
        lean = _LEAN_RAD * abs(np.sin(0.41 * around))
        spin = _SPIN_RAD * np.sin(2.0 * np.pi * seconds / _SPIN_PERIOD_S)
        axis = self._upright @ self._shape.axis
        leaned = rotation_from_vector(lean * np.array([np.cos(around), np.sin(around), 0.0]))
        turn: FloatArray = leaned @ rotation_from_vector(spin * axis) @ self._upright
        return turn

    def _turn(self, seconds: float) -> FloatArray:
        """To and fro about its own axis, which wobbles a little."""
        leaned = rotation_from_vector((0.15 * (-1.0) ** self._n_turns, 0.12 * self._n_turns, 0.0))
        around = _TURN_RAD * np.sin(2.0 * np.pi * seconds / _TURN_PERIOD_S)
        wobble = _WOBBLE_RAD * np.sin(2.0 * np.pi * 0.9 * seconds + self._phases[:, 0])
        upright = rotation_from_vector(wobble) @ leaned @ self._upright
        turn: FloatArray = upright @ rotation_from_vector(around * self._shape.axis)
        return turn


@dataclass(frozen=True, slots=True, eq=False)
class Touch:
    """A place on a bone that the tip is held to."""

    point_mm: FloatArray  # (3,) bone coordinates
    outwards: FloatArray  # (3,) unit, bone coordinates: from where the tip comes


class TouchingHand:
    """Goes from place to place on a bone, and rests at each with the tip on it.

    Args:
        shape: of the tool.
        touches: in order, again and again.
        left_from_bone: where the bone is at a world time.
        held: (3, 3) left camera from plate, of each touch in turn.
        seed: of the tremor.
    """

    def __init__(
        self,
        shape: ToolShape,
        touches: Sequence[Touch],
        left_from_bone: Callable[[int], RigidTransform],
        held: Sequence[FloatArray],
        seed: int,
    ) -> None:
        self._shape, self._touches, self._left_from_bone = shape, tuple(touches), left_from_bone
        self._held = tuple(held)
        self._phases = np.random.default_rng([seed, 92]).uniform(0.0, 2.0 * np.pi, (3, 3))
        ends = [one.point_mm for one in self._touches]
        ways = [
            float(np.linalg.norm(b - a)) for a, b in zip(ends, ends[1:] + ends[:1], strict=True)
        ]
        turns = [
            float(np.linalg.norm(vector_from_rotation(self._hold(k + 1) @ self._hold(k).T)))
            for k in range(len(ways))
        ]
        self._goes_s = [
            _find_duration_s(way + 2.0 * _LIFT_MM, turn, shape)
            for way, turn in zip(ways, turns, strict=True)
        ]
        self._round_s = sum(self._goes_s) + _REST_S * len(ways)

    def touched(self, time_ns: int) -> int | None:
        """Number of the place that the tip rests at; None on the way."""
        number, share = self._find(time_ns)
        return number if share == 0.0 else None

    def left_from_tool(self, time_ns: int) -> RigidTransform:
        """Where the plate is at a world time."""
        number, share = self._find(time_ns)
        here, then = self._touches[number], self._touches[(number + 1) % len(self._touches)]
        done = smooth_step(share)
        point = here.point_mm + done * (then.point_mm - here.point_mm)
        lift = _LIFT_MM * np.sin(np.pi * done)
        outwards = here.outwards + done * (then.outwards - here.outwards)
        bone = self._left_from_bone(time_ns)
        held = self._between(number, done)
        tip = bone.apply(point + lift * outwards / np.linalg.norm(outwards))
        seconds = time_ns / 1e9
        waves = np.sin(2.0 * np.pi * np.array(_TREMOR_HZ)[:, None] * seconds + self._phases)
        if share > 0.0:
            # What rests on a bone does not tremble.
            tip = tip + _TREMOR_MM * waves.mean(axis=0)
        return RigidTransform.from_parts("left", "tool", held, tip - held @ self._shape.tip_mm)

    def _between(self, number: int, done: float) -> FloatArray:
        a, b = self._hold(number), self._hold(number + 1)
        turn: FloatArray = rotation_from_vector(done * vector_from_rotation(b @ a.T)) @ a
        return turn

    def _hold(self, number: int) -> FloatArray:
        return self._held[number % len(self._touches) % len(self._held)]

    def _find(self, time_ns: int) -> tuple[int, float]:
        """Which place was touched last, and how far it is gone to the next one."""
        left_s = (time_ns / 1e9) % self._round_s
        for number, goes_s in enumerate(self._goes_s):
            if left_s < _REST_S:
                return number, 0.0
            left_s -= _REST_S
            if left_s < goes_s:
                return number, left_s / goes_s
            left_s -= goes_s
        return 0, 0.0


class ReachingHand:
    """Goes where it is told, stands there with the tip in a divot, and leans the tool if asked.

    Args:
        shape: of the tool.
        place_mm: (3,) of the tip at first, in the left camera.
        held: (3, 3) left camera from plate at first.
        seed: of how far the tip slips.
    """

    def __init__(self, shape: ToolShape, place_mm: FloatArray, held: FloatArray, seed: int) -> None:
        self._shape = shape
        self._from = self._to = (np.asarray(place_mm, dtype=np.float64), held)
        self._axis: int | None = None
        self._begin_ns, self._goes_s, self._now_ns = 0, 0.0, 0
        self._rng = np.random.default_rng([seed, 95])
        self._slip_mm = np.zeros(3)

    def go(self, place_mm: FloatArray, held: FloatArray, axis: int | None) -> None:
        """To a place of the tip, held so; then lean about x, y or the shaft (axis 0 to 2)."""
        self._from, self._to, self._axis = self._to, (np.asarray(place_mm), held), axis
        way_mm = float(np.linalg.norm(self._to[0] - self._from[0]))
        turn_rad = float(np.linalg.norm(vector_from_rotation(held @ self._from[1].T)))
        self._goes_s = max(0.3, _find_duration_s(way_mm, turn_rad, self._shape))
        self._begin_ns = self._now_ns
        self._slip_mm = _SLIP_MM * self._rng.standard_normal(3)

    @property
    def is_there(self) -> bool:
        """At the newest time that was asked for."""
        return (self._now_ns - self._begin_ns) / 1e9 >= self._goes_s

    def left_from_tool(self, time_ns: int) -> RigidTransform:
        """Where the plate is at a world time."""
        self._now_ns = max(self._now_ns, time_ns)
        seconds = (time_ns - self._begin_ns) / 1e9
        done = smooth_step(seconds / self._goes_s) if self._goes_s > 0.0 else 1.0
        place = self._from[0] + done * (self._to[0] - self._from[0])
        turn = vector_from_rotation(self._to[1] @ self._from[1].T)
        held = rotation_from_vector(done * turn) @ self._from[1]
        if self._axis is not None and done >= 1.0:
            around = (np.eye(3)[0], np.eye(3)[1], held @ self._shape.axis)[self._axis]
            lean = 0.35 * np.sin(2.0 * np.pi * (seconds - self._goes_s) / 6.0)
            held = rotation_from_vector(lean * around) @ held
        tip = place + (self._slip_mm if done >= 1.0 else 0.0)
        return RigidTransform.from_parts("left", "tool", held, tip - held @ self._shape.tip_mm)


def _find_duration_s(way_mm: float, turn_rad: float, shape: ToolShape) -> float:
    """For a way of the tip and a turn about it: neither tip nor plate is too fast.

    Nearly twice as long as at an even speed: smooth starts and stops are faster in their middle.
    """
    of_plate_mm = way_mm + turn_rad * float(np.linalg.norm(shape.tip_mm))
    return 1.9 * max(way_mm / _SPEED_MM_S, of_plate_mm / _PLATE_SPEED_MM_S)
