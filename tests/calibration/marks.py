"""Marks of a board as two cameras would see them, without pictures."""

import numpy as np

from calibration.targets.boards import Board, parse_board
from calibration.targets.detection import SeenBoard
from calibration.targets.seen_pairs import SeenPair
from navapp.geometry.camera import Camera
from navapp.geometry.rig import StereoRig
from navapp.geometry.transform import RigidTransform, rotation_from_vector

WIDTH, HEIGHT = 1280, 720
BOARD = parse_board(
    {
        "type": "charuco", "squares_x": 11, "squares_y": 8, "square_mm": 15.0,
        "marker_mm": 11.0, "dictionary": "DICT_4X4_100",
    }
)  # fmt: skip


def drawn_rig(rng: np.random.Generator) -> StereoRig:
    """A rig that nobody else has, with its working volume at some 450 mm."""
    cameras = [
        Camera(
            np.array(
                [
                    [rng.uniform(1350, 1700), 0.0, 640 + rng.normal(0, 10)],
                    [0.0, rng.uniform(1350, 1700), 360 + rng.normal(0, 10)],
                    [0.0, 0.0, 1.0],
                ]
            ),
            np.array(
                [rng.normal(-0.1, 0.02), rng.normal(0.07, 0.02), *rng.normal(0, 4e-4, 2),
                 rng.normal(0.02, 0.01)]
            ),
            WIDTH,
            HEIGHT,
        )
        for _ in range(2)
    ]  # fmt: skip
    turn = rotation_from_vector(rng.normal((0.0, np.radians(5.0), 0.0), 0.01))
    centre = np.array([rng.uniform(70.0, 90.0), *rng.normal(0.0, 2.0, 2)])
    pose = RigidTransform.from_parts("right", "left", turn, -turn @ centre)
    return StereoRig(cameras[0], cameras[1], pose)


def drawn_pose(
    rng: np.random.Generator, board: Board = BOARD, tilt_deg: float = 30.0, aside_mm: float = 60.0
) -> RigidTransform:
    """Left camera from board: tilted, somewhere in the working volume."""
    axis = rng.normal(size=2)
    tilt = np.radians(tilt_deg) * rng.uniform(0.3, 1.0) * axis / np.linalg.norm(axis)
    rotation = rotation_from_vector((0.0, 0.0, rng.uniform(-0.5, 0.5)))
    rotation = rotation_from_vector((*tilt, 0.0)) @ rotation
    place = np.array([*rng.uniform(-1.0, 1.0, 2) * (aside_mm, 0.6 * aside_mm), 0.0])
    place += (40.0, 0.0, rng.uniform(360.0, 540.0))
    place -= rotation @ board.points_mm.mean(axis=0)
    return RigidTransform.from_parts("left", "board", rotation, place)


def seen_pair(
    index: int,
    rig: StereoRig,
    pose: RigidTransform,
    rng: np.random.Generator,
    *,
    noise_px: float = 0.05,
    board: Board = BOARD,
    off_mm: np.ndarray | None = None,
    moved_right: RigidTransform | None = None,
) -> SeenPair:
    """What both cameras see.

    Args:
        off_mm: (N, 3) how far the marks are from where they should be.
        moved_right: another pose that the right camera sees.
    """
    points_mm = board.points_mm if off_mm is None else board.points_mm + off_mm
    right = rig.right_from_left @ (pose if moved_right is None else moved_right)
    views = []
    for camera, camera_pose in ((rig.left, pose), (rig.right, right)):
        pixels = camera.project(camera_pose.apply(points_mm))
        is_in = (pixels >= 5).all(axis=1) & (pixels < (WIDTH - 5, HEIGHT - 5)).all(axis=1)
        ids = np.flatnonzero(is_in)
        noise = rng.normal(0.0, noise_px, (len(ids), 2))
        views.append(SeenBoard(ids, pixels[ids] + noise, np.full(len(ids), noise_px), 0.6))
    return SeenPair(index, *views)


def drawn_pairs(rig: StereoRig, rng: np.random.Generator, n: int = 16, **kwargs) -> list[SeenPair]:
    """Pairs in which both cameras see most of the board."""
    pairs: list[SeenPair] = []
    while len(pairs) < n:
        pair = seen_pair(len(pairs), rig, drawn_pose(rng), rng, **kwargs)
        if min(len(pair.left.ids), len(pair.right.ids)) > 30:
            pairs.append(pair)
    return pairs
