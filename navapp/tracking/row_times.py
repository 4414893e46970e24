"""Corrects for a bone's motion while a pair of pictures is exposed.

Under a rolling shutter each row is exposed a little later than the one above it; cameras without a
common trigger do not expose together. Before rectification the two cameras also show a point in
different rows. If the bone moves along the baseline between the two exposures of a point, that
changes its disparity, and so its measured depth. Each rectified row is therefore looked up where
the bone was when that row was exposed. The velocity is known from earlier frames; what an error of
it may cost is added to the bound.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.tracking.motion import TrackState
from navapp.tracking.surface_meter import Margins, SurfaceMeter
from navapp.values import DisparityMap, StereoPictures

_NO_MARGINS = Margins(box_px=0, band_mm=0.0)
# A row counts as one that shows the bone when so many of its pixels are matched; chosen.
_LEAST_MATCHED_PX = 3
# A pair is measured again when that changes the result by so much, mm; chosen.
_LEAST_CHANGE_MM = 0.03
# Where nothing is known of its motion, a bone may move as fast as this, mm/s and rad/s; chosen.
_MAX_VELOCITY = np.array([200.0, 200.0, 200.0, 1.0, 1.0, 1.0])
# About so many points stand for the seen surface; for time alone.
_N_POINTS = 64


@dataclass(frozen=True, slots=True, eq=False)
class RowTimes:
    """When the rows of a pair see a bone, and how it moves meanwhile.

    Poses and motion are in the rectified left camera. Times are counted from the exposure of the
    middle row of the bone's box in the left picture.
    """

    meter: SurfaceMeter  # of the bone, under the rig
    # (6,) twist per second (mm/s, rad/s) about the model's centre; None: not known.
    velocity: FloatArray | None
    velocity_error: FloatArray  # (6,) by how much `velocity` may be wrong, from earlier frames
    # The bone's pose in an earlier frame, and how long before this pair that was taken. None: there
    # is no such frame that tells its velocity (`TrackState.is_recent`).
    last: RigidTransform | None
    elapsed_s: float
    skew_s: float  # the right picture is exposed so much later than the left one

    @classmethod
    def of_pair(
        cls, meter: SurfaceMeter, state: TrackState, pictures: StereoPictures
    ) -> "RowTimes | None":
        """With the velocity of earlier frames; None without a row delay or a skew."""
        captured_ns, skew_ns = pictures.captured_ns, pictures.skew_ns
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
        """By how much each rectified row is looked up elsewhere: x and y (h, 2), px.

        For the left picture and for the right one, in pictures as they were taken (as
        `Rectifier.rectify` wants them). None for a bone whose velocity is not known, or that is out
        of view.
        """
        if self.velocity is None or (line := _Line.of(self.meter, pose)) is None:
            return None
        left_s, right_s = line.find_times_s(line.ends_mm, self.skew_s)
        velocities_mm_s = _find_velocities_mm_s(self.velocity, line.ends_mm - line.centre_mm)
        before_px = line.project(line.ends_mm)
        left_px = line.project(line.ends_mm + left_s[:, None] * velocities_mm_s)[0] - before_px[0]
        right_px = line.project(line.ends_mm + right_s[:, None] * velocities_mm_s)[1] - before_px[1]
        if not np.isfinite([left_px, right_px]).all():
            return None
        rows = np.arange(self.meter.geometry.height, dtype=np.float64)
        return line.interpolate(left_px, rows), line.interpolate(right_px, rows)

    def error_mm(self, pose: RigidTransform) -> float:
        """Error of a pose due to motion: rms over the seen surface, in depth and across.

        Two causes, added in squares: the velocity may be wrong, and one shift for all of a row does
        not follow a surface that has relief, or that turns.
        """
        line = _Line.of(self.meter, pose)
        if line is None:
            return 0.0
        points_mm = line.surface_mm[:: max(1, len(line.surface_mm) // _N_POINTS)]
        velocity_error = np.maximum(self._find_change(pose), self.velocity_error)
        squares = [self._cost_mm(line, points_mm, one) ** 2 for one in np.diag(velocity_error)]
        if self.velocity is not None:
            squares.append(self._cost_mm(line, points_mm, self.velocity, is_shifted=True) ** 2)
        error_mm = math.sqrt(sum(squares))
        # A point that the lens cannot show has no time: nothing is known of its error.
        return error_mm if math.isfinite(error_mm) else math.inf

    def with_motion_to(self, pose: RigidTransform) -> "RowTimes | None":
        """With the velocity that a pose found in this pair shows.

        None where that changes too little, or without a last frame. The mean velocity since the
        last frame is the one in the middle of that time. Half of its change since the mean before
        is added: that is the velocity now if it changes evenly. It may not: the whole change
        remains as its error.
        """
        line, mean = _Line.of(self.meter, pose), self._mean_velocity(pose)
        if mean is None or line is None:
            return None
        change = self._find_change(pose)
        if self._cost_mm(line, line.ends_mm, change) < _LEAST_CHANGE_MM:
            return None
        half = 0.0 if self.velocity is None else 0.5 * (mean - self.velocity)
        error = np.maximum(change, self.velocity_error)
        return replace(self, velocity=mean + half, velocity_error=error)

    def move_to_seen(self, pose: RigidTransform, found: DisparityMap) -> RigidTransform:
        """The pose when the middle row of what was matched of the bone was exposed.

        The given pose is that of the middle row of its whole box, which other things may hide.
        """
        line = _Line.of(self.meter, pose)
        seen = np.flatnonzero((found.origin > 0).sum(axis=1) >= _LEAST_MATCHED_PX)
        if self.velocity is None or line is None or len(seen) == 0:
            return pose
        left_s, _ = line.find_times_s(line.ends_mm, self.skew_s)
        later_s = np.interp(found.y + 0.5 * (seen[0] + seen[-1]), line.rows, left_s)
        if not math.isfinite(later_s):
            return pose
        return pose.move(later_s * self.velocity, line.centre_mm)

    def _mean_velocity(self, pose: RigidTransform) -> FloatArray | None:
        """(6,) from the last frame to a pose in this pair; None without a last one."""
        if self.last is None:
            return None
        return self.last.twist_to(pose, self.meter.model.centre_mm) / self.elapsed_s

    def _find_change(self, pose: RigidTransform) -> FloatArray:
        """(6,) by how much the velocity that a pose shows differs from `velocity`, absolute."""
        mean = self._mean_velocity(pose)
        if mean is None:
            return _MAX_VELOCITY
        return np.abs(mean if self.velocity is None else mean - self.velocity)

    def _cost_mm(
        self,
        line: "_Line",
        points_mm: FloatArray,
        velocity: FloatArray,
        *,
        is_shifted: bool = False,
    ) -> float:
        """Rms error, in depth and across, of points (N, 3) that move with a velocity (6,).

        Nothing of the motion is corrected; with `is_shifted` rows are shifted for it, and only what
        that leaves counts.
        """
        geometry = self.meter.geometry
        moved_px = line.find_flow_px(points_mm, velocity, self.skew_s)
        if is_shifted:
            of_ends_px = line.find_flow_px(line.ends_mm, velocity, self.skew_s)
            rows = geometry.project(points_mm)[:, 1]
            moved_px = moved_px - line.interpolate(of_ends_px, rows)
        depth_mm = points_mm[:, 2]
        mm_per_px = depth_mm / geometry.focal_px
        across_mm = mm_per_px[:, None] * moved_px[:, :2]
        disparity_px = moved_px[:, 0] - moved_px[:, 2]
        in_depth_mm = mm_per_px * depth_mm / geometry.baseline_mm * disparity_px
        return math.sqrt(float(np.mean(in_depth_mm**2 + (across_mm**2).sum(axis=1))))


@dataclass(frozen=True, slots=True, eq=False)
class _Line:
    """A vertical line through the middle of a bone's seen surface, as high as the bone's box.

    It stands for the bone where each row has one value: times and shifts of rows are computed at
    its two ends, and interpolated between.
    """

    meter: SurfaceMeter
    centre_mm: FloatArray  # (3,) of the model
    surface_mm: FloatArray  # (N, 3) vertices that face the camera
    rows: FloatArray  # (2,) rectified rows of its ends
    ends_mm: FloatArray  # (2, 3)

    @classmethod
    def of(cls, meter: SurfaceMeter, pose: RigidTransform) -> "_Line | None":
        """Of the bone at a pose; None out of view."""
        region = meter.find_region(pose, _NO_MARGINS)
        if region is None:
            return None
        box, geometry, mesh = region[0], meter.geometry, meter.model.bone.mesh
        rows = np.array([box.y - 0.5, box.y + box.height - 0.5])
        is_seen = mesh.visible_vertices(pose)
        surface_mm = pose.apply(mesh.vertices_mm[is_seen] if is_seen.any() else mesh.vertices_mm)
        # The bone's centre lies deeper than its surface: shifts from there would be too small.
        x_mm, _, depth_mm = surface_mm.mean(axis=0)
        y_mm = (rows - geometry.centre_y_px) * depth_mm / geometry.focal_px
        ends_mm = np.column_stack([np.full(2, x_mm), y_mm, np.full(2, depth_mm)])
        return cls(meter, pose.apply(meter.model.centre_mm), surface_mm, rows, ends_mm)

    def interpolate(self, at_ends: FloatArray, rows: FloatArray) -> FloatArray:
        """(N, k) values in rows (N,), from those (2, k) at both ends, linear also beyond them."""
        share = ((rows - self.rows[0]) / np.ptp(self.rows))[:, None]
        values: FloatArray = (1.0 - share) * at_ends[0] + share * at_ends[1]
        return values

    def project(self, points_mm: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(N, 2) px each of points in the left and in the right picture, as they were taken."""
        rig = self.meter.rectifier.rig
        in_left_mm = self.meter.geometry.rectified_from_left.inverse().apply(points_mm)
        in_right_mm = rig.right_from_left.apply(in_left_mm)
        return rig.left.project(in_left_mm), rig.right.project(in_right_mm)

    def find_times_s(self, points_mm: FloatArray, skew_s: float) -> tuple[FloatArray, FloatArray]:
        """(N,) each: when the left and the right camera see points, as `RowTimes` counts time."""
        row_delay_s = self.meter.rectifier.rig.row_delay_ns * 1e-9
        left_row, right_row = (one[:, 1] for one in self.project(points_mm))
        middle_row = self.project(self.ends_mm)[0][:, 1].mean()
        return (
            (left_row - middle_row) * row_delay_s,
            (right_row - middle_row) * row_delay_s + skew_s,
        )

    def find_flow_px(
        self, points_mm: FloatArray, velocity: FloatArray, skew_s: float
    ) -> FloatArray:
        """(N, 4) by how much points have moved when they are seen, in the rectified pictures.

        x and y in the left one, then x and y in the right one; to first order.
        """
        geometry = self.meter.geometry
        velocities_mm_s = _find_velocities_mm_s(velocity, points_mm - self.centre_mm)
        px_per_mm = geometry.focal_px / points_mm[:, 2:]
        flows_px = []
        for camera_x_mm, times_s in zip(
            (0.0, geometry.baseline_mm), self.find_times_s(points_mm, skew_s), strict=True
        ):
            slopes = (points_mm[:, :2] - (camera_x_mm, 0.0)) / points_mm[:, 2:]
            flow_px_s = px_per_mm * (velocities_mm_s[:, :2] - slopes * velocities_mm_s[:, 2:])
            flows_px.append(times_s[:, None] * flow_px_s)
        return np.hstack(flows_px)


def _find_velocities_mm_s(velocity: FloatArray, arms_mm: FloatArray) -> FloatArray:
    """(N, 3) mm/s of points at arms (N, 3) from the centre that a twist per second turns about."""
    return velocity[:3] + np.cross(velocity[3:], arms_mm)
