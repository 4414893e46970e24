"""Scripted motion of the leg and of the hand in front of it: smooth functions of time."""

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from navapp.geometry.transform import FloatArray, rotation_from_vector
from sim_devices.scenario import InstrumentKind, MotionKind

SWEEP_PERIOD_S = 6.0
JUMP_AT_S = 4.0
JUMP_TAKES_S = 0.3
JUMP_MM = 15.0
JUMP_DEG = 10.0
DRILL_PERIOD_S = 5.0
DRILL_TURNS_HZ = 4.3


@dataclass(frozen=True, slots=True)
class _Wave:
    """One oscillation that starts at rest position: length, angle and bend of the knee."""

    frequency_hz: float
    shift_mm: float
    turn_deg: float
    bend_deg: float


class LegMotion:
    """Motion of the leg on the table, relative to the start.

    "breathing" moves by less than a millimetre; "patient" reaches 1 to 2 mm and about 1 deg between
    two frames at 15 Hz and comes back again and again; "jump" is one step of 15 mm and 10 deg.

    Args:
        kind: which.
        seed: of the directions.
    """

    _WAVES: ClassVar[dict[str, tuple[_Wave, ...]]] = {
        "still": (),
        "breathing": (
            _Wave(0.25, 0.40, 0.12, 0.10),
            _Wave(1.0 / 41.0, 0.45, 0.20, 0.15),
        ),
        "patient": (
            _Wave(0.50, 5.0, 3.6, 0.4),
            _Wave(0.31, 4.0, 2.8, 0.5),
            _Wave(0.07, 2.0, 1.0, 0.3),
        ),
        "jump": (),
    }

    def __init__(self, kind: MotionKind, seed: int) -> None:
        rng = np.random.default_rng([seed, 31])
        self._kind = kind
        self._waves = self._WAVES[kind]
        self._shifts = _unit_rows(rng.standard_normal((4, 3)))
        self._turns = _unit_rows(rng.standard_normal((4, 3)))

    def twist(self, time_s: float) -> FloatArray:
        """(6,) shift in mm and rotation vector in rad, in the table's frame; zero at the start."""
        total = np.zeros(6)
        for k, wave in enumerate(self._waves):
            swing = np.sin(2.0 * np.pi * wave.frequency_hz * time_s)
            total[:3] += swing * wave.shift_mm * self._shifts[k]
            total[3:] += swing * np.radians(wave.turn_deg) * self._turns[k]
        if self._kind == "jump":
            done = smooth_step((time_s - JUMP_AT_S) / JUMP_TAKES_S)
            total[:3] += done * JUMP_MM * self._shifts[3]
            total[3:] += done * np.radians(JUMP_DEG) * self._turns[3]
        return total

    def bend_rad(self, time_s: float) -> float:
        """Change of the knee's flexion, which moves the tibia against the femur."""
        # Each wave has its own phase, so that the knee does not bend in step with the leg.
        return sum(
            math.radians(wave.bend_deg)
            * (math.sin(2.0 * math.pi * wave.frequency_hz * time_s + k) - math.sin(k))
            for k, wave in enumerate(self._waves)
        )


def compute_sweep_offset_mm(kind: InstrumentKind, time_s: float) -> FloatArray:
    """(3,) place of the hand relative to the middle of the bone, in the table's frame (mm).

    It comes in from the lower right, passes over the bone and leaves again, every six seconds.
    """
    away = np.array([330.0, 210.0, 60.0])
    if kind == "none":
        return away
    phase = (time_s / SWEEP_PERIOD_S) % 1.0
    inside = smooth_step((phase - 0.10) / 0.30) * smooth_step((0.90 - phase) / 0.30)
    wander = np.array(
        [
            9.0 * np.sin(4.0 * np.pi * phase) - 22.0,
            7.0 * np.sin(6.0 * np.pi * phase + 1.0) - 18.0,
            4.0 * np.sin(2.0 * np.pi * phase),
        ]
    )
    offset: FloatArray = (1.0 - inside) * away + inside * wander
    return offset


def compute_drill_motion(
    entry_mm: FloatArray, axis: FloatArray, time_s: float, *, turns: bool
) -> FloatArray:
    """(4, 4) pose of the drill in the bone: it pecks, draws back and turns.

    Args:
        entry_mm: (3,) where the hole begins.
        axis: (3,) unit, into the bone.
        time_s: now.
        turns: whether this is the part that turns.
    """
    phase = (time_s / DRILL_PERIOD_S) % 1.0
    inside = smooth_step(phase / 0.2) * smooth_step((0.75 - phase) / 0.2)
    depth = -38.0 + 56.0 * inside
    aside = smooth_step(-depth / 36.0) * np.array([16.0, 6.0, 0.0])
    angle = 2.0 * np.pi * DRILL_TURNS_HZ * time_s if turns else 0.0
    pose = np.eye(4)
    pose[:3, :3] = _onto(axis) @ rotation_from_vector((0.0, 0.0, angle))
    pose[:3, 3] = entry_mm + depth * axis + aside
    return pose


def _onto(axis: FloatArray) -> FloatArray:
    """A rotation that takes z onto an axis."""
    turn = np.cross((0.0, 0.0, 1.0), axis)
    sine = float(np.linalg.norm(turn))
    if sine < 1e-9:
        return np.eye(3) if axis[2] > 0.0 else np.diag([1.0, -1.0, -1.0])
    return rotation_from_vector(turn / sine * np.arctan2(sine, axis[2]))


def smooth_step(value: float) -> float:
    """0 below 0, 1 above 1, with continuous second derivative between."""
    t = min(1.0, max(0.0, value))
    return t * t * t * (t * (6.0 * t - 15.0) + 10.0)


def _unit_rows(rows: FloatArray) -> FloatArray:
    unit: FloatArray = rows / np.linalg.norm(rows, axis=1, keepdims=True)
    return unit
