"""The bone's outline in the left picture alone, by OpenCV's `rapid`."""

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np

from drivers.frames import StereoFrame
from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.rectification import luma, rectifier_of
from navapp.geometry.rig import StereoRig
from navapp.geometry.simplify import drawn
from navapp.geometry.transform import RigidTransform

_LEAST_EDGES = 12
_RANSAC_STEPS = 200


@dataclass(frozen=True, slots=True)
class RapidSettings:
    """How the outline is looked for."""

    n_lines: int  # across the outline
    reach_px: int  # of a line, to both sides
    n_steps: int
    least_response: float  # of an edge, by the Sobel filter
    agree_px: float  # an edge that lies so near to the outline of a pose agrees with it


class RapidTracker:
    """Lines across the outline and edges on them by `cv2.rapid`, a pose by `solvePnPRansac`.

    The trackers of `cv2.rapid` fit to all edges alike, and are drawn off where tissue covers the
    outline; here a pose that many edges agree with is looked for.

    Args:
        rig: that takes the pictures.
        surface: of the bone.
        _frame: the first pair; only its pose is needed.
        pose: left camera from bone in it.
        settings: how the outline is looked for.
    """

    def __init__(
        self,
        rig: StereoRig,
        surface: TriangleMesh,
        _frame: StereoFrame,
        pose: RigidTransform,
        settings: RapidSettings,
    ) -> None:
        self._rectifier, self._settings = rectifier_of(rig), settings
        self._geometry = self._rectifier.geometry
        mesh = drawn(surface)
        self._points_mm = np.array(mesh.vertices_mm, dtype=np.float32)
        self._faces = np.array(mesh.faces, dtype=np.int32)
        self._last = self._geometry.rectified_from_left @ pose

    def __call__(self, frame: StereoFrame) -> RigidTransform | None:
        """The pose in the next pair; None: too few edges agree, or the bone is out of view."""
        picture = luma(self._rectifier.rectify(frame.left, frame.right).left)
        try:
            for _ in range(self._settings.n_steps):
                found = self._step(picture, self._last)
                if found is None:
                    return None
                self._last = found
        except cv2.error:  # out of view, or no pose at all
            return None
        return self._geometry.rectified_from_left.inverse() @ self._last

    def _step(self, picture: Any, pose: RigidTransform) -> RigidTransform | None:
        """A pose that fits better to the edges around it; None: too few agree."""
        geometry, settings = self._geometry, self._settings
        matrix = geometry.camera_matrix
        turn = cv2.Rodrigues(np.array(pose.rotation))[0]
        shift_mm = pose.translation_mm.reshape(3, 1).copy()
        places_px, points_mm = cv2.rapid.extractControlPoints(
            settings.n_lines, settings.reach_px, self._points_mm, turn, shift_mm, matrix,
            (geometry.width, geometry.height), self._faces,
        )  # fmt: skip
        bundle, pixels = cv2.rapid.extractLineBundle(settings.reach_px, places_px, picture)
        columns, responses = cv2.rapid.findCorrespondencies(bundle)
        rows = np.flatnonzero((responses > settings.least_response) & (columns > 0))
        if len(rows) < _LEAST_EDGES:
            return None
        seen_px = pixels[rows, columns.ravel()[rows]].astype(np.float64)
        points_mm = points_mm[rows].astype(np.float64)
        is_found, turn, shift_mm, agreeing = cv2.solvePnPRansac(
            points_mm, seen_px, matrix, None, turn, shift_mm, True, _RANSAC_STEPS,
            settings.agree_px,
        )  # fmt: skip
        if not is_found or agreeing is None or len(agreeing) < _LEAST_EDGES:
            return None
        rows = agreeing.ravel()
        turn, shift_mm = cv2.solvePnPRefineLM(
            points_mm[rows], seen_px[rows], matrix, None, turn, shift_mm
        )
        return RigidTransform.from_parts(pose.target, pose.source, cv2.Rodrigues(turn)[0], shift_mm)
