"""The verdict: every rule by which a pose is shown (OK), doubted (DEGRADED) or not there (LOST).

`RULES` is the whole of it: what speaks against a pose, from which value on, and where that value
comes from. What is measured to judge by is `Evidence`. Nothing else adds a reason, but for a cause
that the diagnosis finds once a bone is lost (`TrackedFrame.with_cause`).
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

from navapp.geometry.transform import FloatArray
from navapp.values import PoseEstimate, Reason, Status, Verdict

# What navigation promises of an OK pose, at 95 %, beside what the plan says of its own cartilage.
OK_ERROR_MM = 0.5
CHOSEN = "chosen"
# A bone fills half of its box and more; what lies around it may be black.
UNUSABLE_FRACTION = 0.7
# Of the model, by something before it: the bone lies in the open; chosen.
_LITTLE_OCCLUDED = 0.2
# Spread of the differences over the sigma that they claim. At true poses of patellas it is 0.45 to
# 0.54 where these are matt, 0.7 to 1.5 where they mirror the lamps (tests.bench.bone_highlights).
_LOOSE_SPREAD = 0.7


@dataclass(frozen=True, slots=True)
class Agreement:
    """Comparison of the rendered model with what was measured; fractions of its visible pixels."""

    n_visible: int  # model pixels in the box
    coverage: float  # measured, and agreeing
    hidden_fraction: float  # hidden by something nearer
    behind_fraction: float  # the scene is seen through them
    inlier_fraction: float  # of the measured ones that nothing hides: agreeing
    spread_ratio: float  # of the differences over the sigma that they claim; 0 without any

    @property
    def open_coverage(self) -> float:
        """Share of what nothing hides that was measured and agrees."""
        return self.coverage / max(1.0 - self.hidden_fraction, 1e-9)

    @property
    def lies_open(self) -> bool:
        """More of the bone is measured and agrees than something nearer hides."""
        return self.coverage > self.hidden_fraction


@dataclass(frozen=True, slots=True, eq=False)
class Goal:
    """What a pose is measured against."""

    targets_mm: FloatArray  # (N, 3) of the stage, in bone coordinates
    tolerance_mm: float  # of the stage: the bound by all that is known must stay below it
    # The bound by what is seen must stay below this; what errors of the plan may cost is added in
    # squares, since no better view mends them.
    seen_limit_mm: float = OK_ERROR_MM


@dataclass(frozen=True, slots=True, eq=False)
class Evidence:
    """What is known of a pose when it is judged; NaN and None where nothing is. Bounds are 95 %."""

    missing: Reason | None = None  # why there is no pose to be judged
    estimate: PoseEstimate | None = None  # in the rectified left camera
    agreement: Agreement | None = None  # of the model at the pose with what was measured
    dark_fraction: float = math.nan  # of the darker picture
    saturated_fraction: float = math.nan  # of the brighter picture
    detail_ratio: float = math.nan  # sharper over blurred picture; 0 when light already tells
    smoothness: float = math.nan  # of the less sharp picture (`stereo.PictureHealth`)
    has_lost_rows: bool = False  # too large a vertical disparity to be measured
    row_error_mm: float = 0.0  # in depth, that a sure vertical disparity stands for
    rms_ratio: float = math.nan  # rms of the fit's residuals over the one predicted
    correlated_ratio: float = math.nan  # variance of residuals over the tolerated one
    # Of points that do not know their noise (clouds; never in a tracker): width of the kernel at
    # the end over the widest, and correlated residuals less what a right pose leaves.
    kernel_fraction: float = math.nan
    smooth_excess_mm: float = math.nan
    extent_mm: float = math.nan  # longest side of the scene or of the model, the smaller one's
    is_rig_accepted: bool = True  # by its calibration
    size_excess_mm: float = math.nan  # the bone surely has another size, by more than may be
    seen_error_mm: float = math.nan  # bound of the error by what is seen
    plan_mm: float = math.nan  # bound of what the plan's cartilage and surface may be off by
    bound_mm: float | None = None  # bound of the error by all that is known; None without a pose
    motion_mm: float = math.nan  # that motion between rows and eyes may cost
    cartilage_sd_mm: float = math.nan  # rms over the seen surface
    jump_mm: float = math.nan  # of the bone's centre from where it was expected
    jump_deg: float = math.nan  # turn from how it was expected
    goal: Goal | None = None

    def says(self, reason: Reason) -> bool:
        """Whether the estimate itself has a reason against it."""
        return self.estimate is not None and reason in self.estimate.reasons

    @property
    def n_loose(self) -> int:
        """1 when a direction is free, 2 when the points fix no pose at all."""
        is_loose = self.estimate is not None and not self.estimate.has_finite_covariance
        if is_loose and not self.says(Reason.TOO_FEW_POINTS):
            return 2
        return int(self.says(Reason.DEGENERATE))

    @property
    def seen(self) -> Agreement:
        """The agreement; NaN without one."""
        return _UNKNOWN if self.agreement is None else self.agreement

    @property
    def seen_excess_mm(self) -> float:
        """By which what is seen fixes the pose too loosely."""
        limit_mm = math.nan if self.goal is None else self.goal.seen_limit_mm
        return self.seen_error_mm - math.hypot(limit_mm, self.plan_mm)

    @property
    def thickness_ratio(self) -> float:
        """As of the estimate; NaN where thickness was not fitted."""
        ratio = None if self.estimate is None else self.estimate.thickness_ratio
        return math.nan if ratio is None else ratio

    @property
    def spread_ratio(self) -> float:
        """Of the agreement; 0 where thickness, which the differences still hold, was fitted."""
        return self.seen.spread_ratio if math.isnan(self.thickness_ratio) else 0.0

    @property
    def tolerance_excess_mm(self) -> float:
        """By which the bound exceeds the stage's tolerance."""
        if self.bound_mm is None or self.goal is None:
            return math.nan
        return self.bound_mm - self.goal.tolerance_mm


_UNKNOWN = Agreement(0, *[math.nan] * 5)


@dataclass(frozen=True, slots=True)
class Rule:
    """One reason against a pose."""

    reason: Reason
    quantity: str  # what is looked at, for people
    measure: Callable[[Evidence], float]  # the quantity in the evidence; NaN is no reason
    degraded: float | None  # beyond this the pose is not shown; None is never
    lost: float | None  # beyond this it is not there
    source: str  # of the limits: a command that measures them, or "chosen"
    is_below: bool = False  # smaller is worse
    doubts_place: bool = False  # speaks against the pose's place, not only against its accuracy

    def status(self, evidence: Evidence) -> Status:
        """What this rule alone says."""
        value = self.measure(evidence)
        if self._is_beyond(value, self.lost):
            return Status.LOST
        return Status.DEGRADED if self._is_beyond(value, self.degraded) else Status.OK

    def _is_beyond(self, value: float, limit: float | None) -> bool:
        return limit is not None and (value < limit if self.is_below else value > limit)


def _without_pose(reason: Reason, quantity: str) -> Rule:
    return Rule(reason, quantity, lambda e: e.missing is reason, None, 0, CHOSEN)


_PARTLY_CHOSEN = "tests.bench.wrong_plans; LOST chosen"
_JUDGE_LIMITS = "tests.bench.judge_limits; LOST chosen"
_HEALTH = "tests.bench.stereo_health"
_RESIDUALS = "chosen; noise by tests.bench.correlated_residuals"

# In the order in which reasons are told: what is wrong with the pair first, as the cause.
RULES = (
    Rule(Reason.PICTURE_DARK, "pixels too dark for texture",
         lambda e: e.dark_fraction, UNUSABLE_FRACTION, None, CHOSEN),
    Rule(Reason.PICTURE_OVEREXPOSED, "pixels that the sensor clipped",
         lambda e: e.saturated_fraction, UNUSABLE_FRACTION, None, CHOSEN),
    Rule(Reason.PICTURES_UNLIKE, "detail of one picture over the other's",
         lambda e: e.detail_ratio, 2.0, None, CHOSEN),
    Rule(Reason.PICTURES_DEFOCUSED, "smoothness of the less sharp picture",
         lambda e: e.smoothness, 2.9, None, "chosen; compared in tests.bench.defocus"),
    Rule(Reason.ROWS_DISAGREE, "rows too far apart to be compared (yes 1)",
         lambda e: e.has_lost_rows, 0, None, _HEALTH),
    Rule(Reason.ROWS_DISAGREE, "depth error that the rows' offset or stretch stands for, mm",
         lambda e: e.row_error_mm, OK_ERROR_MM, None, CHOSEN),
    _without_pose(Reason.BONE_LOST, "nothing was found where the bone was expected (yes 1)"),
    _without_pose(Reason.NO_SURFACE, "no surface was measured (yes 1)"),
    _without_pose(Reason.OUT_OF_VIEW, "no part of the model is in view (yes 1)"),
    Rule(Reason.TOO_FEW_POINTS, "fewer than 60 points pair (yes 1)",
         lambda e: e.says(Reason.TOO_FEW_POINTS), None, 0, CHOSEN),
    Rule(Reason.NOT_CONVERGED, "the fit met its limit of steps (yes 1)",
         lambda e: e.says(Reason.NOT_CONVERGED), 0, None, CHOSEN, doubts_place=True),
    Rule(Reason.DEGENERATE, "a direction is free (1), nothing is fixed (2)",
         lambda e: e.n_loose, 0, 1, CHOSEN,
         doubts_place=True),
    Rule(Reason.AMBIGUOUS, "a different pose explains 0.9 of as much (yes 1)",
         lambda e: e.says(Reason.AMBIGUOUS), 0, None, CHOSEN, doubts_place=True),
    Rule(Reason.CUES_DISAGREE, "half of the outline is off by 3 sigma (yes 1)",
         lambda e: e.says(Reason.CUES_DISAGREE), 0, None, "tests.bench.outline"),
    Rule(Reason.SURFACE_MISFIT, "variance of the residuals over the tolerated one",
         lambda e: e.correlated_ratio, 2.0, None, _RESIDUALS, doubts_place=True),
    Rule(Reason.COVERAGE_LOW, "what nothing hides: measured and agreeing",
         lambda e: e.seen.open_coverage, 0.2, 0.15, _JUDGE_LIMITS, is_below=True,
         doubts_place=True),
    Rule(Reason.COVERAGE_LOW, "the whole visible model: measured and agreeing",
         lambda e: e.seen.coverage, 0.15, 0.1, CHOSEN, is_below=True, doubts_place=True),
    Rule(Reason.SEEN_THROUGH, "model through which the scene is seen",
         lambda e: e.seen.behind_fraction, 0.05, 0.15, CHOSEN, doubts_place=True),
    Rule(Reason.OUTLIERS, "measured model pixels that agree",
         lambda e: e.seen.inlier_fraction, 0.8, 0.5, CHOSEN, is_below=True, doubts_place=True),
    Rule(Reason.SURFACE_MISFIT, "rms of the fit's residual over the predicted one",
         lambda e: e.rms_ratio, 1.25, 2.0, _PARTLY_CHOSEN, doubts_place=True),
    Rule(Reason.SURFACE_MISFIT, "spread of all differences over the claimed sigma",
         lambda e: e.spread_ratio, 1.1, None, CHOSEN, doubts_place=True),
    Rule(Reason.SURFACE_MISFIT, "width of the kernel at the end over the widest",
         lambda e: e.kernel_fraction, None, 0.95, CHOSEN, doubts_place=True),
    Rule(Reason.SURFACE_MISFIT, "correlated residuals 3 mm apart less 0.2 mm, mm",
         lambda e: e.smooth_excess_mm, None, 0, CHOSEN, doubts_place=True),
    Rule(Reason.RIG_NOT_ACCEPTED, "the calibration refused the rig (yes 1)",
         lambda e: not e.is_rig_accepted, 0, None, CHOSEN),
    Rule(Reason.SIZE_DIFFERS, "extent of the scene or the model, mm",
         lambda e: e.extent_mm, None, 5.0, CHOSEN, is_below=True),
    Rule(Reason.SIZE_DIFFERS, "size beyond 3 sigma and 0.5 mm from the model's, mm",
         lambda e: e.size_excess_mm, 0, None, CHOSEN),
    Rule(Reason.POSE_UNCERTAIN, "95 % bound by what is seen, over 0.5 mm and the plan's, mm",
         lambda e: e.seen_excess_mm, 0, None, CHOSEN),
    Rule(Reason.MOTION_UNKNOWN, "what motion between rows and eyes may cost, mm",
         lambda e: e.motion_mm, OK_ERROR_MM, None, CHOSEN),
    Rule(Reason.CARTILAGE_UNCERTAIN, "rms deviation of the cartilage, mm",
         lambda e: e.cartilage_sd_mm, 0.45, None,
         "chosen; compared in tests.bench.cartilage"),
    Rule(Reason.CARTILAGE_UNCERTAIN, "rms difference of its thickness over the plan's deviation",
         lambda e: e.thickness_ratio, 0.9, None,
         "chosen; compared in tests.bench.cartilage"),
    Rule(Reason.TRE_TOO_LARGE, "95 % bound over the stage's tolerance, mm",
         lambda e: e.tolerance_excess_mm, 0, None, CHOSEN),
    Rule(Reason.JUMPED, "centre from where it was expected, mm",
         lambda e: e.jump_mm, 12.0, None, CHOSEN),
    Rule(Reason.JUMPED, "turn from where it was expected, deg",
         lambda e: e.jump_deg, 10.0, None, CHOSEN),
)  # fmt: skip

_AGAINST_PLACE = frozenset(rule.reason for rule in RULES if rule.doubts_place)
# Of these, what a better view mends, and no better place, where something hides the bone.
_LITTLE_SEEN = frozenset({Reason.COVERAGE_LOW, Reason.DEGENERATE})


def find_reasons(evidence: Evidence) -> tuple[Reason, ...]:
    """All that speaks against a pose, in the table's order."""
    against = (rule.reason for rule in RULES if rule.status(evidence) is not Status.OK)
    return tuple(dict.fromkeys(against))


def decide(evidence: Evidence) -> Verdict:
    """Status, reasons and bound of what is known."""
    reasons = find_reasons(evidence)
    worst = max((rule.status(evidence) for rule in RULES), key=list(Status).index)
    agreement, estimate = evidence.agreement, evidence.estimate
    if agreement is None or estimate is None:
        # Without a pose that was compared with a measurement nothing is there to be shown.
        return Verdict(Status.LOST, None, reasons)
    return Verdict(
        worst,
        evidence.bound_mm,
        reasons,
        agreement.coverage,
        agreement.hidden_fraction,
        agreement.inlier_fraction,
        estimate.rms_mm,
        estimate.expected_rms_mm,
        evidence.spread_ratio,
    )


def is_bone_absent(agreement: Agreement) -> bool:
    """Whether so little of the model agrees that the bone is not there."""
    evidence = Evidence(agreement=agreement)
    return any(rule.status(evidence) is Status.LOST for rule in RULES)


def is_little_occluded(verdict: Verdict) -> bool:
    """Whether hardly anything lies before the bone: behind a hand highlights are not looked for."""
    return verdict.occluded_fraction <= _LITTLE_OCCLUDED


def is_worth_a_second_look(verdict: Verdict) -> bool:
    """Whether highlights may be why a pose is not OK, or fits no better than it does."""
    fits_loosely = verdict.status is Status.OK and verdict.spread_ratio > _LOOSE_SPREAD
    is_doubted = verdict.status is Status.DEGRADED or fits_loosely
    return is_doubted and is_little_occluded(verdict)


def is_place_doubted(verdict: Verdict) -> bool:
    """Whether something speaks against a pose's place; always when it is lost."""
    return verdict.status is Status.LOST or not _AGAINST_PLACE.isdisjoint(verdict.reasons)


def is_misfit(verdict: Verdict) -> bool:
    """Whether another place may explain better what is seen than a pose's does.

    That little of a bone is seen which something hides is no misfit.
    """
    against = _AGAINST_PLACE if is_little_occluded(verdict) else _AGAINST_PLACE - _LITTLE_SEEN
    return not against.isdisjoint(verdict.reasons)
