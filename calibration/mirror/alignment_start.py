"""Where a solve by alignments begins: the eye as a camera whose picture is the display's."""

from dataclasses import dataclass

import cv2
import numpy as np

from calibration.rig.initial_rig import matrix_of
from navapp.errors import ResultError
from navapp.geometry.display_model import DisplayModel, ViewingEye
from navapp.geometry.display_model_optics import Glass, VirtualScreen
from navapp.geometry.transform import FloatArray

# Distances of an eye from the screen's picture that are tried.
_DISTANCES_MM = (300.0, 400.0, 500.0, 650.0)


@dataclass(frozen=True, slots=True)
class AlignedDisplay:
    """What is known of a display whose crosses are aligned."""

    # width_px, height_px: of the picture that it is handed.
    width_px: int
    height_px: int
    pitch_mm: float
    glass_mm: float = 3.0
    # angle between the plate's normal and the line of sight; the monitor is above.
    mirror_deg: float = 45.0
    refractive_index: float = 1.52
    reads_upside_down: bool = False  # the eye sees text on its head when it is shown as it is
    viewing_eye: ViewingEye = "right"

    @property
    def reading(self) -> str:
        """How the eye reads what is shown as it is, in words."""
        return "on its head" if self.reads_upside_down else "upright"


def make_first_model(
    display: AlignedDisplay, pixels: FloatArray, points_mm: FloatArray
) -> DisplayModel:
    """A model that least squares can begin with.

    An eye is a pinhole camera whose picture is the screen: its focal length in px is the distance
    over the pitch. The distance is tried, and so is whether the picture is seen mirrored; the
    points must not lie in one plane.

    Raises:
        ResultError: no eye sees these points so.
    """
    best = None
    for is_mirrored in (True, False):
        seen = pixels * (-1.0, 1.0) + (display.width_px - 1.0, 0.0) if is_mirrored else pixels
        for distance in _DISTANCES_MM:
            found = _pose(display, seen, points_mm, distance)
            if found is not None and (best is None or found[0] < best[0]):
                best = (*found, distance, is_mirrored)
    if best is None:
        raise ResultError(
            "no eye sees the aligned points where the crosses were",
            remedy="align points at three depths over 60 mm, not all of one flat board",
        )
    _, pose, distance, is_mirrored = best
    try:
        return _model_of(display, pose, distance, is_mirrored)
    except ValueError as error:
        raise ResultError(
            "no eye sees the aligned points where the crosses were",
            remedy="align every cross with its corner, and begin anew",
        ) from error


def _pose(
    display: AlignedDisplay, seen_px: FloatArray, points_mm: FloatArray, distance_mm: float
) -> tuple[float, FloatArray] | None:
    """Mean distance px, and (4, 4) eye from left camera; None when there is none."""
    focal = distance_mm / display.pitch_mm
    matrix = np.array(
        [
            [focal, 0.0, 0.5 * (display.width_px - 1)],
            [0.0, focal, 0.5 * (display.height_px - 1)],
            [0.0, 0.0, 1.0],
        ]
    )
    pixels = np.ascontiguousarray(seen_px)
    try:
        is_found, turn, shift = cv2.solvePnP(
            points_mm, pixels, matrix, None, flags=cv2.SOLVEPNP_SQPNP
        )
        if not is_found:
            return None
        turn, shift = cv2.solvePnPRefineLM(points_mm, pixels, matrix, None, turn, shift)
        drawn, _ = cv2.projectPoints(points_mm, turn, shift, matrix, None)
    except cv2.error:
        return None
    off_px = float(np.median(np.linalg.norm(drawn.reshape(-1, 2) - pixels, axis=1)))
    pose = matrix_of(np.concatenate([np.ravel(turn), np.ravel(shift)]))
    in_eye = points_mm @ pose[:3, :3].T + pose[:3, 3]
    return (off_px, pose) if np.isfinite(off_px) and (in_eye[:, 2] > 0.0).all() else None


def _model_of(
    display: AlignedDisplay, pose: FloatArray, distance_mm: float, is_mirrored: bool
) -> DisplayModel:
    right, below, ahead = pose[:3, :3]
    eye = -pose[:3, :3].T @ pose[:3, 3]
    across = -right if is_mirrored else right
    half = 0.5 * display.pitch_mm * np.array([display.width_px - 1, display.height_px - 1])
    origin = eye + distance_mm * ahead - half[0] * across - half[1] * below
    screen = VirtualScreen(
        origin, across, below, display.pitch_mm, display.width_px, display.height_px
    )
    glass, down = None, -below if display.reads_upside_down else below
    if display.glass_mm > 0.0:
        slope = np.radians(display.mirror_deg)
        normal = np.cos(slope) * ahead + np.sin(slope) * down
        glass = Glass(display.glass_mm, normal, display.refractive_index)
    columns, rows = is_mirrored, False
    if display.reads_upside_down:
        columns, rows = not columns, not rows
    return DisplayModel(screen, glass, eye, columns, rows, display.viewing_eye)
