"""Tells whether a bone moves too fast to be measured in pictures that are not exposed at once.

The pose of a moving bone counts when each row of each eye was exposed (`tracking.row_times`). Faces
and holes are measured in the pictures as they are: what the bone goes meanwhile along the baseline
would count as depth.
"""

from drivers.frames import StereoFrame
from navapp.geometry.transform import FloatArray, RigidTransform

# All chosen. A face is so high in the picture; so far the bone may move between what both eyes see
# of it; after longer gaps its motion is not known.
_FACE_ROWS, _MOST_MOVED_MM, _MOST_GAP_NS = 100, 0.01, 400_000_000


class RestWatch:
    """Follows the poses of one bone from frame to frame.

    Args:
        points_mm: (N, 3) around the bone, in its coordinates.
    """

    def __init__(self, points_mm: FloatArray) -> None:
        self._points_mm = points_mm
        self._last: tuple[int, RigidTransform] | None = None

    def is_at_rest(self, frame: StereoFrame, left_from_bone: RigidTransform) -> bool:
        """Whether a frame, in which the bone has that pose, shows it as if it were exposed at once.

        Of the first frame, and after a gap, that is not known: it does when it is exposed at once.
        """
        last, self._last = self._last, (frame.captured_ns, left_from_bone)
        apart_ns = abs(frame.skew_ns) + _FACE_ROWS * frame.row_delay_ns
        if apart_ns == 0:
            return True
        if last is None or not 0 < frame.captured_ns - last[0] <= _MOST_GAP_NS:
            return False
        way_mm = last[1].mean_motion_mm(left_from_bone, self._points_mm)
        return way_mm * apart_ns <= _MOST_MOVED_MM * (frame.captured_ns - last[0])
