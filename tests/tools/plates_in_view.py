"""Plates in front of a plain background, as the simulated cameras see them."""

from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from navapp.devices.simulated_tool import make_shape
from navapp.geometry.transform import RigidTransform, rotation_from_vector
from navapp.tools.plate import Plate
from sim_devices.held_tool import Cover, ToolInView
from sim_devices.rigs import NO_TURN, Turn, make_default_rig
from sim_devices.sensor import SensorModel
from sim_devices.tool_shapes import ToolShape

Pictures = tuple[NDArray[np.uint8], NDArray[np.uint8]]


class PlainRoom:
    """Nothing but grey."""

    def __init__(self) -> None:
        self.rig = make_default_rig()

    def render(
        self,
        eye: str,
        time_ns: int,
        scale: float = 1.0,
        turn_rad: Turn = NO_TURN,
        rows: object = None,
    ) -> NDArray[np.float32]:
        return np.full((720, 1280, 3), 0.08, np.float32)


@lru_cache(maxsize=8)
def shape_of(plate: Plate, seed: int = 1, errors: float = 0.0) -> ToolShape:
    """A tool with that plate, printed as it was designed unless told otherwise."""
    return make_shape("pointer", plate, seed, errors)


def held(
    turn_deg: ArrayLike = (0.0, 0.0, 0.0), place_mm: ArrayLike = (10.0, 0.0, 430.0)
) -> RigidTransform:
    """A pose in view of both cameras; not turned, the plate is read as it is printed."""
    turn = rotation_from_vector(np.radians(turn_deg))
    return RigidTransform.from_parts("left", "tool", turn, place_mm)


def pictures_of(
    shape: ToolShape, pose: RigidTransform | None, cover: Cover | None = None, sequence: int = 0
) -> Pictures:
    """What both cameras take, with noise and their tone curve."""
    scene = ToolInView(PlainRoom(), shape, lambda time_ns: pose, cover, glare=0.0)
    sensor = SensorModel(seed=3, is_grey=True)
    left = sensor.picture(scene.render("left", 0), "left", sequence)
    right = sensor.picture(scene.render("right", 0), "right", sequence)
    return left, right
