"""Tells whether a bone rests: a moving one is not measured in pictures not exposed at once.

The pose of a moving bone is found with the times at which the rows of both eyes were exposed
(`tracking.row_times`). Faces and holes are measured in the pictures as they are: what the bone goes
along the baseline meanwhile would count as depth.
"""

from drivers.frames import StereoFrame
from navapp.geometry.transform import FloatArray, RigidTransform

# All chosen. The pose is that of the middle row of what is seen of the bone; a face may lie so many
# rows away. So far the bone may go meanwhile: along a baseline of a fifth of the distance that is
# 0.05 mm of depth. After longer gaps its motion is not known.
_ROWS_AWAY, _MOST_MOVED_MM, _MOST_GAP_NS = 200, 0.01, 400_000_000


class RestWatch:
    """Compares the poses of one bone from frame to frame.

    Args:
        points_mm: (N, 3) around the bone, in its coordinates.
        row_delay_ns: of the rig: each row is exposed later by this than the row above it.
    """

    def __init__(self, points_mm: FloatArray, row_delay_ns: int) -> None:
        self._points_mm, self._row_delay_ns = points_mm, row_delay_ns
        self._last: tuple[int, RigidTransform] | None = None

    def is_at_rest(self, frame: StereoFrame, left_from_bone: RigidTransform) -> bool:
        """Whether the bone hardly moved between the exposures of both eyes.

        By its mean speed since the frame before. For the first frame and after a gap that is not
        known: then True only if all rows of both eyes were exposed at once.
        """
        last, self._last = self._last, (frame.captured_ns, left_from_bone)
        apart_ns = abs(frame.skew_ns) + _ROWS_AWAY * self._row_delay_ns
        if apart_ns == 0:
            return True
        if last is None or not 0 < frame.captured_ns - last[0] <= _MOST_GAP_NS:
            return False
        way_mm = last[1].mean_motion_mm(left_from_bone, self._points_mm)
        return way_mm * apart_ns <= _MOST_MOVED_MM * (frame.captured_ns - last[0])
