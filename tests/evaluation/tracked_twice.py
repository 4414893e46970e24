"""A bone that two trackers follow: the camera at 15 Hz, another one at 41 Hz with its own clock."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from navapp.evaluation.recording.truth_files import TrackerTruth
from navapp.geometry.transform import FloatArray, RigidTransform, rotation_from_vector

LEFT_FROM_TRACKER = RigidTransform.from_parts(
    "left", "tracker", rotation_from_vector([0.4, -1.9, 0.7]), [120.0, -300.0, 1500.0]
)
# Places on a bone that lies far from its frame's origin, as in a CT.
VERTICES_MM = np.random.default_rng(1).normal([20.0, -30.0, 800.0], 25.0, (300, 3))
CENTRE_MM = VERTICES_MM.mean(axis=0)
_TURN = rotation_from_vector([-0.8, 0.3, 2.1])
MARKER_FROM_BONE = RigidTransform.from_parts(
    "marker", "femur", _TURN, np.array([60.0, 40.0, -100.0]) - _TURN @ CENTRE_MM
)
# The clocks have nothing to do with each other.
OFFSET_NS = 1_700_000_000_000_000_000 + 37_000_000
START_NS = 5_000_000_000

Motion = Callable[[float], tuple[FloatArray, FloatArray]]  # s -> turn (rad) and shift (mm)


def waving(time_s: float) -> tuple[FloatArray, FloatArray]:
    """Turns about all axes that never repeat themselves."""
    turn = [
        0.20 * np.sin(0.9 * time_s + 0.3 * np.sin(0.31 * time_s)),
        0.25 * np.sin(0.57 * time_s + 1.0),
        0.15 * np.sin(1.3 * time_s + 0.02 * time_s**2),
    ]
    shift = [20 * np.sin(0.7 * time_s), 15 * np.sin(1.1 * time_s + 0.5), 10 * np.cos(0.4 * time_s)]
    return np.array(turn), np.array(shift)


def hinging(time_s: float) -> tuple[FloatArray, FloatArray]:
    """Turns about one axis only."""
    turn, shift = waving(time_s)
    return turn * [1.0, 0.0, 0.0], shift


def bone_at(time_s: float, motion: Motion) -> RigidTransform:
    """Left camera from bone, `time_s` after the recording's start."""
    turn, shift = motion(time_s)
    rotation = rotation_from_vector(turn) @ rotation_from_vector([1.2, 0.4, -0.3])
    place = np.array([10.0, -20.0, 450.0]) + shift - rotation @ CENTRE_MM
    return RigidTransform.from_parts("left", "femur", rotation, place)


@dataclass
class TrackedTwice:
    """What both trackers say."""

    times_ns: list[int]
    true: list[RigidTransform]
    poses: list[RigidTransform | None]
    truth: TrackerTruth


def track_twice(
    motion: Motion = waving, seconds: float = 20.0, noise: float = 1.0, seed: int = 3
) -> TrackedTwice:
    """Noise of 0.1 mm and 0.05 degrees (camera), 0.1 mm and 0.03 degrees (other), times `noise`."""
    rng = np.random.default_rng(seed)
    times_s = np.arange(0.0, seconds, 1 / 15)
    true = [bone_at(time_s, motion) for time_s in times_s]
    poses = [
        pose.move(
            noise * rng.normal(0.0, [0.1] * 3 + [np.radians(0.05)] * 3), pose.apply(CENTRE_MM)
        )
        for pose in true
    ]
    samples_s = np.arange(-3.0, seconds + 2.0, 1 / 41)
    matrices = []
    for time_s in samples_s:
        marker = LEFT_FROM_TRACKER.inverse() @ bone_at(time_s, motion) @ MARKER_FROM_BONE.inverse()
        twist = noise * rng.normal(0.0, [0.1] * 3 + [np.radians(0.03)] * 3)
        matrices.append(marker.move(twist, marker.translation_mm).matrix)
    return TrackedTwice(
        [START_NS + round(time_s * 1e9) for time_s in times_s],
        true,
        list(poses),
        TrackerTruth(
            np.array([START_NS + OFFSET_NS + round(time_s * 1e9) for time_s in samples_s]),
            np.array(matrices),
        ),
    )
