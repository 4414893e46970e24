"""A moving bone under a rolling shutter, or under eyes that do not expose at once.

The rows of a pair are exposed at different times, and before rectification the two cameras do not
show a point in the same row. Motion along the baseline meanwhile counts as disparity, and so as
depth. Each rectified row is therefore looked up where the bone was when that row was exposed. How
fast it moves is known from the frames before; what that may be off by is counted in the bound.
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
# A pair is not measured a second time for less, mm; chosen.
_WORTH_MM = 0.03
# Faster a bone is not taken to move where nothing is known of its motion, mm/s and rad/s; chosen.
_FASTEST = np.array([200.0, 200.0, 200.0, 1.0, 1.0, 1.0])
# About so many points stand for the seen surface; for time alone.
_N_POINTS = 64


@dataclass(frozen=True, slots=True, eq=False)
class RowTimes:
    """When the rows of a pair see a bone, and how it moves meanwhile.

    Poses and motion are in the rectified left camera; times are counted from the exposure of the
    middle row of the bone's box in the left picture.
    """

    meter: SurfaceMeter  # of the bone, under the rig
    # (6,) twist per second (mm/s, rad/s) about the model's centre; None: not known.
    velocity: FloatArray | None
    velocity_error: FloatArray  # (6,) by how much it may be wrong, by what is known so far
    # the bone when it was seen last, and how long before this pair; None: it is not known how it
    # has moved since.
    last: RigidTransform | None
    elapsed_s: float
    skew_s: float  # the right picture is exposed later by this

    @classmethod
    def of_pair(
        cls, meter: SurfaceMeter, state: TrackState, captured_ns: int, skew_ns: int
    ) -> "RowTimes | None":
        """As the frames before let expect; None where a pair is exposed at once, row by row."""
        if meter.rectifier.rig.row_delay_ns == 0 and skew_ns == 0:
            return None
        turn = meter.geometry.rectified_from_left
        known = state.find_velocity(captured_ns, meter.model.centre_mm)
        velocity = None if known is None else turn.rotate(known.reshape(2, 3)).ravel()
        is_recent = state.is_recent(captured_ns)
        last = turn @ state.left_from_bone if is_recent else None
        elapsed_s = (captured_ns - state.captured_ns) * 1e-9
        return cls(meter, velocity, state.velocity_change, last, elapsed_s, skew_ns * 1e-9)

    def find_shifts(self, pose: RigidTransform) -> tuple[FloatArray, FloatArray] | None:
        """By how much x and y (h, 2) of each rectified row are looked up elsewhere, px, by eye.

        None for a bone of which no motion is known, or that is out of view.
        """
        if self.velocity is None or (line := _Line.of(self.meter, pose)) is None:
            return None
        left_s, right_s = line.times_s(line.points_mm, self.skew_s)
        speed_mm_s = _speeds(self.velocity, line.points_mm - line.centre_mm)
        before_px = line.project(line.points_mm)
        left_px = line.project(line.points_mm + left_s[:, None] * speed_mm_s)[0] - before_px[0]
        right_px = line.project(line.points_mm + right_s[:, None] * speed_mm_s)[1] - before_px[1]
        if not np.isfinite([left_px, right_px]).all():
            return None
        rows = np.arange(self.meter.geometry.height, dtype=np.float64)
        return line.spread(left_px, rows), line.spread(right_px, rows)

    def error_mm(self, pose: RigidTransform) -> float:
        """What the motion may cost at a pose that was found: rms over the seen surface.

        By what the velocity may be wrong, and by what a shift by rows leaves of the motion of a
        surface that is not flat, or turns.
        """
        line = _Line.of(self.meter, pose)
        if line is None:
            return 0.0
        points_mm = line.surface_mm[:: max(1, len(line.surface_mm) // _N_POINTS)]
        wrong = np.maximum(self._change_to(pose), self.velocity_error)
        squares = [self._cost_mm(line, points_mm, one) ** 2 for one in np.diag(wrong)]
        if self.velocity is not None:
            squares.append(self._cost_mm(line, points_mm, self.velocity, is_shifted=True) ** 2)
        error_mm = math.sqrt(sum(squares))
        # Where a lens shows nothing, nothing is known.
        return error_mm if math.isfinite(error_mm) else math.inf

    def with_motion_to(self, pose: RigidTransform) -> "RowTimes | None":
        """With the motion that shows in a pose which was found; None where it changes too little.

        The velocity since the last frame, and half of its change since the one before: what it is
        in this pair, if it changes evenly. It may not: all of the change remains as its error.
        """
        line = _Line.of(self.meter, pose)
        if self.last is None or line is None:
            return None
        change = self._change_to(pose)
        if self._cost_mm(line, line.points_mm, change) < _WORTH_MM:
            return None
        seen = self.last.twist_to(pose, self.meter.model.centre_mm) / self.elapsed_s
        half = 0.0 if self.velocity is None else 0.5 * (seen - self.velocity)
        error = np.maximum(change, self.velocity_error)
        return replace(self, velocity=seen + half, velocity_error=error)

    def move_to_seen(self, pose: RigidTransform, found: DisparityMap) -> RigidTransform:
        """The pose when the middle row of what was matched of the bone was exposed.

        Before it was that of the middle row of its whole box, which other things may hide.
        """
        line = _Line.of(self.meter, pose)
        seen = np.flatnonzero((found.origin > 0).sum(axis=1) >= _LEAST_SEEN_PX)
        if self.velocity is None or line is None or len(seen) == 0:
            return pose
        left_s, _ = line.times_s(line.points_mm, self.skew_s)
        later_s = np.interp(found.y + 0.5 * (seen[0] + seen[-1]), line.rows, left_s)
        if not math.isfinite(later_s):
            return pose
        return pose.move(later_s * self.velocity, line.centre_mm)

    def _change_to(self, pose: RigidTransform) -> FloatArray:
        """(6,) by how much the velocity that a pose shows differs from the one that was taken."""
        if self.last is None:
            return _FASTEST
        seen = self.last.twist_to(pose, self.meter.model.centre_mm) / self.elapsed_s
        return np.abs(seen if self.velocity is None else seen - self.velocity)

    def _cost_mm(
        self,
        line: "_Line",
        points_mm: FloatArray,
        velocity: FloatArray,
        *,
        is_shifted: bool = False,
    ) -> float:
        """Rms error of points (N, 3) that move unnoticed, in depth and across.

        With `is_shifted` they move as their rows are shifted: what is left is counted.
        """
        moved_px = line.way_px(points_mm, velocity, self.skew_s)
        if is_shifted:
            of_line_px = line.way_px(line.points_mm, velocity, self.skew_s)
            moved_px = moved_px - line.spread(of_line_px, line.rows_of(points_mm))
        geometry = self.meter.geometry
        depth_mm = points_mm[:, 2]
        per_px = depth_mm / geometry.focal_px
        across_mm = per_px[:, None] * moved_px[:, :2]
        in_depth_mm = per_px * depth_mm / geometry.baseline_mm * (moved_px[:, 0] - moved_px[:, 2])
        return math.sqrt(float(np.mean(in_depth_mm**2 + (across_mm**2).sum(axis=1))))


@dataclass(frozen=True, slots=True, eq=False)
class _Line:
    """A vertical line before the middle of a bone's surface, from the top of its box to its end."""

    meter: SurfaceMeter
    centre_mm: FloatArray  # (3,) of the model
    surface_mm: FloatArray  # (N, 3) vertices that face the camera
    rows: FloatArray  # (2,) rectified rows of its ends
    points_mm: FloatArray  # (2, 3) its ends

    @classmethod
    def of(cls, meter: SurfaceMeter, pose: RigidTransform) -> "_Line | None":
        """Of the bone at a pose; None out of view."""
        region = meter.find_region(pose, _JUST_THE_BONE)
        if region is None:
            return None
        box, geometry, mesh = region[0], meter.geometry, meter.model.bone.mesh
        rows = np.array([box.y - 0.5, box.y + box.height - 0.5])
        is_seen = mesh.visible_vertices(pose)
        surface_mm = pose.apply(mesh.vertices_mm[is_seen] if is_seen.any() else mesh.vertices_mm)
        # At the depth of the centre the shift of the surface would be too small.
        x_mm, _, depth_mm = surface_mm.mean(axis=0)
        y_mm = (rows - geometry.centre_y_px) * depth_mm / geometry.focal_px
        ends_mm = np.column_stack([np.full(2, x_mm), y_mm, np.full(2, depth_mm)])
        return cls(meter, pose.apply(meter.model.centre_mm), surface_mm, rows, ends_mm)

    def spread(self, of_ends: FloatArray, rows: FloatArray) -> FloatArray:
        """(N, k) values in rows (N,), of those (2, k) at both ends: all but linear in the row."""
        share = ((rows - self.rows[0]) / np.ptp(self.rows))[:, None]
        values: FloatArray = (1.0 - share) * of_ends[0] + share * of_ends[1]
        return values

    def rows_of(self, points_mm: FloatArray) -> FloatArray:
        """(N,) rectified rows of points (N, 3)."""
        geometry = self.meter.geometry
        rows: FloatArray = (
            geometry.focal_px * points_mm[:, 1] / points_mm[:, 2] + geometry.centre_y_px
        )
        return rows

    def project(self, points_mm: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(N, 2) px each of points in both pictures, as they were taken."""
        rig = self.meter.rectifier.rig
        in_left_mm = self.meter.geometry.rectified_from_left.inverse().apply(points_mm)
        in_right_mm = rig.right_from_left.apply(in_left_mm)
        return rig.left.project(in_left_mm), rig.right.project(in_right_mm)

    def times_s(self, points_mm: FloatArray, skew_s: float) -> tuple[FloatArray, FloatArray]:
        """(N,) when each camera sees points, after the left one sees the middle of the line."""
        row_delay_s = self.meter.rectifier.rig.row_delay_ns * 1e-9
        left_row, right_row = (one[:, 1] for one in self.project(points_mm))
        middle_row = self.project(self.points_mm)[0][:, 1].mean()
        return (
            (left_row - middle_row) * row_delay_s,
            (right_row - middle_row) * row_delay_s + skew_s,
        )

    def way_px(self, points_mm: FloatArray, velocity: FloatArray, skew_s: float) -> FloatArray:
        """(N, 4) x and y that points move until they are seen, left picture, then right one."""
        geometry = self.meter.geometry
        speed_mm_s = _speeds(velocity, points_mm - self.centre_mm)
        per_mm = geometry.focal_px / points_mm[:, 2:]
        ways = []
        for eye_mm, times_s in zip(
            (0.0, geometry.baseline_mm), self.times_s(points_mm, skew_s), strict=True
        ):
            sideways = (points_mm[:, :2] - (eye_mm, 0.0)) / points_mm[:, 2:]
            flow = per_mm * (speed_mm_s[:, :2] - sideways * speed_mm_s[:, 2:])
            ways.append(times_s[:, None] * flow)
        return np.hstack(ways)


def _speeds(velocity: FloatArray, arms_mm: FloatArray) -> FloatArray:
    """(N, 3) mm/s of points at arms (N, 3) from the centre that a twist per second turns about."""
    return velocity[:3] + np.cross(velocity[3:], arms_mm)
