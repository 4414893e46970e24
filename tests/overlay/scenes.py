"""A bowl before a rig with distortion, and what that rig measures around it."""

from dataclasses import dataclass, replace
from functools import cache

import cv2
import numpy as np

from navapp.geometry.box import Box
from navapp.geometry.camera import Camera
from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.rectification import Rectifier
from navapp.geometry.rig import StereoRig
from navapp.geometry.transform import RigidTransform, rotation_from_vector
from navapp.geometry.zbuffer import render_rectified
from navapp.overlay import LAYERS, LeftView, Scene
from navapp.overlay.drawing import Drawing
from navapp.overlay.labels import LabelBoard
from navapp.overlay.painting import ask_for_words, paint
from navapp.overlay.strokes import place_strokes
from navapp.values import (
    BoneModel,
    DisparityMap,
    Foreground,
    Origin,
    Plan,
    StageSpec,
    SurgicalContent,
    Surroundings,
)
from tests.registration.shapes import grid_mesh

WIDTH, HEIGHT = 640, 480
CAMERA = Camera(
    np.array([[700.0, 0, 319.5], [0, 705.0, 239.5], [0, 0, 1]]),
    np.array([-0.1, 0.05, 0.0004, -0.0003]), WIDTH, HEIGHT,
)  # fmt: skip
RIG = StereoRig(
    CAMERA, CAMERA, RigidTransform.from_parts("right", "left", np.eye(3), (-60.0, 0.0, 0.0)),
    ("L", "R"),
)  # fmt: skip
POSE = RigidTransform.from_parts(
    "left", "femur", rotation_from_vector((0.3, -0.2, 0.1)), (12.0, -8.0, 400.0)
)
MESH = grid_mesh(lambda x, y: 0.008 * (x * x + y * y), 45.0, 3.0)
TARGET = np.array([5.0, -10.0, 1.0])
BEHIND = np.column_stack([np.linspace(-80, 80, 33), np.full(33, 5.0), np.full(33, 60.0)])
STAGE = StageSpec(
    1, "opening", "femur", 2.0, 2.0, ("femur/notch", "tibia/plateau", "femur/unknown"),
    tuple(LAYERS), (),
)  # fmt: skip
# Behind everything that is measured.
_TABLE_MM = 600.0
_NEAR_PX, _IN_FRONT_MM = 4, 5.0
NOTHING = DisparityMap(*(np.empty((0, 0), np.float32),) * 2, np.empty((0, 0), np.uint8), 0, 0)


@cache
def left_view() -> LeftView:
    return LeftView(RIG)


@dataclass(frozen=True)
class Occluder:
    """What covers the left picture from a column on, nearer than the bone by so much."""

    from_column: float = -np.inf
    nearer_mm: float = 60.0


def measured(
    occluder: Occluder | None = None,
    origin: Origin = Origin.MATCHED,
    pose: RigidTransform = POSE,
    mesh: TriangleMesh = MESH,
) -> Foreground:
    """The bone before a table, in one class, as a tracker tells it."""
    rectifier = Rectifier(RIG)
    geometry = rectifier.geometry
    box = Box(0, 0, geometry.width, geometry.height)
    view = render_rectified(mesh, geometry.rectified_from_left @ pose, geometry, box)
    depth_mm = np.where(view.mask, view.depth_mm, np.float32(_TABLE_MM))
    in_front = np.zeros(view.mask.shape, dtype=np.bool_)
    if occluder is not None:
        covers = rectifier.maps[0] >= occluder.from_column
        nearest_mm = np.where(view.mask, view.depth_mm, np.nanmin(view.depth_mm))
        depth_mm = np.where(covers, nearest_mm - np.float32(occluder.nearer_mm), depth_mm)
        in_front = covers & grown(view.mask, _NEAR_PX) & (occluder.nearer_mm > _IN_FRONT_MM)
    disparity_px = geometry.disparity_map_px(depth_mm.astype(np.float32))
    if origin is Origin.UNKNOWN:
        disparity_px = np.full_like(disparity_px, np.nan)
    origins = np.full(depth_mm.shape, origin, np.uint8)
    picture = np.zeros(depth_mm.shape, np.uint8)
    return Foreground(Surroundings(disparity_px, origins, box, False, picture), NOTHING, in_front)


def scene(
    *layers: str, is_candidate: bool = False, pose: RigidTransform = POSE, mesh=MESH, targets=None,
    curves=None, content=None, foreground: Foreground | None = None, stage: StageSpec = STAGE,
) -> Scene:  # fmt: skip
    """Nothing is known of the depth unless it is given."""
    plan = Plan(
        {"femur": BoneModel("femur", mesh)},
        targets or {"femur/notch": TARGET, "tibia/plateau": TARGET + 20.0},
        curves or {},
        content=content or SurgicalContent(),
    )
    return Scene(plan, stage, pose, left_view(), is_candidate, foreground, layers)


def seen(given: Scene, **options) -> Scene:
    """The same, with its bone measured, before a table."""
    foreground = measured(pose=given.left_from_bone, mesh=given.mesh, **options)
    return replace(given, foreground=foreground)


def draw(layer: str, given: Scene, image: np.ndarray | None = None) -> np.ndarray:
    """One layer without its words, on black unless a picture is given."""
    drawing = Drawing()
    LAYERS[layer](given, drawing)
    drawing.words.clear()
    return painted(given, drawing, image)


def painted(given: Scene, drawing: Drawing, image: np.ndarray | None = None) -> np.ndarray:
    """On black unless a picture is given."""
    image = black() if image is None else image
    views = [given.render(body.mesh) for body in drawing.bodies]
    _ = given.ground
    board = LabelBoard(0.45)
    ask_for_words(given, drawing, board)
    paint(image, given, drawing, views, place_strokes(given, drawing.strokes), board)
    return image


def panel_boxes(layer: str, given: Scene) -> list[Box]:
    """Places that a layer's panels take."""
    board, drawing = LabelBoard(0.45), Drawing()
    LAYERS[layer](given, drawing)
    for panel in drawing.panels:
        panel(black(), board)
    return board.taken


def words(layer: str, given: Scene) -> list[str]:
    """What a layer asks the label board for."""
    board, drawing = LabelBoard(0.45), Drawing()
    LAYERS[layer](given, drawing)
    ask_for_words(given, drawing, board)
    return [text for text, *_ in board._asked]


def black() -> np.ndarray:
    return np.zeros((HEIGHT, WIDTH, 3), dtype=np.uint8)


def video(seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).integers(60, 120, (HEIGHT, WIDTH, 3)).astype(np.uint8)


def is_colour(image: np.ndarray, colour) -> np.ndarray:
    return (image == np.array(colour, dtype=np.uint8)).all(axis=2)


def grown(mask: np.ndarray, by: int) -> np.ndarray:
    return cv2.dilate(mask.astype(np.uint8), np.ones((2 * by + 1, 2 * by + 1))).astype(bool)


def pixels_of(points_mm: np.ndarray, pose: RigidTransform = POSE) -> np.ndarray:
    """(N, 2) nearest pixels, columns and rows."""
    return np.round(CAMERA.project(pose.apply(np.atleast_2d(points_mm)))).astype(int)


def change(before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """(h, w) largest change of a channel, grey levels."""
    return np.abs(after.astype(int) - before).max(axis=2)
