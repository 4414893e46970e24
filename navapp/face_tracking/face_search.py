"""Finds a bone near an expected pose by a known face of it.

The face's plane fixes three of the pose's six numbers, its border the other three.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from navapp.face_tracking.face_plane import FaceHeights, face_twists
from navapp.geometry.transform import RigidTransform
from navapp.resection import HIGHLIGHT_PX, Cut, FaceMeter
from navapp.tracking.frame import NOISE_VARIANCE_RATIO, Fit, Frame
from navapp.tracking.outline import OutlineMeter
from navapp.tracking.search.highlights import HighlightSearch
from navapp.tracking.surface_meter import NEAR_BOX, Measurement, SurfaceMeter
from navapp.values import MeasuredFace, PoseEstimate, Reason

# All chosen. Where the bone may be around the expected pose (standard deviations): it stands for
# what a plane leaves free, until the outline fixes it.
_WINDOW_MM, _WINDOW_RAD = 2.0, 0.05
# Rounds: the first ones on samples of the face, which are found from further away; all of them at
# most. Mean motion of the corners of the bone's hull: below, the bone rests; above, after the last
# round, it does not.
_SAMPLED_ROUNDS, _MAX_ROUNDS, _REST_MM, _NEAR_MM = 2, 8, 0.02, 0.1
# Of the plane's fit.
_STEPS = 6
# Deviation of sawn, wet bone in grey pictures over what the judge expects of bone, at most.
_ROUGHNESS = 1.8


class FaceSearch:
    """Searches for one bone by its face.

    Args:
        meter: of the bone, whose surface the face closes.
        outline: of the same.
        face: in the bone's coordinates.
        face_meter: measures faces of the same bone.
        others: cuts beside the face.
        has_part: a part covers most of the face.
    """

    def __init__(
        self,
        meter: SurfaceMeter,
        outline: OutlineMeter,
        face: MeasuredFace,
        face_meter: FaceMeter,
        others: Sequence[Cut],
        *,
        has_part: bool,
    ) -> None:
        self._meter, self._outline = meter, outline
        self._face, self._face_meter, self._others = face, face_meter, others
        self._has_part = has_part
        self._highlights = HighlightSearch(meter)

    def find(self, frame: Frame) -> Fit | None:
        """Where plane and outline rest near a frame's start; None when the face is not there.

        The fit is that to the plane, which leaves free what a plane does: the judge joins it with
        the outline once more.
        """
        resting = self._rest(frame)
        found = None if resting is None else self._lay_on_face(frame, resting)
        frame.watch.lap("estimate")
        return found

    def _rest(self, frame: Frame) -> Fit | None:
        """Plane and outline in turns, on the model as it is matched."""
        meter, pose = self._meter, frame.start
        fit, moved_mm = None, np.inf
        for n_round in range(_MAX_ROUNDS):
            expected = meter.render(frame.pair, pose, NEAR_BOX)
            if expected is None:
                return None
            is_sampled = n_round < _SAMPLED_ROUNDS
            measure = meter.measure_on_samples if is_sampled else meter.measure_on_model
            measured = measure(expected)
            frame.watch.lap("stereo")
            estimate = self._fit_plane(measured, pose)
            if estimate is None:
                return None
            fit = Fit(estimate, measured)
            coarse_px = None
            if frame.checks is not None and not is_sampled:
                # Edges of what lies before the face are none of its border.
                coarse_px = frame.checks.check(measured, pose).result().coarse_px
            joined = self._outline.join(frame.pair, fit, coarse_px, NOISE_VARIANCE_RATIO)
            moved_mm = pose.mean_motion_mm(joined.pose, meter.model.hull_mm)
            pose = joined.pose
            fit = replace(fit, estimate=replace(estimate, camera_from_bone=pose))
            frame.watch.lap("estimate")
            if not is_sampled and moved_mm < _REST_MM:
                break
        if fit is not None and moved_mm > _NEAR_MM:
            fit = fit.with_reason(Reason.NOT_CONVERGED)
        return fit

    def _lay_on_face(self, frame: Frame, fit: Fit) -> Fit:
        """The fit moved onto the face as it is measured without highlights.

        Its covariance is that of the measured face, and the window in the directions that a plane
        leaves free. Where the face is not measured so, the fit stays, with the error that
        highlights may cause; it is doubted, unless a part leaves so little of the face to be seen.
        """
        meter, centre_mm = self._meter, self._meter.model.centre_mm
        seen = self._measure_face(frame, fit)
        if seen is None:
            fit = self._leave_highlights_open(fit)
            return fit if self._has_part else fit.with_reason(Reason.NOT_CONVERGED)
        fixed, _ = face_twists(self._face, fit.pose, centre_mm)
        change = seen.tilts_offset - self._face.tilts_offset
        pose = fit.pose.move(fixed @ change, fit.pose.apply(centre_mm))
        if (expected := meter.render(frame.pair, pose, NEAR_BOX)) is None:
            return fit.with_reason(Reason.NOT_CONVERGED)
        # Matched once more, so that the judge compares the pose where it lies now.
        matte = self._highlights.measure(frame, pose)
        measured = matte or meter.measure_on_model(expected)
        # What is measured without highlights claims more of itself already.
        roughness = _ROUGHNESS if matte is None else 1.0
        # Of its residuals the shape counts. How far a plane through grey pictures lies off is in
        # the covariance of the measured face, and in the agreement that the judge finds.
        again = self._fit_plane(measured, pose, roughness)
        if again is None:
            return fit.with_reason(Reason.NOT_CONVERGED)
        fixed, free = face_twists(self._face, pose, centre_mm)
        window = free * np.array([_WINDOW_MM, _WINDOW_MM, _WINDOW_RAD])
        covariance = fixed @ seen.covariance @ fixed.T + window @ window.T
        # The judge counts that share of a surface's noise: this is known as it is.
        covariance /= NOISE_VARIANCE_RATIO
        estimate = replace(
            again, camera_from_bone=pose, covariance=covariance, reasons=fit.estimate.reasons
        )
        return Fit(estimate, measured)

    def _measure_face(self, frame: Frame, fit: Fit) -> MeasuredFace | None:
        """The face relative to a pose, as if that were exact."""
        left_from_bone = self._meter.geometry.rectified_from_left.inverse() @ fit.pose
        exact = replace(fit.estimate, camera_from_bone=left_from_bone, covariance=np.zeros((6, 6)))
        return self._face_meter.measure(
            frame.pictures.left, frame.pictures.right, exact, self._face.plane, self._others,
            expected=self._face.as_plane, row_shifts_px=frame.row_shifts_px,
        )  # fmt: skip

    def _leave_highlights_open(self, fit: Fit) -> Fit:
        """The fit with the error that highlights may cause: in offset, and in both tilts."""
        geometry = self._meter.geometry
        heights = FaceHeights.of(fit.measured, self._face, fit.pose, _ROUGHNESS)
        if heights is None:
            return fit.with_reason(Reason.NOT_CONVERGED)
        points_mm = heights.points_mm
        depth_mm = float(points_mm[:, 2].mean())
        off_mm = HIGHLIGHT_PX * depth_mm**2 / (geometry.focal_px * geometry.baseline_mm)
        # As far as the face is seen along its axes.
        along_mm = points_mm @ fit.pose.rotate(self._face.plane.axes).T
        tilts_rad = off_mm / (0.5 * np.ptp(np.percentile(along_mm, (5, 95), axis=0), axis=0))
        fixed, _ = face_twists(self._face, fit.pose, self._meter.model.centre_mm)
        twists = fixed * np.array([*tilts_rad, off_mm])
        covariance = fit.estimate.covariance + twists @ twists.T / NOISE_VARIANCE_RATIO
        return replace(fit, estimate=replace(fit.estimate, covariance=covariance))

    def _fit_plane(
        self, measured: Measurement, pose: RigidTransform, roughness: float = _ROUGHNESS
    ) -> PoseEstimate | None:
        """The pose, moved so that the measured points lie on the face; None with too few."""
        heights = FaceHeights.of(measured, self._face, pose, roughness)
        if heights is None:
            return None
        centre_mm = pose.apply(self._meter.model.centre_mm)
        arm_mm = heights.points_mm - centre_mm
        normal = np.broadcast_to(pose.rotate(self._face.normal[None]), arm_mm.shape)
        rows = np.column_stack([normal, np.cross(arm_mm, normal)])
        n_sharing = measured.scene.n_sharing_errors
        # Below and by the judge the covariance is scaled by both: the window stays as it is.
        scale = n_sharing * NOISE_VARIANCE_RATIO
        window = scale * np.diag(np.repeat((_WINDOW_MM, _WINDOW_RAD), 3) ** -2.0)
        step, information = np.zeros(6), window
        for _ in range(_STEPS):
            weighted = rows.T * (heights.less(rows @ step).weight / heights.sigma_mm**2)
            information = weighted @ rows + window
            step = np.asarray(
                np.linalg.solve(information, weighted @ heights.height_mm), dtype=np.float64
            )
        covariance = np.asarray(n_sharing * np.linalg.inv(information), dtype=np.float64)
        return heights.less(rows @ step).describe(pose.move(step, centre_mm), covariance)
