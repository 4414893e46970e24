"""A tool with a printed plate in front of the simulated cameras."""

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from navapp.geometry.camera import Camera
from navapp.geometry.transform import FloatArray, RigidTransform
from sim_devices.camera import Scene
from sim_devices.picture_motion import compute_path_px
from sim_devices.pixel_rays import centre_rays
from sim_devices.rigs import NO_TURN, Turn, camera_from_left
from sim_devices.sensor import Eye, Rows
from sim_devices.sheet import SheetScene
from sim_devices.tool_shapes import ToolShape

_STEEL, _GLOVE = 0.22, 0.30
# Direction to the lamp in the left camera's frame, how wide its mirror image is, how bright.
_LAMP, _GLARE_RAD, _GLARE = np.array([-0.45, -0.55, -0.70]), 0.12, 0.35
_SUBPIXEL_BITS = 6


@dataclass(frozen=True, slots=True)
class Cover:
    """A gloved thumb over the first face: a half plane of it."""

    direction_rad: float  # towards which side of the face it lies
    edge_mm: float  # of the face's middle, along that direction: beyond it all is hidden


class ToolInView:
    """A scene with a tool in front of everything else.

    Args:
        behind: the scene.
        shape: of the tool.
        left_from_tool: its pose at a world time in ns; None while it is out of view.
        cover: what hides a part of it.
        glare: how strongly its paper shines, 0 for matt.
    """

    def __init__(
        self,
        behind: Scene,
        shape: ToolShape,
        left_from_tool: Callable[[int], RigidTransform | None],
        cover: Cover | None = None,
        glare: float = 1.0,
    ) -> None:
        self.rig = behind.rig
        self._behind, self._shape, self._pose = behind, shape, left_from_tool
        self._cover, self._glare = cover, glare
        self._faces = [
            SheetScene(sheet, _nowhere, behind.rig, ground=np.nan) for sheet in shape.faces
        ]

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
        pose = self._pose(time_ns)
        if pose is None:
            return radiance
        rig = self.rig if scale == 1.0 else self.rig.scale(scale)
        camera = rig.left if eye == "left" else rig.right
        eye_from_tool = camera_from_left(self.rig, eye, turn_rad) @ pose
        radiance = radiance.copy()
        self._draw_shaft(camera, eye_from_tool, radiance)
        for number in range(len(self._faces)):
            self._draw_face(number, eye, scale, camera, eye_from_tool, radiance)
        return radiance

    def path_px(self, from_ns: int, until_ns: int) -> float:
        """Of tip, shaft and faces of the tool, and of what is behind it."""
        behind_px, first = self._behind.path_px(from_ns, until_ns), self._pose(from_ns)
        if first is None:
            return behind_px

        def pose(time_ns: int) -> RigidTransform:
            return self._pose(time_ns) or first

        shape = self._shape
        ends = [shape.tip_mm[None], (shape.tip_mm - shape.shaft_mm * shape.axis)[None]]
        for sheet, turned in zip(shape.faces, shape.tool_from_faces, strict=True):
            ends.append(RigidTransform("tool", "face", turned).apply(sheet.corners_mm))
        points_mm = np.concatenate(ends)
        return max(behind_px, compute_path_px(self.rig.left, points_mm, pose, from_ns, until_ns))

    def _draw_face(
        self,
        number: int,
        eye: Eye,
        scale: float,
        camera: Camera,
        eye_from_tool: RigidTransform,
        radiance: NDArray[np.float32],
    ) -> None:
        """One face, when it is turned towards the eye, its shine, and the thumb over the first."""
        turned = RigidTransform("tool", "face", self._shape.tool_from_faces[number])
        eye_from_face = eye_from_tool @ turned
        if eye_from_face.rotation[:, 2] @ eye_from_face.translation_mm <= 0.0:
            return
        drawn = self._faces[number].draw_alone(eye, scale, eye_from_face)
        if drawn is None:
            return
        part, paper = drawn
        lamp = camera_from_left(self.rig, eye).rotate(_LAMP / np.linalg.norm(_LAMP))
        paper = paper + self._shine(camera, part, lamp, eye_from_face.rotation[:, 2])
        is_paper = ~np.isnan(paper)
        radiance[part][is_paper] = paper[is_paper][:, None]
        if number == 0 and self._cover is not None:
            self._draw_cover(camera, eye_from_face, self._cover, radiance)

    def _shine(
        self, camera: Camera, part: tuple[slice, slice], lamp: FloatArray, normal: FloatArray
    ) -> NDArray[np.float32]:
        """Light of the lamp that paper and ink mirror, in a part of the picture."""
        rays = centre_rays(camera)[part]
        x, y = rays[..., 0], rays[..., 1]
        length = np.sqrt(1.0 + x * x + y * y)
        towards = (x * normal[0] + y * normal[1] + normal[2]) / length
        mirrored = [
            (along / length - 2.0 * towards * n)
            for along, n in zip((x, y, 1.0), normal, strict=True)
        ]
        cosine = sum(m * one for m, one in zip(mirrored, lamp, strict=True))
        angle = np.arccos(np.clip(cosine, -1.0, 1.0))
        shine: NDArray[np.float32] = self._glare * _GLARE * np.exp(-((angle / _GLARE_RAD) ** 2))
        return shine.astype(np.float32)

    def _draw_shaft(
        self, camera: Camera, eye_from_tool: RigidTransform, radiance: NDArray[np.float32]
    ) -> None:
        """A tapered rod, darker towards its sides."""
        tip = self._shape.tip_mm
        end = tip - self._shape.shaft_mm * self._shape.axis
        s = np.linspace(0.0, 1.0, 24)
        middle = eye_from_tool.apply(tip + s[:, None] * (end - tip))
        radius = self._shape.radius_mm * np.minimum(1.0, 0.1 + 9.0 * s)
        along = middle[-1] - middle[0]
        for share, grey in ((1.0, 0.45), (0.7, 0.8), (0.35, 1.3)):
            across = np.cross(along, middle)
            across *= (share * radius / np.linalg.norm(across, axis=1))[:, None]
            outline = np.concatenate([middle + across, (middle - across)[::-1]])
            _fill(camera.project(outline), _STEEL * grey, radiance)

    def _draw_cover(
        self,
        camera: Camera,
        eye_from_face: RigidTransform,
        cover: Cover,
        radiance: NDArray[np.float32],
    ) -> None:
        """A thumb with a wavy edge, 4 mm above the paper."""
        direction = np.array([np.cos(cover.direction_rad), np.sin(cover.direction_rad)])
        side = np.array([-direction[1], direction[0]])
        s = np.linspace(-45.0, 45.0, 60)
        wave = 1.2 * np.sin(0.31 * s + cover.direction_rad) + 0.02 * s * s * 0.3
        edge = s[:, None] * side + (cover.edge_mm + wave)[:, None] * direction
        far = edge[::-1] + 45.0 * direction
        flat = np.concatenate([edge, far])
        outline = np.column_stack([flat, np.full(len(flat), -4.0)])
        _fill(camera.project(eye_from_face.apply(outline)), _GLOVE, radiance)


def _nowhere(time_ns: int) -> RigidTransform:
    raise ValueError("a tool's face has no pose of its own")


def _fill(outline_px: FloatArray, radiance_of: float, radiance: NDArray[np.float32]) -> None:
    """Draw a polygon over the picture, its edge smooth."""
    size = np.array(radiance.shape[1::-1])
    if not np.isfinite(outline_px).all():
        return
    low = np.clip(np.floor(outline_px.min(axis=0)) - 2, 0, size).astype(int)
    high = np.clip(np.ceil(outline_px.max(axis=0)) + 3, 0, size).astype(int)
    if (high <= low).any():
        return
    mask = np.zeros((high[1] - low[1], high[0] - low[0]), np.uint8)
    points = np.rint((outline_px - low) * (1 << _SUBPIXEL_BITS)).astype(np.int32)
    cv2.fillPoly(mask, [points.reshape(-1, 1, 2)], (255,), cv2.LINE_AA, _SUBPIXEL_BITS)
    share = (mask.astype(np.float32) / np.float32(255.0))[:, :, None]
    part = radiance[low[1] : high[1], low[0] : high[0]]
    part += share * (np.float32(radiance_of) - part)
