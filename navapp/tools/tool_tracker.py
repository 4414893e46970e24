"""Follows a tool from pair to pair: where to look next, and what is believed."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.rig import StereoRig
from navapp.geometry.transform import FloatArray
from navapp.tools.marker_finder import Box
from navapp.tools.plate_fit import view
from navapp.tools.plate_meter import PlateMeter
from navapp.tools.tool import SeenTool, Tool

# A hand moves a plate so fast; after so long without a sight the whole picture is looked at.
_SPEED_MM_S, _KNOWN_NS = 250.0, 500_000_000
# A tip that is less certain than this points at nothing.
_WORST_BOUND_MM = 1.0


@dataclass(frozen=True, slots=True)
class Unseen:
    """Why a tool is not known in a pair of pictures."""

    why: str


class ToolTracker:
    """Follows one tool.

    Args:
        tool: calibrated.
        rig: that looks.
    """

    def __init__(self, tool: Tool, rig: StereoRig) -> None:
        self._tool, self._rig = tool, rig
        self._meter = PlateMeter(tool.plate, rig, tool.paper)
        self._last: SeenTool | None = None

    def track(
        self, pictures: tuple[NDArray[np.uint8], NDArray[np.uint8]], captured_ns: int
    ) -> SeenTool | Unseen:
        """Where the tool is in one pair of pictures, (H, W) grey, not rectified."""
        found = self._meter.measure(pictures, self._boxes(captured_ns))
        if isinstance(found, str):
            return Unseen(found)
        seen = SeenTool(
            self._tool, found.left_from_plate, found.covariance, found.seen_share, captured_ns
        )
        if seen.tip_bound_mm > _WORST_BOUND_MM:
            return Unseen("the plate is seen, but the tip is not known within a millimetre")
        self._last = seen
        return seen

    def _boxes(self, captured_ns: int) -> tuple[Box | None, Box | None]:
        """Where the plate can be since it was seen last."""
        last = self._last
        if last is None or not 0 <= captured_ns - last.captured_ns <= _KNOWN_NS:
            return None, None
        reach_mm = _SPEED_MM_S * (captured_ns - last.captured_ns) / 1e9
        corners = last.left_from_plate.apply(self._tool.plate.corners_mm.reshape(-1, 3))
        return self._box(0, corners, reach_mm), self._box(1, corners, reach_mm)

    def _box(self, eye: int, corners_mm: FloatArray, reach_mm: float) -> Box | None:
        camera, eye_from_left = view(self._rig, eye)
        in_eye = eye_from_left.apply(corners_mm)
        pixels = camera.project(in_eye)
        margin_px = camera.focal_px * (reach_mm + self._tool.plate.square_mm) / in_eye[:, 2].min()
        low = np.maximum(np.floor(pixels.min(axis=0) - margin_px), 0).astype(int)
        size = (camera.width, camera.height)
        high = np.minimum(np.ceil(pixels.max(axis=0) + margin_px), size).astype(int)
        if (high - low < 1).any():
            return None
        width, height = high - low
        return int(low[0]), int(low[1]), int(width), int(height)
