"""A fit becomes an answer: it is joined with the outline, evidence is gathered, rules decide."""

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.transform import FloatArray
from navapp.geometry.zbuffer import RenderedView
from navapp.registration.verdict import (
    OK_ERROR_MM,
    UNUSABLE_FRACTION,
    Agreement,
    Evidence,
    Goal,
    decide,
)
from navapp.stereo import StereoHealth, measure_health
from navapp.tracking.agreement import compare
from navapp.tracking.checks import PairCheck, PairChecks
from navapp.tracking.following import RestSettings
from navapp.tracking.foreground import find_foreground
from navapp.tracking.frame import NOISE_VARIANCE_RATIO, TOLERATED_VARIANCE_RATIO, Fit, Frame
from navapp.tracking.outline import OutlineMeter
from navapp.tracking.settings import TrackerSettings
from navapp.tracking.surface_meter import SurfaceMeter
from navapp.values import (
    Foreground,
    PoseEstimate,
    Reason,
    RowCheck,
    Status,
    Stopwatch,
    TrackedFrame,
    Verdict,
)

# All chosen. Errors of the plan's surface, and of a cartilage whose thickness was not fitted, are
# correlated over much of a bone. Points do not average them out: the pose may be off by so many of
# their standard deviations.
_COMMON_ERROR_SIGMAS = 2.0
_SURE_SIGMAS = 3.0
# Reasons that leave the rows of a pair without word on the rig.
UNUSABLE_PICTURES = frozenset(
    {
        Reason.PICTURE_DARK,
        Reason.PICTURE_OVEREXPOSED,
        Reason.PICTURES_UNLIKE,
        Reason.PICTURES_DEFOCUSED,
    }
)
# A model that the outline moved by no more looks as it was matched; a follower allows as much.
_SAME_VIEW_MM = RestSettings().near_mm
# About so many targets are used for the predicted error; for time alone.
_MOST_TARGETS = 200


class PoseJudge:
    """Judges fits of one bone under one rig.

    A rig whose calibration tells no quality is taken as it is. A pose of which nothing can be said
    is withheld, unless refused ones are followed. Where the judge is left out every pose is OK that
    was compared with the pictures; its bound is told all the same.

    Attributes:
        outline: of the bone.
    """

    def __init__(self, meter: SurfaceMeter, settings: TrackerSettings) -> None:
        self._meter, self._settings = meter, settings
        self._quality = meter.rectifier.rig.quality
        self._is_rig_accepted = self._quality is None or self._quality.is_accepted
        self.outline = OutlineMeter(meter.model, meter.geometry)

    def judge(self, frame: Frame, fit: Fit | None, goal: Goal) -> TrackedFrame:
        """The answer that a fit gives, in the left camera before rectification.

        Args:
            frame: that it was fitted in; without checks they are made here.
            fit: None out of view.
            goal: of the stage.
        """
        if fit is None:
            return self.lost(Reason.OUT_OF_VIEW, frame.watch)
        model = self._meter.model
        checks = frame.checks or PairChecks(self._meter, frame.pair)
        check = checks.check(fit.measured, fit.pose).result()
        known = self._evidence_of_pair(check.health, fit.pose.apply(model.centre_mm))
        looks = [self._look(frame, fit, check, goal, known)]
        # Too little may be left of a bone that was worked on: then all of its outline counts. On a
        # whole one that goes wrong: what is not measured lies under a hand.
        if model.bone.lid is not None and looks[0][2].seen_excess_mm > 0.0:
            looks.append(self._look(frame, fit, check, goal, known, counts_unmeasured=True))
        # Of equally good ones the first.
        fit, view, evidence = min(looks, key=lambda look: decide(look[2]).rank)
        verdict = decide(evidence)
        has_bound = verdict.predicted_tre_mm is not None
        if has_bound and "judge" in self._settings.leaves_out:
            verdict = replace(verdict, status=Status.OK, reasons=())
        is_told = has_bound or self._settings.follows_refused
        turn = self._meter.geometry.rectified_from_left.inverse()
        estimate = _at_seen_rows(frame, fit).turn_camera(turn) if is_told else None
        rows = _check_rows(check.health, evidence, verdict)
        frame.watch.lap("judge")
        foreground = None
        if view is not None and verdict.status is not Status.LOST:
            foreground = self._find_foreground(frame, fit, view, checks)
        return TrackedFrame(
            model.bone.name, estimate, verdict, frame.watch.timings, rows, foreground
        )

    def _look(
        self, frame: Frame, fit: Fit, check: PairCheck, goal: Goal, known: Evidence,
        *, counts_unmeasured: bool = False,
    ) -> tuple[Fit, RenderedView | None, Evidence]:  # fmt: skip
        """The fit joined with its outline, the model at its pose, and the evidence of that pose."""
        fit, view, agreement = self._settle(frame, fit, check, counts_unmeasured)
        return fit, view, self._evidence_of_pose(known, frame, fit, agreement, goal)

    def _find_foreground(
        self, frame: Frame, fit: Fit, view: RenderedView, checks: PairChecks
    ) -> Foreground | None:
        """What stands in front of the bone at its pose; None where the gaps are not filled."""
        if (surroundings := checks.surroundings(frame.watch)) is None:
            return None
        model, geometry = self._meter.model, self._meter.geometry
        if model.bone.lid is not None:  # what lies over the face of a cut hides the bone as well
            view = model.render(fit.pose, geometry, view.box, has_lid=True)
        found = find_foreground(surroundings, fit.measured.disparity, view, geometry)
        frame.watch.lap("fill")
        return found

    def _settle(
        self, frame: Frame, fit: Fit, check: PairCheck, counts_unmeasured: bool
    ) -> tuple[Fit, RenderedView | None, Agreement | None]:
        """The fit joined with its outline, the model at its pose, and how far it agrees.

        The check has compared a fit on the model where it was matched. Free fits, and those that
        the outline moved, are compared at their pose.
        """
        model, measured, agreement = self._meter.model, fit.measured, check.agreement
        view = measured.rendered
        if agreement is not None:
            noise_variance_ratio = self._noise_variance_ratio(fit, agreement)
            if "contour" in self._settings.leaves_out:
                joined = replace(fit, estimate=fit.estimate.scale_noise(noise_variance_ratio))
            else:
                joined = self.outline.join(
                    frame.pair, fit, check.coarse_px, noise_variance_ratio,
                    counts_unmeasured=counts_unmeasured,
                )  # fmt: skip
            if fit.pose.mean_motion_mm(joined.pose, model.hull_mm) > _SAME_VIEW_MM:
                agreement = None
            fit = joined.with_correlated_residuals(noise_variance_ratio)
        if agreement is None and fit.estimate.has_finite_covariance:
            geometry, disparity = self._meter.geometry, measured.disparity
            view = model.render(fit.pose, geometry, disparity.box)
            agreement = compare(
                view, model, disparity, geometry, check.coarse_px, check.is_near_clipped
            )
        return fit, view, agreement

    def _noise_variance_ratio(self, fit: Fit, agreement: Agreement) -> float:
        """Variance that counts as noise over the one that a fit on the model claims.

        For a bone in the open it is what correct poses show at most. For a hidden one it is
        what is claimed: something flush with the bone may fit as well. So it is of a bone whose
        cartilage was fitted: most of that covariance is the plan's, which is no noise.
        """
        is_noise = agreement.lies_open and fit.estimate.thickness_ratio is None
        return NOISE_VARIANCE_RATIO if is_noise else 1.0

    def lost(self, reason: Reason, watch: Stopwatch) -> TrackedFrame:
        """The answer when there is no fit to judge."""
        verdict = decide(Evidence(missing=reason, is_rig_accepted=self._is_rig_accepted))
        return TrackedFrame(self._meter.model.bone.name, None, verdict, watch.timings)

    def lost_in(self, frame: Frame) -> TrackedFrame:
        """The answer when nothing fits near the start of a frame, with what its pictures say."""
        centre_mm = frame.start.apply(self._meter.model.centre_mm)
        disparity_px = self._meter.geometry.disparity_px(float(centre_mm[2]))
        known = self._evidence_of_pair(measure_health(frame.pair, None, disparity_px), centre_mm)
        verdict = decide(replace(known, missing=Reason.BONE_LOST))
        return TrackedFrame(self._meter.model.bone.name, None, verdict, frame.watch.timings)

    def _evidence_of_pair(self, health: StereoHealth, centre_mm: FloatArray) -> Evidence:
        """What the pictures themselves say against any pose of a bone.

        Args:
            health: of the pair.
            centre_mm: (3,) of the bone, in the rectified left camera.
        """
        both = (health.left, health.right)
        dark = max(one.dark_fraction for one in both)
        saturated = max(one.saturated_fraction for one in both)
        # Light is told first: a dark or clipped picture has no detail either.
        detail_ratio = 0.0
        if max(dark, saturated) <= UNUSABLE_FRACTION:
            least, most = sorted(one.detail for one in both)
            detail_ratio = most / least if least > 0.0 else math.inf if most > 0.0 else 0.0
        # A vertical disparity of v px shows that a camera was turned about the baseline. That costs
        # little, but it was probably turned as far about other axes, and a turn that moves a
        # picture sideways by v px moves the measured depth by z^2 / (f B) v.
        focal_px, baseline_mm = self._meter.geometry.focal_px, self._meter.geometry.baseline_mm
        x_mm, depth_mm = float(centre_mm[0]), float(centre_mm[2])
        offset_px = _sure(health.row_offset_px, health.row_offset_sigma_px)
        offset_mm = offset_px * depth_mm**2 / (focal_px * baseline_mm)
        # Where the right picture is taller, its camera stands nearer than it should, or has another
        # focal length. Then it is wider as well: a point that lies f (x - B) / z beside its middle
        # is seen off by the same share of that, and so is its disparity.
        stretch = _sure(health.row_stretch, health.row_stretch_sigma)
        stretch_mm = stretch * depth_mm * abs(x_mm - baseline_mm) / baseline_mm
        return Evidence(
            dark_fraction=dark,
            saturated_fraction=saturated,
            detail_ratio=detail_ratio,
            smoothness=float(np.fmax(health.left.smoothness, health.right.smoothness)),
            has_lost_rows=health.has_lost_rows,
            row_error_mm=max(offset_mm, stretch_mm),
            is_rig_accepted=self._is_rig_accepted,
        )

    def _evidence_of_pose(
        self, known: Evidence, frame: Frame, fit: Fit, agreement: Agreement | None, goal: Goal
    ) -> Evidence:
        """With what a fit and its agreement with the measurement say."""
        model, estimate = self._meter.model, fit.estimate
        is_on_model = fit.measured.rendered is not None
        correlated_ratio = math.nan
        if is_on_model:
            correlated_ratio = fit.variance_ratio / TOLERATED_VARIANCE_RATIO
        if not estimate.has_finite_covariance:
            return replace(known, estimate=estimate, correlated_ratio=correlated_ratio)
        if agreement is None or agreement.n_visible == 0:
            return replace(known, missing=Reason.OUT_OF_VIEW)
        is_seen = model.bone.mesh.visible_vertices(estimate.camera_from_bone)
        seen_sd_mm = model.bone.cartilage_sd_mm[is_seen]
        cartilage_sd_mm = float(np.sqrt(np.mean(seen_sd_mm**2))) if len(seen_sd_mm) else 0.0
        surface_mm = _COMMON_ERROR_SIGMAS * model.bone.surface_sd_mm
        plan_mm = math.hypot(_COMMON_ERROR_SIGMAS * cartilage_sd_mm, surface_mm)
        seen_error_mm = self._bound_mm(estimate, goal.targets_mm, is_seen)
        motion_mm = 0.0 if frame.times is None else frame.times.error_mm(fit.pose)
        depth_mm = float(fit.pose.apply(model.centre_mm)[2])
        rig_mm = 0.0 if self._quality is None else self._quality.error_mm(depth_mm)
        unseen_mm = plan_mm if estimate.thickness_ratio is None else surface_mm
        bound_mm = math.hypot(seen_error_mm, unseen_mm, rig_mm, motion_mm)
        size_excess_mm = math.nan
        if (sized := estimate.sized) is not None:
            # Errors of a cartilage's thickness that go together look like another size.
            size_sigma_mm = math.hypot(sized.growth_sigma_mm, unseen_mm)
            size_limit_mm = max(OK_ERROR_MM, _SURE_SIGMAS * size_sigma_mm)
            size_excess_mm = abs(sized.growth_mm) - size_limit_mm
        twist = np.zeros(6)
        if frame.predicted is not None:
            twist = frame.predicted.twist_to(fit.pose, model.centre_mm)
        return replace(
            known,
            estimate=estimate,
            agreement=agreement,
            rms_ratio=estimate.rms_mm / estimate.expected_rms_mm,
            correlated_ratio=correlated_ratio,
            size_excess_mm=size_excess_mm,
            seen_error_mm=seen_error_mm,
            plan_mm=plan_mm,
            bound_mm=math.hypot(bound_mm, known.row_error_mm),
            motion_mm=motion_mm,
            cartilage_sd_mm=cartilage_sd_mm,
            jump_mm=float(np.linalg.norm(twist[:3])),
            jump_deg=math.degrees(np.linalg.norm(twist[3:])),
            goal=goal,
        )

    def _bound_mm(
        self, estimate: PoseEstimate, targets_mm: FloatArray, is_seen: NDArray[np.bool_]
    ) -> float:
        """95 % bound of the measurement alone; over what is seen when there are no targets."""
        model = self._meter.model
        if len(targets_mm) > 0:
            points_mm, index = targets_mm, np.arange(len(targets_mm))
        else:
            points_mm, index = model.bone.mesh.vertices_mm, np.flatnonzero(is_seen)
        if len(index) == 0:
            return float("inf")
        step = max(1, len(index) // _MOST_TARGETS)
        return estimate.predict_tre_mm(model.centre_mm, points_mm[index[::step]])


def _sure(value: float, sigma: float) -> float:
    """Its magnitude; 0 where that is not sure, or not known."""
    return abs(value) if abs(value) > _SURE_SIGMAS * sigma else 0.0


def _check_rows(health: StereoHealth, evidence: Evidence, verdict: Verdict) -> RowCheck | None:
    """What a pair says of its rig; None when its pictures or its points are too poor to tell."""
    is_poor = math.isnan(health.row_offset_px) or not UNUSABLE_PICTURES.isdisjoint(verdict.reasons)
    return None if is_poor else RowCheck(health.row_offset_px, evidence.row_error_mm > OK_ERROR_MM)


def _at_seen_rows(frame: Frame, fit: Fit) -> PoseEstimate:
    """The estimate at the time at which what is seen of the bone was exposed."""
    if frame.times is None:
        return fit.estimate
    pose = frame.times.move_to_seen(fit.pose, fit.measured.disparity)
    return replace(fit.estimate, camera_from_bone=pose)
