"""Views of a simulated set-up as marks with noise, without pictures."""

import numpy as np

from calibration.mirror.screen_pattern import make_pattern
from calibration.mirror.seen_views import Scene, SeenView
from calibration.targets.boards import Board, parse_board
from calibration.targets.detection import SeenBoard
from navapp.geometry.camera import Camera
from navapp.geometry.display_model_optics import VirtualScreen
from navapp.geometry.transform import RigidTransform, rotation_from_vector
from sim_devices.mirror_optics import MirrorSetup
from sim_devices.mirror_setups import HEIGHT_PX, WIDTH_PX, look_at_site, make_eye_camera
from sim_devices.mirror_view import MirrorView
from sim_devices.rigs import make_default_rig

BOARD = parse_board(
    {
        "type": "charuco", "squares_x": 11, "squares_y": 8, "square_mm": 10.0,
        "marker_mm": 7.5, "dictionary": "DICT_4X4_100",
    }
)  # fmt: skip
PATTERN = make_pattern(WIDTH_PX, HEIGHT_PX, BOARD)
EYE_SIZE = (1600, 1200)
EYE_FOCAL_PX = 2200.0


def scene() -> Scene:
    return Scene(BOARD, PATTERN, make_default_rig(), EYE_SIZE)


def eye_camera(rng: np.random.Generator, factor: float = 1.0) -> Camera:
    """A camera that nobody knows beforehand; its pictures so many times as large."""
    size = (round(factor * EYE_SIZE[0]), round(factor * EYE_SIZE[1]))
    camera = make_eye_camera(*size, factor * EYE_FOCAL_PX * rng.uniform(0.95, 1.05))
    matrix = np.array(camera.matrix)
    matrix[:2, 2] += rng.normal(0.0, 8.0, 2)
    distortion = np.array(
        [rng.normal(-0.08, 0.02), rng.normal(0.05, 0.02), *rng.normal(0, 3e-4, 2)]
    )
    return Camera(matrix, distortion, *size)  # fmt: skip


def board_pose(
    rng: np.random.Generator, setup: MirrorSetup, board: Board = BOARD
) -> RigidTransform:
    """The board at the site, facing between cameras and eye, tilted."""
    ahead = setup.site_mm - setup.eye_mm
    ahead = ahead / np.linalg.norm(ahead) + np.array([0.0, 0.0, 1.0])
    ahead /= np.linalg.norm(ahead)
    right = np.array([1.0, 0.0, 0.0])
    right -= (right @ ahead) * ahead
    right /= np.linalg.norm(right)
    axes = np.column_stack([right, np.cross(ahead, right), ahead])
    tilt = rotation_from_vector(np.radians(22.0) * rng.uniform(-1.0, 1.0, 3) * (1.0, 1.0, 0.5))
    turn = tilt @ axes
    middle = setup.site_mm + rng.uniform(-1.0, 1.0, 3) * (15.0, 15.0, 25.0)
    return RigidTransform.from_parts(
        "left", "board", turn, middle - turn @ board.points_mm.mean(axis=0)
    )


def eye_pose(rng: np.random.Generator, setup: MirrorSetup, number: int) -> RigidTransform:
    """The camera at the eye's place, in every other view some centimetres beside it."""
    beside = rng.normal(0.0, 1.0, 3) if number % 2 == 0 else rng.uniform(-25.0, 25.0, 3)
    aimed = look_at_site(setup, beside, rng.normal(0.0, 0.05))
    turn = rotation_from_vector(rng.normal(0.0, 0.02, 3))
    return RigidTransform.from_parts(
        "eye", "left", turn @ aimed.rotation, turn @ aimed.translation_mm
    )


def seen(points_px: np.ndarray, camera: Camera, rng: np.random.Generator, sd: float) -> SeenBoard:
    noisy = points_px + rng.normal(0.0, sd, points_px.shape)
    size = (camera.width - 8.0, camera.height - 8.0)
    inside = ((points_px > 8.0) & (points_px < size)).all(axis=1)
    ids = np.flatnonzero(inside)
    return SeenBoard(ids, noisy[ids], np.full(len(ids), sd), 0.7)


def drawn_views(
    rng: np.random.Generator, setup: MirrorSetup, n: int = 8, noise_px: float = 0.05,
    every: int = 1, panel: VirtualScreen | None = None,
) -> tuple[list[SeenView], np.ndarray]:  # fmt: skip
    """Marks of n views, and (3,) the middle of those centres that are the eye's.

    Args:
        every: so many of the pattern's marks stand for one that is used.
        panel: where the pattern is seen instead of in the set-up's flat one.
    """
    camera, rig = eye_camera(rng), make_default_rig()
    views, centres = [], []
    for number in range(n):
        view = MirrorView(setup, camera, eye_pose(rng, setup, number))
        if number % 2 == 0:
            centres.append(view.eye_from_left.inverse().translation_mm)
        pose = board_pose(rng, setup)
        points = pose.apply(BOARD.points_mm)
        shown_px = view.screen_px(PATTERN.pixels)
        if panel is not None:
            shown_px = camera.project(view.eye_from_left.apply(panel.points_mm(PATTERN.pixels)))
        screen = seen(shown_px, camera, rng, noise_px)
        thin = np.flatnonzero(rng.random(len(screen.ids)) < 1.0 / every)
        views.append(
            SeenView(
                number,
                seen(view.site_px(points), camera, rng, noise_px),
                seen(rig.left.project(points), rig.left, rng, noise_px),
                seen(
                    rig.right.project(rig.right_from_left.apply(points)), rig.right, rng, noise_px
                ),
                SeenBoard(screen.ids[thin], screen.pixels[thin], screen.sigma_px[thin], 0.7),
                is_mirrored=not (setup.panel.flips_columns ^ setup.panel.flips_rows),
                is_eye=number % 2 == 0,
            )
        )
    return views, np.mean(centres, axis=0)
