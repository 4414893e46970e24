"""The surgeon's check of the mirror: crosses, moved until they lie on their points.

Three corners of a board that the cameras see in that moment, or, without a board, three places of
the bone that they have just measured; both are marked on the operator's screen too, and none of
them took part in the calibration. What the crosses had to be moved by is the error of the whole
chain as the eye sees it.
"""

from dataclasses import dataclass, replace

import numpy as np

from drivers.frames import StereoFrame
from navapp.control.calibrated_display import CalibratedDisplay
from navapp.control.check_points import (
    LEAST_APART_MM,
    CheckPoint,
    LocateCorners,
    choose_corners,
    choose_on_bone,
    draw_places_px,
)
from navapp.control.states import (
    CrossCheck,
    MirrorCheck,
    SessionState,
    Snapshot,
)
from navapp.geometry.display_model_view import EyeView
from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.rectification import RectifiedGeometry
from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.values import Reason, TrackedFrame

# A board that has moved by more than this is not where its crosses are.
_MOST_MOVED_MM = 0.3


@dataclass(frozen=True, slots=True, eq=False)
class _Cross:
    point: CheckPoint
    nudge_px: tuple[int, int] = (0, 0)


class MirrorChecking:
    """Keeps the check that is under way and the one that was finished last.

    Args:
        display: that is checked; None: guides lie over video, and nothing is asked.
        geometry: of the rectified pair in which points are measured.
        locate: finds the corners of a board; None: no board is known.
    """

    def __init__(
        self,
        display: CalibratedDisplay | None,
        geometry: RectifiedGeometry,
        locate: LocateCorners | None = None,
    ) -> None:
        self._display = display
        self._view = None if display is None else display.model.view()
        self._geometry = geometry
        self._locate = locate
        self._frame: StereoFrame | None = None
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

    def point_mm(self, left_from_bone: RigidTransform) -> FloatArray | None:
        """(3,) in the left camera's frame, where the cross belongs; None without a check."""
        return self._crosses[self._number].point.in_left(left_from_bone) if self._crosses else None

    def keep_frame(self, frame: StereoFrame) -> None:
        """The newest pictures, in which a board is looked for when the check asks for it."""
        if self._locate is not None:
            self._frame = frame

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
        """Choose points on a board, or on a bone; what is wrong, empty when it has begun."""
        if self._view is None:
            return "no display in the mirror is configured"
        points = choose_corners(self._view, self._locate_corners())
        if not points:
            points = choose_on_bone(self._view, self._geometry, tracked, mesh)
        if not points:
            return f"no three points {LEAST_APART_MM:.0f} mm apart are seen, on a board or the bone"
        self._crosses = [_Cross(point) for point in points]
        self._number, self._finished, self._shown = 0, None, None
        self._bone = tracked.bone
        return ""

    @property
    def is_on_board(self) -> bool:
        """The check that is under way uses the corners of a board."""
        return bool(self._crosses) and self._crosses[0].point.corner_id is not None

    def find_moved(self) -> str:
        """What is wrong with the board that the cross lies on; empty when it lies still."""
        point = self._crosses[self._number].point
        if point.corner_id is None:
            return ""
        located = self._locate_corners()
        if located is None or point.corner_id not in located[0]:
            return "both cameras must see the board"
        now_mm = located[1][located[0] == point.corner_id][0]
        moved_mm = float(np.linalg.norm(now_mm - point.point_mm))
        return "" if moved_mm <= _MOST_MOVED_MM else f"the board has moved by {moved_mm:.1f} mm"

    def _locate_corners(self) -> tuple[np.ndarray, FloatArray] | None:
        if self._locate is None or self._frame is None:
            return None
        return self._locate(self._frame.left, self._frame.right)

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
        pixel = draw_places_px(self._view, cross.point.in_left(left_from_bone)[None])[0]
        moved: FloatArray = pixel + np.array(cross.nudge_px)
        return moved

    def confirm(self, left_from_bone: RigidTransform, now_ns: int) -> MirrorCheck | None:
        """Take the cross as it lies; the result after the last one."""
        self._number += 1
        self._shown = None
        if self._number < len(self._crosses) or self._view is None:
            return None
        points = np.array([cross.point.in_left(left_from_bone) for cross in self._crosses])
        depth_mm = self._view.warp(points)[:, 2]
        off_px = np.linalg.norm([cross.nudge_px for cross in self._crosses], axis=1)
        residual_mm = off_px * depth_mm / self._view.camera.focal_px
        self._crosses = []
        self._finished = MirrorCheck(now_ns, float(residual_mm.max()))
        return self._finished
