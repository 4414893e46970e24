"""What an eye sees in the mirror, as a camera that everything can be drawn in."""

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from navapp.geometry.camera import Camera
from navapp.geometry.display_model_optics import N_TURNS, Glass, VirtualScreen
from navapp.geometry.transform import FloatArray, RigidTransform

if TYPE_CHECKING:
    # What is compiled is loaded at first use.
    from navapp.geometry.display_view_kernels import Optics

LEAST_DISTANCE_MM = 1e-6
WRONG_SIDE = "the eye is not on the side of the screen from which it is calibrated"


@dataclass(frozen=True, eq=False)
class EyeView:
    """The screen in the mirror as one eye sees it.

    A picture drawn in `camera` is upright and readable to the eye; `to_display` turns it into the
    one that the display's backend is handed.
    """

    camera: Camera  # pinhole at the eye, its picture plane parallel to the screen
    eye_from_left: RigidTransform  # from the left camera's frame
    screen: VirtualScreen
    glass: Glass | None
    # flips_columns, flips_rows: how the display shows what the eye reads.
    flips_columns: bool
    flips_rows: bool

    @cached_property
    def _optics(self) -> "Optics":
        return _make_optics(self.screen, self.glass, self.eye_from_left.inverse().translation_mm)

    def to_display(self, image: NDArray[Any]) -> NDArray[Any]:
        """A picture (H, W, ...) as the eye reads it, turned for the display; contiguous."""
        import cv2

        # A copy even when nothing is flipped: the display keeps it while the next one is drawn.
        if not (self.flips_columns or self.flips_rows):
            return np.array(image, order="C")
        both = self.flips_columns and self.flips_rows
        return np.asarray(cv2.flip(image, -1 if both else 1 if self.flips_columns else 0))

    def to_display_px(self, pixels: ArrayLike) -> FloatArray:
        """(N, 2) of a picture as the eye reads it, in the display's picture; and back again."""
        turned = np.array(pixels, dtype=np.float64).reshape(-1, 2)
        if self.flips_columns:
            turned[:, 0] = self.screen.width_px - 1.0 - turned[:, 0]
        if self.flips_rows:
            turned[:, 1] = self.screen.height_px - 1.0 - turned[:, 1]
        return turned

    def warp(self, points_left_mm: ArrayLike) -> FloatArray:
        """(N, 3) mm in the camera's frame, so that `camera.project` gives where they are drawn.

        The glass and the screen's bulge are in the direction; the depth is that of the point
        itself. NaN at and behind the eye.
        """
        points = np.ascontiguousarray(points_left_mm, dtype=np.float64).reshape(-1, 3)
        pixels = np.empty((len(points), 2))
        from navapp.geometry.display_view_kernels import project_to_screen

        project_to_screen(points, self._optics, pixels)
        pixels = self.to_display_px(pixels)
        K = self.camera.matrix
        warped = np.empty_like(points)
        warped[:, 2] = self.eye_from_left.apply(points)[:, 2]
        warped[:, 0] = (pixels[:, 0] - K[0, 2]) / K[0, 0] * warped[:, 2]
        warped[:, 1] = (pixels[:, 1] - K[1, 2]) / K[1, 1] * warped[:, 2]
        return warped


def project(
    screen: VirtualScreen, glass: Glass | None, eye_mm: FloatArray, points_mm: FloatArray
) -> FloatArray:
    """(N, 2) px of the display's picture where points (N, 3) are drawn for an eye at (3,).

    NaN at and behind the eye.
    """
    from navapp.geometry.display_view_kernels import project_to_screen

    pixels = np.empty((len(points_mm), 2))
    points = np.array(points_mm, dtype=np.float64, order="C")
    project_to_screen(points, _make_optics(screen, glass, eye_mm), pixels)
    return pixels


def _make_optics(screen: VirtualScreen, glass: Glass | None, eye_mm: FloatArray) -> "Optics":
    """What the compiled projection reads.

    All arrays are copies: for read-only ones it would be compiled once more.
    """
    from navapp.geometry.display_view_kernels import Optics

    return Optics(
        np.array(eye_mm),
        np.array(screen.middle_mm),
        np.array(screen.axes),
        np.array(screen.half_mm),
        float(screen.pitch_mm),
        float(screen.bulge_mm),
        np.array([0.0, 0.0, 1.0] if glass is None else glass.normal),
        0.0 if glass is None else float(glass.thickness_mm),
        1.0 if glass is None else float(glass.refractive_index),
        N_TURNS,
    )


def make_view(
    screen: VirtualScreen,
    glass: Glass | None,
    eye_mm: FloatArray,
    flips: tuple[bool, bool],
) -> EyeView:
    """The view of an eye at (3,).

    Args:
        screen: that is seen.
        glass: before the site.
        eye_mm: (3,) in the left camera's frame.
        flips: of columns and rows, from the picture as the eye reads it to the display's.

    Raises:
        ValueError: the eye is in the screen's plane, or on the side from which these flips show
            everything mirrored.
    """
    right = screen.across * (-1.0 if flips[0] else 1.0)
    below = screen.down * (-1.0 if flips[1] else 1.0)
    ahead = np.cross(right, below)
    distance_mm = float(ahead @ (screen.origin_mm - eye_mm))
    if distance_mm < LEAST_DISTANCE_MM:
        raise ValueError(WRONG_SIDE)
    focal_px = distance_mm / screen.pitch_mm
    centre_px = np.array(
        [screen.across @ (eye_mm - screen.origin_mm), screen.down @ (eye_mm - screen.origin_mm)]
    ) / screen.pitch_mm  # fmt: skip
    for k, last in enumerate((screen.width_px - 1.0, screen.height_px - 1.0)):
        if flips[k]:
            centre_px[k] = last - centre_px[k]
    matrix = np.array([[focal_px, 0.0, centre_px[0]], [0.0, focal_px, centre_px[1]], [0, 0, 1.0]])
    camera = Camera(matrix, np.zeros(0), screen.width_px, screen.height_px)
    rotation = np.vstack([right, below, ahead])
    pose = RigidTransform.from_parts("eye", "left", rotation, -rotation @ eye_mm)
    return EyeView(camera, pose, screen, glass, flips[0], flips[1])
