"""Tools with printed plates, and hands that hold them, for simulated cameras."""

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.rig import StereoRig
from navapp.geometry.transform import RigidTransform, rotation_from_vector
from navapp.tools.plate import Plate
from navapp.tools.tool import ToolKind
from sim_devices.held_tool import Cover, ToolInView
from sim_devices.printed_plate import PlateLayout
from sim_devices.rigs import NO_TURN, Turn
from sim_devices.sensor import Eye, Rows
from sim_devices.tool_hand import PivotingHand, Touch, TouchingHand
from sim_devices.tool_shapes import ToolShape, make_tool
from sim_devices.world import World

# The plates of the simulated room's tools, as they are designed.
SIMULATED_PLATES: dict[ToolKind, Plate] = {"pointer": Plate(first_id=0), "drill": Plate(first_id=8)}
_TABLE = 0.08
_HOLE_MM = (-20.0, 20.0, 460.0)
# The plate's x points up in the picture: the tool is held from the right, its plate to the cameras.
HELD = rotation_from_vector((0.0, 0.0, np.radians(-80.0)))
# How it is tilted from place to place: about the picture's x, y and the line of sight, in turn.
_TILTS_DEG = (
    (0.0, 0.0, 0.0),
    (20.0, 0.0, 8.0),
    (-12.0, 14.0, -10.0),
    (0.0, -22.0, 5.0),
    (8.0, 10.0, 16.0),
)
_PLACES_APART_MM, _N_TOUCHES, _LEAST_FACING = 12.0, 8, 0.55


def make_shape(kind: ToolKind, plate: Plate, seed: int, errors: float = 1.0) -> ToolShape:
    """A tool with a plate of this design; `errors` scales what printer and maker did wrong."""
    per_face = plate.columns * plate.rows
    layouts = tuple(
        PlateLayout(
            plate.dictionary,
            tuple(plate.ids[face * per_face : (face + 1) * per_face]),
            plate.columns,
            plate.square_mm,
            plate.marker_mm,
        )
        for face in range(plate.faces)
    )
    return make_tool(kind, layouts, plate.plate_from_faces, seed, errors)


class Table:
    """An empty table in front of the cameras."""

    def __init__(self, rig: StereoRig) -> None:
        self.rig = rig

    def render(
        self,
        eye: Eye,
        time_ns: int,
        scale: float = 1.0,
        turn_rad: Turn = NO_TURN,
        rows: Rows | None = None,
    ) -> NDArray[np.float32]:
        """(H, W, 3) BGR linear radiance, the same everywhere."""
        rig = self.rig if scale == 1.0 else self.rig.scale(scale)
        return np.full((rig.height, rig.width, 3), _TABLE, np.float32)

    def path_px(self, from_ns: int, until_ns: int) -> float:
        """Nothing moves."""
        return 0.0


def make_pivoting(
    kind: ToolKind, plate: Plate, rig: StereoRig, seed: int
) -> tuple[ToolInView, PivotingHand]:
    """A tool above an empty table, and the hand that pivots it."""
    shape = make_shape(kind, plate, seed)
    hand = PivotingHand(shape, np.array(_HOLE_MM), HELD, seed)
    return ToolInView(Table(rig), shape, hand.left_from_tool), hand


def make_touching(
    kind: ToolKind,
    plate: Plate,
    world: World,
    seed: int,
    n_places: int = _N_TOUCHES,
    cover: Cover | None = None,
) -> tuple[ToolInView, TouchingHand]:
    """The room with a tool whose tip touches places on the femur.

    Args:
        kind: of the tool.
        plate: that it carries, as it was designed.
        world: the room.
        seed: of places, tilts, and of what printer and maker did wrong.
        n_places: that it touches, one after the other.
        cover: of the plate.
    """
    shape = make_shape(kind, plate, seed)
    touches = _choose_touches(world, seed, n_places)

    def left_from_femur(time_ns: int) -> RigidTransform:
        return world.left_from_body("femur", time_ns)

    held = [rotation_from_vector(np.radians(tilt)) @ HELD for tilt in _TILTS_DEG]
    hand = TouchingHand(shape, touches, left_from_femur, held, seed)
    return ToolInView(world, shape, hand.left_from_tool, cover), hand


def _choose_touches(world: World, seed: int, n_places: int) -> list[Touch]:
    """Places of the femur that both cameras see, apart from each other."""
    depth = [world.depth(eye, 0) for eye in ("left", "right")]
    pose = world.left_from_body("femur", 0)
    bone = world.surface("femur")
    points, normals = bone.vertices_mm, bone.normals
    in_left = pose.apply(points)
    facing = -np.einsum("nj,nj->n", pose.rotate(normals), in_left) / np.linalg.norm(in_left, axis=1)
    candidates = facing > _LEAST_FACING
    for one, camera, seen_from in (
        (depth[0], world.rig.left, None),
        (depth[1], world.rig.right, world.rig.right_from_left),
    ):
        placed = in_left if seen_from is None else seen_from.apply(in_left)
        pixels = np.rint(camera.project(placed)).astype(int)
        size = np.array([camera.width, camera.height])
        inside = ((pixels >= 0) & (pixels < size)).all(axis=1)
        pixels = np.clip(pixels, 0, size - 1)
        shown = np.abs(one.depth_mm[pixels[:, 1], pixels[:, 0]] - placed[:, 2]) < 0.5
        candidates &= inside & shown
    order = np.random.default_rng([seed, 94]).permutation(np.flatnonzero(candidates))
    chosen: list[int] = []
    for k in order:
        if all(np.linalg.norm(points[k] - points[j]) > _PLACES_APART_MM for j in chosen):
            chosen.append(int(k))
        if len(chosen) == n_places:
            break
    return [Touch(points[k], normals[k]) for k in chosen]
