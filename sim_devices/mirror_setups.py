"""Set-ups of a display in a mirror beside the simulated rig: drawn at random, and a fixed one."""

import math
from dataclasses import replace

import numpy as np

from navapp.geometry.camera import Camera
from navapp.geometry.rig import StereoRig
from navapp.geometry.transform import FloatArray, RigidTransform, rotation_from_vector
from sim_devices.layout import left_from_table
from sim_devices.mirror_optics import MirrorSetup, Panel, Plate
from sim_devices.rigs import WORKING_DISTANCE_MM

WIDTH_PX, HEIGHT_PX = 1920, 1080
_DIAGONAL_MM = 24.0 * 25.4
PITCH_MM = _DIAGONAL_MM / math.hypot(WIDTH_PX, HEIGHT_PX)
_BEFORE_CAMERA = np.array([0.0, 0.0, WORKING_DISTANCE_MM])
# Of the fixed set-up: the panel; middle of the bone that is seen, on the table of the simulated
# room; where the eye is, and the plate's middle before it.
_PRACTICE_PX, _PRACTICE_DIAGONAL_MM = (1280, 800), 10.1 * 25.4
_BONE_ON_TABLE_MM = (-2.0, -24.0, 11.0)
# The site's light is dimmed, so that guides stand out.
_DIM_LX = 250.0
_LEAN_DEG, _EYE_MM, _PLATE_MM = 30.0, 520.0, 180.0


def draw_setup(rng: np.random.Generator, about_mm: FloatArray = _BEFORE_CAMERA) -> MirrorSetup:
    """A 24 inch monitor seen near the bone's depth from an eye 350 to 550 mm away.

    The plate stands at some 45 degrees between eye and site; the monitor is where its reflection
    is wanted, the right way round or upside down, with or without flips of its own.

    Args:
        rng: of all that is drawn.
        about_mm: (3,) in the left camera's frame; the site lies within 15 mm of it, each way.
    """
    site = about_mm + rng.uniform(-15.0, 15.0, 3)
    # The eye stands beside the cameras: they must not see the site through the plate.
    leaning = math.radians(rng.uniform(25.0, 45.0))
    turn = rotation_from_vector((leaning, 0.0, 0.0)) @ rotation_from_vector(
        (0.0, 0.0, rng.uniform(-0.3, 0.3))
    )
    right, down, ahead = (turn @ rotation_from_vector(rng.normal(0.0, 0.05, 3))).T
    distance = rng.uniform(350.0, 550.0)
    eye = site - distance * ahead
    slope = math.radians(rng.uniform(40.0, 50.0))
    normal = math.cos(slope) * ahead + math.sin(slope) * down
    front = eye + rng.uniform(0.3, 0.38) * distance * ahead
    plate = Plate(front, normal, rng.uniform(1.0, 4.0))
    seen = rotation_from_vector(rng.normal(0.0, 0.03, 3)) @ np.column_stack([right, down, ahead])
    middle = site + rng.uniform(-30.0, 30.0) * ahead + rng.uniform(-15.0, 15.0) * right
    size_px, is_upright = (WIDTH_PX, HEIGHT_PX), rng.random() < 0.5
    panel = _place_panel(plate, middle, seen, size_px, _DIAGONAL_MM, is_upright=is_upright)
    flips = rng.random(2) < 0.5
    panel = replace(panel, flips_columns=bool(flips[0]), flips_rows=bool(flips[1]))
    setup = MirrorSetup(eye, right, site, plate, panel)
    return replace(setup, site_lx=rng.uniform(200.0, 800.0))


def make_practice_setup(rig: StereoRig) -> MirrorSetup:
    """A 10 inch panel seen amid the opened knee, from an eye 520 mm away and beside the cameras.

    The plate, of 3 mm, stands at 45 degrees; the panel hangs over the thigh and faces it.
    """
    on_table = left_from_table(rig)
    axes, site = on_table.rotation, on_table.apply(np.array([_BONE_ON_TABLE_MM]))[0]
    lean = math.radians(_LEAN_DEG)
    ahead = axes @ (-math.sin(lean), 0.0, math.cos(lean))
    down = axes[:, 1]
    right = np.cross(down, ahead)
    eye = site - _EYE_MM * ahead
    plate = Plate(eye + _PLATE_MM * ahead, math.sqrt(0.5) * (ahead + down))
    seen = np.column_stack([right, down, ahead])
    panel = _place_panel(plate, site, seen, _PRACTICE_PX, _PRACTICE_DIAGONAL_MM)
    return MirrorSetup(eye, right, site, plate, panel, _DIM_LX)


def _place_panel(
    plate: Plate,
    middle: FloatArray,
    seen: FloatArray,
    size_px: tuple[int, int],
    diagonal_mm: float,
    *,
    is_upright: bool = True,
) -> Panel:
    """The monitor whose middle and axes (columns right, down, ahead) are to be seen there."""
    n = plate.normal
    turned = seen - 2.0 * np.outer(n, n @ seen)
    place = middle - 2.0 * float((middle - plate.front_mm) @ n) * n
    # From its front a monitor's picture is not mirrored; from there, right is left.
    sign = 1.0 if is_upright else -1.0
    across, down = -sign * turned[:, 0], sign * turned[:, 1]
    pitch_mm = diagonal_mm / math.hypot(*size_px)
    half = 0.5 * pitch_mm * (np.array(size_px) - 1)
    origin = place - half[0] * across - half[1] * down
    return Panel(origin, across, down, pitch_mm, *size_px)


def make_eye_camera(
    width: int, height: int, focal_px: float, distortion: tuple[float, ...] = ()
) -> Camera:
    """A camera of an eye, its axis through the picture's middle."""
    middle = (0.5 * (width - 1), 0.5 * (height - 1))
    matrix = np.array([[focal_px, 0.0, middle[0]], [0.0, focal_px, middle[1]], [0, 0, 1.0]])
    return Camera(matrix, np.array(distortion), width, height)


def look_at_site(
    setup: MirrorSetup, shift_mm: FloatArray | None = None, roll_rad: float = 0.0
) -> RigidTransform:
    """`eye_from_left` of a camera at the eye's place, or beside it, aimed at the site upright."""
    eye = setup.eye_mm if shift_mm is None else setup.eye_mm + shift_mm
    ahead = setup.site_mm - eye
    ahead = ahead / np.linalg.norm(ahead)
    right = setup.right - (setup.right @ ahead) * ahead
    right /= np.linalg.norm(right)
    axes = np.vstack([right, np.cross(ahead, right), ahead])
    axes = rotation_from_vector((0.0, 0.0, roll_rad)) @ axes
    return RigidTransform.from_parts("eye", "left", axes, -axes @ eye)
