"""The surgeon's check of the mirror: crosses on the bone, moved until they lie where they should.

Three points of the bone's surface that the cameras have measured in that moment, marked on the
operator's screen too; none of them took part in the calibration. What the crosses had to be moved
by is the error of the whole chain as the eye sees it.
"""

from dataclasses import dataclass, replace

import numpy as np

from navapp.control.calibrated_display import CalibratedDisplay
from navapp.control.states import CrossCheck, MirrorCheck, SessionState, Snapshot
from navapp.geometry.display_model_view import EyeView
from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.rectification import RectifiedGeometry
from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.values import Reason, TrackedFrame

N_POINTS, LEAST_APART_MM = 3, 40.0
# Of the measured pixels every so many is a candidate; crosses stay so far from the picture's rim.
_STRIDE_PX, _RIM_PX = 8, 20
# From the plane through the nearest vertex of the model, and from that vertex.
_ON_BONE_MM, _NEAR_VERTEX_MM = 2.0, 8.0


@dataclass(frozen=True, slots=True, eq=False)
class _Cross:
    point_mm: FloatArray  # (3,) of the bone
    nudge_px: tuple[int, int] = (0, 0)


class MirrorChecking:
    """Keeps the check that is under way and the one that was finished last.

    Args:
        display: that is checked; None: guides lie over video, and nothing is asked.
        geometry: of the rectified pair in which points are measured.
    """

    def __init__(self, display: CalibratedDisplay | None, geometry: RectifiedGeometry) -> None:
        self._display = display
        self._view = None if display is None else display.model.view()
        self._geometry = geometry
        self._crosses: list[_Cross] = []
        self._number = 0
        self._bone = ""
        # Number and nudge of the cross that was shown last.
        self._shown: tuple[int, tuple[int, int]] | None = None
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
        return CrossCheck(self._number, len(self._crosses), self._crosses[self._number].nudge_px)

    @property
    def point_mm(self) -> FloatArray | None:
        """(3,) of the bone, where the cross belongs; None without a check."""
        return self._crosses[self._number].point_mm if self._crosses else None

    def find_reason(self, now_ns: int) -> Reason | None:
        """What the check has against guides."""
        if self._display is None:
            return None
        if self._crosses:
            return Reason.MIRROR_UNCHECKED
        return self._display.find_check_reason(self._finished, now_ns)

    def note_shown(self) -> None:
        """The cross is on the display as it lies now."""
        if self._crosses:
            self._shown = self._number, self._crosses[self._number].nudge_px

    def check_session(self, snapshot: Snapshot) -> None:
        """Give up what another bone, another state or a device has made worthless.

        A device that was not as calibrated also ends the check that was finished.
        """
        if snapshot.device_reasons:
            self._finished = None
            self.give_up()
        if self._bone != snapshot.stage.bone or snapshot.state is not SessionState.NAVIGATING:
            self.give_up()

    @property
    def was_cross_seen(self) -> bool:
        """The cross of now has been shown, wherever it was moved to since."""
        return self._shown is not None and self._shown[0] == self._number

    @property
    def is_cross_shown(self) -> bool:
        """The cross has been shown where it lies now."""
        if not self._crosses:
            return False
        return self._shown == (self._number, self._crosses[self._number].nudge_px)

    def begin(self, tracked: TrackedFrame, mesh: TriangleMesh) -> str:
        """Choose points that were measured on a bone; what is wrong, empty when it has begun."""
        if self._view is None:
            return "no display in the mirror is configured"
        points = self._candidates(self._view, tracked, mesh)
        chosen = _furthest_apart(points)
        pose = tracked.left_from_bone
        if chosen is None or pose is None:
            return f"no three points {LEAST_APART_MM:.0f} mm apart are measured on the bone"
        self._crosses = [_Cross(point) for point in pose.inverse().apply(chosen)]
        self._number, self._finished, self._shown = 0, None, None
        self._bone = tracked.bone
        return ""

    def give_up(self) -> None:
        """End the check without a result: the mirror is unchecked."""
        self._crosses, self._shown = [], None

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
        pixel = _pixels(self._view, left_from_bone.apply(cross.point_mm[None]))[0]
        moved: FloatArray = pixel + np.array(cross.nudge_px)
        return moved

    def confirm(self, left_from_bone: RigidTransform, now_ns: int) -> MirrorCheck | None:
        """Take the cross as it lies; the result after the last one."""
        self._number += 1
        self._shown = None
        if self._number < len(self._crosses) or self._view is None:
            return None
        points = np.array([cross.point_mm for cross in self._crosses])
        depth_mm = self._view.warp(left_from_bone.apply(points))[:, 2]
        off_px = np.linalg.norm([cross.nudge_px for cross in self._crosses], axis=1)
        residual_mm = off_px * depth_mm / self._view.camera.focal_px
        self._crosses = []
        self._finished = MirrorCheck(now_ns, float(residual_mm.max()))
        return self._finished

    def _candidates(self, view: EyeView, tracked: TrackedFrame, mesh: TriangleMesh) -> FloatArray:
        """(N, 3) points measured on the bone that the display can show, in the left camera."""
        from scipy.spatial import cKDTree

        pose, foreground = tracked.left_from_bone, tracked.foreground
        if foreground is None or pose is None:
            return np.empty((0, 3))
        cloud = foreground.measured.reproject(self._geometry, _STRIDE_PX)
        points = self._geometry.rectified_from_left.inverse().apply(cloud.points_mm)
        # A hand, or what was matched wrongly, is not on the bone.
        in_bone = pose.inverse().apply(points)
        far_mm, nearest = cKDTree(mesh.vertices_mm).query(in_bone)
        normals = mesh.normals[nearest]
        off_mm = np.abs(np.sum((in_bone - mesh.vertices_mm[nearest]) * normals, axis=1))
        points = points[(off_mm < _ON_BONE_MM) & (far_mm < _NEAR_VERTEX_MM)]
        last = np.array([view.camera.width, view.camera.height]) - _RIM_PX
        pixels = _pixels(view, points)
        # Unknown places compare as outside.
        inside: FloatArray = points[((pixels > _RIM_PX) & (pixels < last)).all(axis=1)]
        return inside


def _pixels(view: EyeView, points_mm: FloatArray) -> FloatArray:
    """(N, 2) where points (N, 3) of the left camera's frame are drawn, as the eye reads them."""
    pixels: FloatArray = view.camera.project(view.warp(points_mm))
    return pixels


def _furthest_apart(points: FloatArray) -> FloatArray | None:
    """(3, 3) of points (N, 3): a triangle whose sides are long; None when one is too short."""
    if len(points) < N_POINTS:
        return None
    first = points[np.argmax(np.linalg.norm(points - points.mean(axis=0), axis=1))]
    second = points[np.argmax(np.linalg.norm(points - first, axis=1))]
    to_both = np.minimum(*(np.linalg.norm(points - one, axis=1) for one in (first, second)))
    chosen = np.stack([first, second, points[np.argmax(to_both)]])
    sides_mm = np.linalg.norm(chosen - np.roll(chosen, 1, axis=0), axis=1)
    return chosen if sides_mm.min() >= LEAST_APART_MM else None
