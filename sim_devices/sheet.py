"""A flat printed sheet in front of the simulated cameras, in a hand that moves it."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.camera import Camera
from navapp.geometry.rig import StereoRig
from navapp.geometry.transform import FloatArray, RigidTransform
from sim_devices.camera import Scene
from sim_devices.picture_motion import compute_path_px
from sim_devices.pixel_rays import corner_rays
from sim_devices.rigs import NO_TURN, Turn, camera_from_left, make_default_rig
from sim_devices.sensor import Eye, Rows
from sim_devices.sheet_kernels import draw_sheet

# Radiance of ink, of paper in full light and of the table behind.
_INK, _PAPER, _GROUND = 0.05, 0.55, 0.08
# Light from everywhere, and from a lamp beside the cameras.
_AMBIENT = 0.35
_N_SAMPLES = 3
_EDGE_PX = 2


@dataclass(frozen=True, slots=True, eq=False)
class PrintedSheet:
    """A printed sheet: its picture, resolution and place.

    Raises:
        ValueError: no picture, or no size.
    """

    white: NDArray[np.uint8]  # (h, w) uint8, 255 where the paper is white, 0 where it is black
    px_per_mm: float  # of it
    # left_mm, top_mm: the sheet's own x and y at the left and upper edge of the first pixel. Its
    # frame: x along the rows, y down, z away from who reads it.
    left_mm: float
    top_mm: float

    def __post_init__(self) -> None:
        if self.white.ndim != 2 or min(self.white.shape) < 2 or not self.px_per_mm > 0.0:
            raise ValueError("a printed sheet is a grey picture with pixels per mm")

    @property
    def middle_mm(self) -> FloatArray:
        """(3,) in the sheet's frame."""
        height, width = self.white.shape
        half = 0.5 / self.px_per_mm
        return np.array([self.left_mm + half * width, self.top_mm + half * height, 0.0])

    @property
    def corners_mm(self) -> FloatArray:
        """(4, 3) in the sheet's frame."""
        height, width = (side / self.px_per_mm for side in self.white.shape)
        x, y = self.left_mm, self.top_mm
        return np.array(
            [[x, y, 0], [x + width, y, 0], [x + width, y + height, 0], [x, y + height, 0]]
        )


@dataclass(frozen=True, slots=True, eq=False)
class _Level:
    """The sheet's radiance at one fineness: pixels of `texture` cover `step` printed ones."""

    texture: NDArray[np.float32]
    step: int


class SheetScene:
    """What the cameras see: the sheet above a table.

    Args:
        sheet: that is shown.
        left_from_sheet: its pose at a world time in ns; the caller moves it.
        rig: of the two cameras; the simulated room's when absent.
        ground: radiance of what is not the sheet.
    """

    def __init__(
        self,
        sheet: PrintedSheet,
        left_from_sheet: Callable[[int], RigidTransform],
        rig: StereoRig | None = None,
        ground: float = _GROUND,
    ) -> None:
        self.rig = rig or make_default_rig()
        self._ground = ground
        self._sheet = sheet
        self._left_from_sheet = left_from_sheet
        self._levels = _levels(sheet.white)

    def render(
        self,
        eye: Eye,
        time_ns: int,
        scale: float = 1.0,
        turn_rad: Turn = NO_TURN,
        rows: Rows | None = None,
    ) -> NDArray[np.float32]:
        """(H, W, 3) BGR linear radiance; 1.0 is a full well at nominal exposure."""
        camera, rays = self._optics(eye, scale)
        pose = camera_from_left(self.rig, eye, turn_rad) @ self._left_from_sheet(time_ns)
        picture = np.full((camera.height, camera.width), self._ground, np.float32)
        box = _box(camera, pose.apply(self._sheet.corners_mm))
        if box is not None:
            self._draw(camera, rays, pose, box, picture)
        return np.repeat(picture[:, :, None], 3, axis=2)

    def path_px(self, from_ns: int, until_ns: int) -> float:
        """How far a corner of the sheet goes in the left picture in an interval."""
        corners_mm, pose = self._sheet.corners_mm, self._left_from_sheet
        return compute_path_px(self.rig.left, corners_mm, pose, from_ns, until_ns)

    def draw_alone(
        self, eye: Eye, scale: float, camera_from_sheet: RigidTransform
    ) -> tuple[tuple[slice, slice], NDArray[np.float32]] | None:
        """Rows and columns that the sheet may touch, and its radiance there.

        Not a number beside the sheet, if that is the scene's ground; None: it is not in view.
        """
        camera, rays = self._optics(eye, scale)
        box = _box(camera, camera_from_sheet.apply(self._sheet.corners_mm))
        if box is None:
            return None
        picture = np.full((camera.height, camera.width), self._ground, np.float32)
        self._draw(camera, rays, camera_from_sheet, box, picture)
        part = slice(int(box[0]), int(box[1])), slice(int(box[2]), int(box[3]))
        return part, picture[part]

    def _draw(
        self,
        camera: Camera,
        rays: FloatArray,
        camera_from_sheet: RigidTransform,
        box: NDArray[np.int64],
        picture: NDArray[np.float32],
    ) -> None:
        place = camera_from_sheet.translation_mm
        normal = camera_from_sheet.rotation[:, 2]
        middle = camera_from_sheet.apply(self._sheet.middle_mm)
        towards = float(normal @ middle) / float(np.linalg.norm(middle))
        level = self._level(camera, camera_from_sheet)
        # Nothing is printed on the back.
        texture = level.texture if towards > 0.0 else np.full_like(level.texture, _PAPER)
        plane = np.column_stack([camera_from_sheet.rotation[:, :2], place])
        scale = self._sheet.px_per_mm / level.step
        pixels = np.array(
            [
                [scale, 0.0, -scale * self._sheet.left_mm - 0.5],
                [0.0, scale, -scale * self._sheet.top_mm - 0.5],
                [0.0, 0.0, 1.0],
            ]
        )
        # The third row is the inverse of the depth: positive in front of the camera.
        homography = pixels @ np.linalg.inv(plane)
        shade = _AMBIENT + (1.0 - _AMBIENT) * abs(towards)
        draw_sheet(rays, homography, texture, _N_SAMPLES, self._ground, shade, box, picture)

    def _level(self, camera: Camera, camera_from_sheet: RigidTransform) -> _Level:
        """The coarsest level of which two pixels are no longer than one of the picture."""
        farthest_mm = camera_from_sheet.apply(self._sheet.corners_mm)[:, 2].max()
        px_per_px = self._sheet.px_per_mm * max(farthest_mm, 1.0) / camera.focal_px
        fitting = [one for one in self._levels if 2.0 * one.step <= max(px_per_px, 2.0)]
        return fitting[-1]

    def _optics(self, eye: Eye, scale: float) -> tuple[Camera, FloatArray]:
        rig = self.rig if scale == 1.0 else self.rig.scale(scale)
        camera = rig.left if eye == "left" else rig.right
        return camera, corner_rays(camera)


class SheetInView:
    """A scene into whose view a sheet is held for a while, in front of everything else.

    Args:
        behind: the scene.
        sheet: that is held.
        left_from_sheet: its pose at a world time in ns.
        shown_ns: from when to when.
    """

    def __init__(
        self,
        behind: Scene,
        sheet: PrintedSheet,
        left_from_sheet: Callable[[int], RigidTransform],
        shown_ns: tuple[int, int],
    ) -> None:
        self.rig = behind.rig
        self._behind, self._shown_ns = behind, shown_ns
        # Not a number where the sheet does not hide what is behind it.
        self._sheet = SheetScene(sheet, left_from_sheet, behind.rig, ground=np.nan)

    def render(
        self,
        eye: Eye,
        time_ns: int,
        scale: float = 1.0,
        turn_rad: Turn = NO_TURN,
        rows: Rows | None = None,
    ) -> NDArray[np.float32]:
        """(H, W, 3) BGR linear radiance; 1.0 is a full well at nominal exposure."""
        radiance = self._behind.render(eye, time_ns, scale, turn_rad, rows)
        if not self._shown_ns[0] <= time_ns < self._shown_ns[1]:
            return radiance
        sheet = self._sheet.render(eye, time_ns, scale, turn_rad)
        return np.where(np.isnan(sheet), radiance, sheet)

    def path_px(self, from_ns: int, until_ns: int) -> float:
        """Of the sheet, and of what is behind it."""
        paths_px = [one.path_px(from_ns, until_ns) for one in (self._behind, self._sheet)]
        return max(paths_px)


def _levels(white: NDArray[np.uint8]) -> list[_Level]:
    """The sheet's radiance, and its means over 2 x 2, 4 x 4, ... pixels."""
    share = white.astype(np.float32) / np.float32(255.0)
    texture = np.float32(_INK) + np.float32(_PAPER - _INK) * share
    levels = [_Level(texture, 1)]
    while min(texture.shape) >= 8 and levels[-1].step < 64:
        # The last row or column stays alone: it is paper, as its neighbour is.
        texture = np.pad(texture, [(0, side % 2) for side in texture.shape], mode="edge")
        height, width = texture.shape
        halves = texture.reshape(height // 2, 2, width // 2, 2)
        texture = np.ascontiguousarray(halves.mean(axis=(1, 3), dtype=np.float32))
        levels.append(_Level(texture, 2 * levels[-1].step))
    return levels


def _box(camera: Camera, corners_mm: FloatArray) -> NDArray[np.int64] | None:
    """Rows and columns that the sheet may touch; None when it is not in view."""
    if (corners_mm[:, 2] < 1.0).any():
        return None
    # Distortion bends the sheet's edges outwards by a few pixels between its corners.
    corners = np.vstack([corners_mm, 0.5 * (corners_mm + np.roll(corners_mm, 1, axis=0))])
    pixels = camera.project(corners)
    size = np.array([camera.width, camera.height])
    margin = _EDGE_PX + 0.02 * np.ptp(pixels, axis=0)
    low = np.clip(np.floor(pixels.min(axis=0) - margin), 0, size).astype(np.int64)
    high = np.clip(np.ceil(pixels.max(axis=0) + margin), 0, size).astype(np.int64)
    if (high <= low).any():
        return None
    return np.array([low[1], high[1], low[0], high[0]])
