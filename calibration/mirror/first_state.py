"""Where a solve by views begins: each part by OpenCV's functions, then put together."""

from dataclasses import dataclass

import cv2
import numpy as np

from calibration.mirror.seen_views import Scene, SeenView
from calibration.mirror.view_state import ViewState
from calibration.rig.initial_rig import matrix_of, pose_of
from navapp.errors import ResultError
from navapp.geometry.camera import Camera
from navapp.geometry.display_model_optics import Glass, VirtualScreen
from navapp.geometry.transform import FloatArray, nearest_rotation

_CRITERIA = (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 100, 1e-9)
_FLAGS = cv2.CALIB_USE_INTRINSIC_GUESS | cv2.CALIB_FIX_K3


@dataclass(frozen=True, slots=True)
class Told:
    """What a person tells of the set-up."""

    # of the display's pixels; None: solved for, which needs views some centimetres apart.
    pitch_mm: float | None = None
    glass_mm: float = 3.0  # thickness of the plate
    # angle between the plate's normal and the line of sight; the monitor is above.
    mirror_deg: float = 45.0
    refractive_index: float = 1.52


def make_first_state(
    scene: Scene, views: list[SeenView], told: Told, lens: Camera | None
) -> ViewState:
    """A state near enough for least squares.

    Args:
        scene: what all views have in common.
        views: V of them.
        told: of the set-up.
        lens: of the eye's camera, when it is calibrated.

    Raises:
        ResultError: no pose can be told from the marks.
    """
    camera = lens or _solve_lens(scene, views)
    boards, eyes, screens = [], [], []
    for view in views:
        left_from_board = pose_of(scene.board, view.left, scene.rig.left)
        eye_from_board = pose_of(scene.board, view.eye_site, camera)
        eye_from_screen = _solve_pose(_on_screen(scene, view), view.eye_screen.pixels, camera)
        if left_from_board is None or eye_from_board is None or eye_from_screen is None:
            raise ResultError(
                f"the marks of view {view.index} tell no pose",
                remedy="compare the board with its file, and leave this view out",
            )
        boards.append(matrix_of(left_from_board))
        eyes.append(matrix_of(eye_from_board) @ np.linalg.inv(boards[-1]))
        screens.append(eye_from_screen)
    poses, placed = np.array(eyes), np.array(boards)
    screen = _place_screen(scene, views, poses, np.array(screens), told)
    _, y, z = nearest_rotation(poses[:, :3, :3].mean(axis=0))
    slope = np.radians(told.mirror_deg)
    glass = Glass(told.glass_mm, np.cos(slope) * z + np.sin(slope) * y, told.refractive_index)
    coefficients = np.zeros(4)
    given = camera.distortion[:4]
    coefficients[: len(given)] = given
    matrix = camera.matrix
    return ViewState(
        np.r_[matrix[0, 0], matrix[1, 1], matrix[:2, 2], coefficients],
        screen, glass, poses[:, :3, :3], poses[:, :3, 3], placed[:, :3, :3], placed[:, :3, 3],
    )  # fmt: skip


def _on_screen(scene: Scene, view: SeenView) -> FloatArray:
    """(n, 3) px of the pattern, right-handed as it is seen."""
    pixels = scene.pattern.pixels[view.eye_screen.ids]
    sign = -1.0 if view.is_mirrored else 1.0
    return np.column_stack([sign * pixels[:, 0], pixels[:, 1], np.zeros(len(pixels))])


def _solve_lens(scene: Scene, views: list[SeenView]) -> Camera:
    """The eye's camera by the board and by the pattern, each flat, in all views."""
    objects, pixels = [], []
    for view in views:
        objects.append(scene.board.points_mm[view.eye_site.ids].astype(np.float32))
        pixels.append(view.eye_site.pixels.astype(np.float32))
        objects.append(_on_screen(scene, view).astype(np.float32))
        pixels.append(view.eye_screen.pixels.astype(np.float32))
    try:
        first = cv2.initCameraMatrix2D(objects, pixels, scene.eye_size)
        _, matrix, distortion, _, _ = cv2.calibrateCamera(
            objects, pixels, scene.eye_size, first, None, flags=_FLAGS, criteria=_CRITERIA
        )
        coefficients = np.asarray(distortion, dtype=np.float64).reshape(-1)[:4]
        return Camera(np.asarray(matrix, dtype=np.float64), coefficients, *scene.eye_size)
    except (cv2.error, ValueError) as error:
        raise ResultError(
            "no camera at the eye's place explains its pictures",
            remedy="tilt the board by 20 degrees and more in half of the views",
        ) from error


def _solve_pose(points: FloatArray, pixels: FloatArray, camera: Camera) -> FloatArray | None:
    """(4, 4) camera from points, which lie in a plane; None when it cannot be told."""
    middle = points.mean(axis=0)
    lens = np.array(camera.matrix), np.array(camera.distortion)
    try:
        is_found, turn, shift = cv2.solvePnP(
            points - middle, pixels, *lens, flags=cv2.SOLVEPNP_IPPE
        )
        if is_found:
            turn, shift = cv2.solvePnPRefineLM(points - middle, pixels, *lens, turn, shift)
    except cv2.error:
        return None
    if not is_found:
        return None
    pose = matrix_of(np.concatenate([np.ravel(turn), np.ravel(shift)]))
    pose[:3, 3] -= pose[:3, :3] @ middle
    return pose


def _place_screen(
    scene: Scene, views: list[SeenView], eyes: FloatArray, screens: FloatArray, told: Told
) -> VirtualScreen:
    """The screen in the left camera's frame.

    Each view says how the screen is turned, and where its first pixel is in px: the pitch is what
    makes all of them name one place.
    """
    turns = eyes[:, :3, :3].transpose(0, 2, 1)
    centres = -np.einsum("vij,vj->vi", turns, eyes[:, :3, 3])
    rays = np.einsum("vij,vj->vi", turns, screens[:, :3, 3])
    turn = nearest_rotation((turns @ screens[:, :3, :3]).mean(axis=0))
    pitch = told.pitch_mm
    if pitch is None:
        off_rays, off_centres = rays - rays.mean(axis=0), centres - centres.mean(axis=0)
        pitch = float(-(off_rays * off_centres).sum() / (off_rays**2).sum())
        if not pitch > 0.0:
            raise ResultError(
                "the views do not tell how large the display's pixels are",
                remedy="tell it with --pitch-mm, or move the eye's camera by some centimetres",
            )
    sign = -1.0 if views[0].is_mirrored else 1.0
    origin = centres.mean(axis=0) + pitch * rays.mean(axis=0)
    width, height = scene.pattern.width_px, scene.pattern.height_px
    return VirtualScreen(origin, sign * turn[:, 0], turn[:, 1], pitch, width, height)
