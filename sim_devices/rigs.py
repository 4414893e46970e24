"""The stereo rig of the simulated operating room."""

import math
from functools import lru_cache

import numpy as np

from navapp.geometry.camera import Camera
from navapp.geometry.rig import StereoRig
from navapp.geometry.transform import RigidTransform, rotation_from_vector
from sim_devices.sensor import Eye

# Rotation vector about a camera's own axes.
Turn = tuple[float, float, float]
NO_TURN: Turn = (0.0, 0.0, 0.0)

NATIVE_WIDTH = 1280
NATIVE_HEIGHT = 720
BASELINE_MM = 80.0
WORKING_DISTANCE_MM = 450.0
TOE_IN_DEG = 2.5


@lru_cache(maxsize=4)
def make_default_rig(
    width: int = NATIVE_WIDTH, height: int = NATIVE_HEIGHT, baseline_mm: float = BASELINE_MM
) -> StereoRig:
    """Two slightly unequal cameras, 80 mm apart, each turned inwards by 2.5 deg.

    Another picture size is the same rig with its pictures resized.

    Raises:
        ValueError: the size has not the shape 16:9 (within a pixel).
    """
    factor = width / NATIVE_WIDTH
    if width <= 0 or abs(height - NATIVE_HEIGHT * factor) > 1.0:
        raise ValueError(f"pictures of the simulated rig are 16:9, not {width}x{height}")
    rig = StereoRig(
        _camera(1402.6, 1403.1, 634.2, 364.8, (-0.102, 0.061, 0.00042, -0.00031, 0.012)),
        _camera(1398.3, 1398.1, 645.9, 355.7, (-0.098, 0.055, -0.00027, 0.00038, 0.015)),
        _right_from_left(baseline_mm),
        ("SIM-L", "SIM-R"),
        name="sim:rig",
    )
    return rig if factor == 1.0 else rig.scale(factor)


def camera_from_left(rig: StereoRig, eye: Eye, turn_rad: Turn = NO_TURN) -> RigidTransform:
    """Where an eye stands, the right one turned about its own axes since the rig was measured."""
    if eye == "left":
        return RigidTransform.identity("left", "left")
    turn = rotation_from_vector(turn_rad)
    return RigidTransform.from_parts("right", "right", turn, np.zeros(3)) @ rig.right_from_left


def _camera(
    fx: float, fy: float, cx: float, cy: float, distortion: tuple[float, float, float, float, float]
) -> Camera:
    matrix = np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])
    return Camera(matrix, np.array(distortion), NATIVE_WIDTH, NATIVE_HEIGHT)


def _right_from_left(baseline_mm: float) -> RigidTransform:
    """Both cameras converge; the right one hangs a little high, rolled and behind."""
    turn = math.radians(2.0 * TOE_IN_DEG)
    rotation = rotation_from_vector((math.radians(0.25), turn, math.radians(-0.3)))
    # The right camera's centre in the left one's frame; seen from there the baseline is tilted
    # by the left camera's own toe-in.
    half = 0.5 * turn
    centre = np.array([math.cos(half), 0.008, math.sin(half)])
    centre *= baseline_mm / np.linalg.norm(centre)
    return RigidTransform.from_parts("right", "left", rotation, -rotation @ centre)
