"""The surgeon's check of the mirror: crosses on points of the bone, moved until they fit.

Three points that the stereo camera locates in that moment and that took no part in the calibration.
What the crosses had to be moved by is the error of the whole chain as the eye sees it.
"""

from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from navapp.control.calibrated_display import CalibratedDisplay
from navapp.control.states import CrossCheck, MirrorCheck
from navapp.geometry.display_model_view import EyeView
from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.values import Plan, Reason

N_POINTS, LEAST_APART_MM = 3, 40.0
# A landmark further from the surface is not seen on the bone (the middle of the hip).
_ON_SURFACE_MM = 4.0
# Of a candidate triple: the best few points are tried in all combinations.
_MOST_CANDIDATES = 24


@dataclass(frozen=True, slots=True, eq=False)
class _Cross:
    name: str
    point_mm: FloatArray  # (3,) of the bone
    nudge_px: tuple[int, int] = (0, 0)


class MirrorChecking:
    """Keeps the check that is under way and the one that was finished last.

    Args:
        display: that is checked; None: guides lie over video, and nothing is asked.
        plan: whose landmarks and targets the crosses lie on.
    """

    def __init__(self, display: CalibratedDisplay | None, plan: Plan) -> None:
        self._display, self._plan = display, plan
        self._view = None if display is None else display.model.view()
        self._crosses: list[_Cross] = []
        self._number = 0
        self._finished: MirrorCheck | None = None

    @property
    def view(self) -> EyeView | None:
        """Of the calibrated eye; None without a display in the mirror."""
        return self._view

    @property
    def state(self) -> CrossCheck | None:
        """Of the check that is under way."""
        if not self._crosses:
            return None
        cross = self._crosses[self._number]
        return CrossCheck(self._number, len(self._crosses), cross.name, cross.nudge_px)

    def find_reason(self, now_ns: int) -> Reason | None:
        """What the check has against guides."""
        if self._display is None:
            return None
        if self._crosses:
            return Reason.MIRROR_UNCHECKED
        return self._display.find_check_reason(self._finished, now_ns)

    def begin(self, bone: str, left_from_bone: RigidTransform) -> str:
        """Choose points of a bone at a pose; what is wrong, empty when the check has begun."""
        if self._view is None:
            return "no display in the mirror is configured"
        points = self._visible_points(bone, left_from_bone)
        chosen = _furthest_apart(points)
        if chosen is None:
            return (
                f"fewer than {N_POINTS} landmarks or targets of the {bone} are in view, "
                f"{LEAST_APART_MM:.0f} mm apart"
            )
        self._crosses = [_Cross(name, points[name]) for name in chosen]
        self._number, self._finished = 0, None
        return ""

    def give_up(self) -> None:
        """End the check without a result: the mirror is unchecked."""
        self._crosses = []

    def nudge(self, right_px: int, down_px: int) -> None:
        """Move the cross that is shown."""
        cross = self._crosses[self._number]
        moved = cross.nudge_px[0] + right_px, cross.nudge_px[1] + down_px
        self._crosses[self._number] = replace(cross, nudge_px=moved)

    def cross_px(self, left_from_bone: RigidTransform) -> FloatArray | None:
        """(2,) where the cross is drawn, as the eye reads the picture; None without a check."""
        if not self._crosses or self._view is None:
            return None
        cross = self._crosses[self._number]
        pixel: FloatArray = self._pixels(cross.point_mm[None], left_from_bone)[0]
        moved: FloatArray = pixel + np.array(cross.nudge_px)
        return moved

    def confirm(self, left_from_bone: RigidTransform, now_ns: int) -> MirrorCheck | None:
        """Take the cross as it lies; the result after the last one."""
        self._number += 1
        if self._number < len(self._crosses) or self._view is None:
            return None
        points = np.array([cross.point_mm for cross in self._crosses])
        depth_mm = self._view.warp(left_from_bone.apply(points))[:, 2]
        off_px = np.linalg.norm([cross.nudge_px for cross in self._crosses], axis=1)
        residual_mm = off_px * depth_mm / self._view.camera.focal_px
        self._crosses = []
        self._finished = MirrorCheck(now_ns, float(residual_mm.max()))
        return self._finished

    def _pixels(self, points_mm: FloatArray, left_from_bone: RigidTransform) -> FloatArray:
        view = self._view
        if view is None:
            return np.full((len(points_mm), 2), np.nan)
        pixels: FloatArray = view.camera.project(view.warp(left_from_bone.apply(points_mm)))
        return pixels

    def _visible_points(self, bone: str, left_from_bone: RigidTransform) -> dict[str, FloatArray]:
        """Landmarks and targets that lie on the bone's surface, face both eye and camera."""
        from scipy.spatial import cKDTree

        named = {name: one.point_mm for name, one in self._plan.content.landmarks.items()}
        for name, points in self._plan.targets.items():
            for number, point in enumerate(points.reshape(-1, 3)):
                named[f"{name} {number + 1}" if points.size > 3 else name] = point
        named = {name: one for name, one in named.items() if name.startswith(f"{bone}/")}
        if not named or self._view is None:
            return {}
        mesh = self._plan.bones[bone].mesh
        points_mm = np.array(list(named.values()))
        distance_mm, nearest = cKDTree(mesh.vertices_mm).query(points_mm)
        pixels = self._pixels(points_mm, left_from_bone)
        camera = self._view.camera
        is_faced = mesh.visible_vertices(left_from_bone)
        eye_from_bone = self._view.eye_from_left @ left_from_bone
        is_faced &= mesh.visible_vertices(eye_from_bone)
        with np.errstate(invalid="ignore"):
            is_shown = ((pixels >= 0) & (pixels < (camera.width, camera.height))).all(axis=1)
        good = (distance_mm < _ON_SURFACE_MM) & is_faced[nearest] & is_shown
        return {name: named[name] for name, is_good in zip(named, good, strict=True) if is_good}


def _furthest_apart(points: dict[str, FloatArray]) -> tuple[str, ...] | None:
    """The names of the three whose nearest two lie furthest apart; None when that is too near."""
    names = list(points)[:_MOST_CANDIDATES]
    best, best_mm = None, LEAST_APART_MM
    for triple in combinations(names, N_POINTS):
        apart_mm = min(
            float(np.linalg.norm(points[a] - points[b])) for a, b in combinations(triple, 2)
        )
        if apart_mm >= best_mm:
            best, best_mm = triple, apart_mm
    return best
