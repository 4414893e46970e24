"""A moving bone under a rolling shutter, or under eyes that do not expose at once.

The rows of a pair are exposed at different times, and before rectification the two cameras do not
show a point in the same row. Motion along the baseline meanwhile counts as disparity, and so as
depth. Each rectified row is therefore looked up where the bone was when that row was exposed. How
fast it moves is known from the frames before; what the pose then found says of that is counted in
the bound.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.tracking.motion import TrackState
from navapp.tracking.surface_meter import Margins, SurfaceMeter
from navapp.values import DisparityMap

_JUST_THE_BONE = Margins(box_px=0, band_mm=0.0)
# Rows with fewer matched pixels say nothing of where the bone is seen; chosen.
_LEAST_SEEN_PX = 3
# What the motion may cost and still is not worth to measure once more, mm; chosen.
_WORTH_MM = 0.03


@dataclass(frozen=True, slots=True, eq=False)
class RowTimes:
    """When the rows of a pair see a bone, and how it moves meanwhile.

    Poses and motion are in the rectified left camera; times are counted from the exposure of the
    middle row of the bone's box in the left picture.
    """

    meter: SurfaceMeter  # of the bone, under the rig
    velocity: FloatArray  # (6,) twist per second (mm/s, rad/s) about the model's centre
    last: RigidTransform  # the bone when it was seen last ...
    elapsed_s: float  # ... so long before this pair
    skew_s: float  # the right picture is exposed later by this

    @classmethod
    def of_pair(
        cls, meter: SurfaceMeter, state: TrackState, captured_ns: int, skew_ns: int
    ) -> "RowTimes | None":
        """As the frames before let expect; None where a pair is exposed at once, row by row."""
        if meter.rectifier.rig.row_delay_ns == 0 and skew_ns == 0:
            return None
        turn = meter.geometry.rectified_from_left
        velocity = turn.rotate(state.velocity.reshape(2, 3)).ravel()
        elapsed_s = (captured_ns - state.captured_ns) * 1e-9
        return cls(meter, velocity, turn @ state.left_from_bone, elapsed_s, skew_ns * 1e-9)

    def find_shifts(self, pose: RigidTransform) -> tuple[FloatArray, FloatArray] | None:
        """By how much x and y (h, 2) of each rectified row are looked up elsewhere, px, by eye.

        None for a bone at rest, of which no motion is known, or out of view.
        """
        rows = self._rows_of(pose)
        if rows is None or not self.velocity.any():
            return None
        points_mm = self._line(pose, rows)
        left_s, right_s = self._times(points_mm)
        arms_mm = points_mm - pose.apply(self._centre_mm)
        speed_mm_s = self.velocity[:3] + np.cross(self.velocity[3:], arms_mm)
        expected_px = self._project(points_mm)
        left_px = self._project(points_mm + left_s[:, None] * speed_mm_s)[0] - expected_px[0]
        right_px = self._project(points_mm + right_s[:, None] * speed_mm_s)[1] - expected_px[1]
        if not np.isfinite([left_px, right_px]).all():
            return None
        # Both times and places are all but linear in the row.
        last = (np.arange(self.meter.geometry.height) - rows[0])[:, None] / np.ptp(rows)
        first = 1.0 - last
        return first * left_px[0] + last * left_px[1], first * right_px[0] + last * right_px[1]

    def error_mm(self, pose: RigidTransform) -> float:
        """What the motion may still cost at a pose that was found.

        Its speed since the last frame, less the one that was taken, times the time between both
        eyes (in depth), and a quarter of that from the bone's first to its last row (along the
        motion: the mean over them).
        """
        rows = self._rows_of(pose)
        if rows is None or self.elapsed_s <= 0.0:
            return 0.0
        left_s, right_s = self._times(self._line(pose, rows))
        centre_mm = pose.apply(self._centre_mm)
        moved_mm = centre_mm - self.last.apply(self._centre_mm)
        wrong_mm_s = np.abs(moved_mm / self.elapsed_s - self.velocity[:3])
        between_eyes_s = abs(float(right_s.mean()))
        in_depth = centre_mm[2] / self.meter.geometry.baseline_mm
        depth_mm = wrong_mm_s[0] * between_eyes_s * in_depth
        along_mm = float(np.linalg.norm(wrong_mm_s)) * float(np.ptp(left_s)) / 4.0
        return math.hypot(depth_mm, along_mm)

    def correct(self, pose: RigidTransform) -> "RowTimes | None":
        """With the motion that a pose shows which was found; None where that matters too little.

        The velocity since the last frame, and half of its change since the one before: what it is
        in this pair, if it changes evenly.
        """
        if self.error_mm(pose) < _WORTH_MM:
            return None
        seen = self.last.twist_to(pose, self._centre_mm) / self.elapsed_s
        return replace(self, velocity=seen + 0.5 * (seen - self.velocity))

    def move_to_seen(self, pose: RigidTransform, found: DisparityMap) -> RigidTransform:
        """The pose when the middle row of what was matched of the bone was exposed.

        Before it was that of the middle row of its whole box, which other things may hide.
        """
        rows = self._rows_of(pose)
        seen = np.flatnonzero((found.origin > 0).sum(axis=1) >= _LEAST_SEEN_PX)
        if rows is None or len(seen) == 0:
            return pose
        left_s, _ = self._times(self._line(pose, rows))
        later_s = np.interp(found.y + 0.5 * (seen[0] + seen[-1]), rows, left_s)
        return pose.move(later_s * self.velocity, pose.apply(self._centre_mm))

    @property
    def _centre_mm(self) -> FloatArray:
        return self.meter.model.centre_mm

    def _rows_of(self, pose: RigidTransform) -> FloatArray | None:
        """(2,) rectified rows at the top and the bottom of the bone's box; None out of view."""
        region = self.meter.find_region(pose, _JUST_THE_BONE)
        if region is None:
            return None
        box = region[0]
        return np.array([box.y - 0.5, box.y + box.height - 0.5])

    def _line(self, pose: RigidTransform, rows: FloatArray) -> FloatArray:
        """(2, 3) points below each other in the middle of the bone's surface, seen in the rows."""
        geometry, mesh = self.meter.geometry, self.meter.model.bone.mesh
        # Of the bone's centre the depth would be too large: the shift of its surface, too small.
        is_seen = mesh.visible_vertices(pose)
        surface_mm = mesh.vertices_mm[is_seen] if is_seen.any() else mesh.vertices_mm
        x_mm, _, depth_mm = pose.apply(surface_mm.mean(axis=0))
        y_mm = (rows - geometry.centre_y_px) * depth_mm / geometry.focal_px
        return np.column_stack([np.full_like(y_mm, x_mm), y_mm, np.full_like(y_mm, depth_mm)])

    def _times(self, points_mm: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(2,) when each camera sees them, after the left one sees the middle between them."""
        row_delay_s = self.meter.rectifier.rig.row_delay_ns * 1e-9
        left_px, right_px = (one[:, 1] for one in self._project(points_mm))
        middle_px = left_px.mean()
        return (
            (left_px - middle_px) * row_delay_s,
            (right_px - middle_px) * row_delay_s + self.skew_s,
        )

    def _project(self, points_mm: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(2, 2) px each of both points in both pictures, as they were taken."""
        rig = self.meter.rectifier.rig
        in_left_mm = self.meter.geometry.rectified_from_left.inverse().apply(points_mm)
        in_right_mm = rig.right_from_left.apply(in_left_mm)
        return rig.left.project(in_left_mm), rig.right.project(in_right_mm)
