"""Every rule at its limits, and what is said of several at once."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

from navapp.geometry.transform import RigidTransform
from navapp.registration.verdict import (
    OK_ERROR_MM,
    RULES,
    Agreement,
    Evidence,
    Rule,
    decide,
    is_bone_absent,
    is_misfit,
    is_place_doubted,
    is_worth_a_second_look,
)
from navapp.tracking import Goal
from navapp.values import FrameTimings, PoseEstimate, Reason, Status, TrackedFrame, Verdict
from navapp.values.reasons import CAUSES

DOCS = Path(__file__).parents[2] / "docs" / "how" / "registration.md"
POSE = RigidTransform.identity("left_rect", "femur")
ESTIMATE = PoseEstimate(POSE, np.eye(6), 2000, 0.95, 0.1, 0.1, 5, True)
LOOSE = replace(ESTIMATE, covariance=np.diag([np.inf] * 6)).with_reason(Reason.DEGENERATE)
AGREEMENT = Agreement(5000, 0.9, 0.0, 0.0, 0.95, 0.8)
GOAL = Goal(np.empty((0, 3)), 2.0)
# Nothing speaks against it.
FINE = Evidence(
    None, ESTIMATE, AGREEMENT,
    dark_fraction=0.1, saturated_fraction=0.1, detail_ratio=1.1, correlated_ratio=1.0,
    size_excess_mm=-0.4, seen_error_mm=0.3, plan_mm=0.0, bound_mm=0.4, cartilage_sd_mm=0.0,
    jump_mm=1.0, jump_deg=1.0, goal=GOAL,
)  # fmt: skip


def known(**changes) -> Evidence:
    return replace(FINE, **changes)


def seen(**changes: float) -> Evidence:
    return known(agreement=replace(AGREEMENT, **changes))


def missing(reason: Reason) -> Callable[[float], Evidence]:
    return lambda yes: Evidence(missing=reason) if yes > 0 else FINE


def said(reason: Reason) -> Callable[[float], Evidence]:
    return lambda yes: known(estimate=ESTIMATE.with_reason(reason)) if yes > 0 else FINE


def degenerate(value: float) -> Evidence:
    """Nothing is free, a direction is, all are."""
    if value <= 0:
        return FINE
    free = ESTIMATE.with_reason(Reason.DEGENERATE)
    return known(estimate=free) if value <= 1 else Evidence(estimate=LOOSE)


def fitted_thickness(ratio: float) -> Evidence:
    return known(estimate=replace(ESTIMATE, thickness_ratio=ratio))


@dataclass(frozen=True)
class Row:
    """A reason, evidence with a value of what it looks at, and the limits; `step` is just beyond.

    `-step`: smaller is worse.
    """

    reason: Reason
    evidence: Callable[[float], Evidence]
    degraded: float | None
    lost: float | None
    step: float = 1e-6


# One for each rule, in their order.
ROWS = (
    Row(Reason.PICTURE_DARK, lambda x: known(dark_fraction=x), 0.7, None),
    Row(Reason.PICTURE_OVEREXPOSED, lambda x: known(saturated_fraction=x), 0.7, None),
    Row(Reason.PICTURES_UNLIKE, lambda x: known(detail_ratio=x), 2.0, None),
    Row(Reason.PICTURES_DEFOCUSED, lambda x: known(smoothness=x), 2.9, None),
    Row(Reason.ROWS_DISAGREE, lambda x: known(has_lost_rows=x > 0), 0, None, 1),
    Row(Reason.ROWS_DISAGREE, lambda x: known(row_error_mm=x), 0.5, None),
    Row(Reason.BONE_LOST, missing(Reason.BONE_LOST), None, 0, 1),
    Row(Reason.NO_SURFACE, missing(Reason.NO_SURFACE), None, 0, 1),
    Row(Reason.OUT_OF_VIEW, missing(Reason.OUT_OF_VIEW), None, 0, 1),
    Row(Reason.TOO_FEW_POINTS, said(Reason.TOO_FEW_POINTS), None, 0, 1),
    Row(Reason.NOT_CONVERGED, said(Reason.NOT_CONVERGED), 0, None, 1),
    Row(Reason.DEGENERATE, degenerate, 0, 1, 1),
    Row(Reason.AMBIGUOUS, said(Reason.AMBIGUOUS), 0, None, 1),
    Row(Reason.CUES_DISAGREE, said(Reason.CUES_DISAGREE), 0, None, 1),
    Row(Reason.SURFACE_MISFIT, lambda x: known(correlated_ratio=x), 2.0, None),
    Row(Reason.COVERAGE_LOW, lambda x: seen(coverage=x), 0.2, 0.15, -1e-6),
    Row(Reason.COVERAGE_LOW, lambda x: seen(coverage=x, hidden_fraction=0.84), 0.15, 0.1, -1e-6),
    Row(Reason.SEEN_THROUGH, lambda x: seen(behind_fraction=x), 0.05, 0.15),
    Row(Reason.OUTLIERS, lambda x: seen(inlier_fraction=x), 0.8, 0.5, -1e-6),
    Row(Reason.SURFACE_MISFIT, lambda x: known(rms_ratio=x), 1.25, 2.0),
    Row(Reason.SURFACE_MISFIT, lambda x: seen(spread_ratio=x), 1.1, None),
    Row(Reason.SURFACE_MISFIT, lambda x: known(kernel_fraction=x), None, 0.95),
    Row(Reason.SURFACE_MISFIT, lambda x: known(smooth_excess_mm=x), None, 0),
    Row(Reason.RIG_NOT_ACCEPTED, lambda x: known(is_rig_accepted=x <= 0), 0, None, 1),
    Row(Reason.SIZE_DIFFERS, lambda x: known(extent_mm=x), None, 5.0, -1e-6),
    Row(Reason.SIZE_DIFFERS, lambda x: known(size_excess_mm=x), 0, None),
    Row(Reason.POSE_UNCERTAIN, lambda x: known(seen_error_mm=x + 0.5), 0, None),
    Row(Reason.MOTION_UNKNOWN, lambda x: known(motion_mm=x), 0.5, None),
    Row(Reason.CARTILAGE_UNCERTAIN, lambda x: known(cartilage_sd_mm=x), 0.45, None),
    Row(Reason.CARTILAGE_UNCERTAIN, fitted_thickness, 0.9, None),
    Row(Reason.TRE_TOO_LARGE, lambda x: known(bound_mm=x + 2.0), 0, None),
    Row(Reason.JUMPED, lambda x: known(jump_mm=x), 12.0, None),
    Row(Reason.JUMPED, lambda x: known(jump_deg=x), 10.0, None),
)  # fmt: skip
PAIRS = [
    pytest.param(row, rule, id=f"{rule.reason.name} by {rule.quantity}")
    for row, rule in zip(ROWS, RULES, strict=True)
]
REASONS = {Reason.PICTURES_SWAPPED, Reason.OTHER_SIDE} | {row.reason for row in ROWS}


def told(evidence: Evidence) -> tuple[Status, tuple[Reason, ...]]:
    verdict = decide(evidence)
    return verdict.status, verdict.reasons


@pytest.mark.parametrize(
    ("status", "spread_ratio", "occluded", "is_worth_it"),
    [
        (Status.OK, 0.69, 0.0, False),
        (Status.OK, 0.71, 0.0, True),
        (Status.OK, 0.71, 0.21, False),
        (Status.DEGRADED, 0.3, 0.2, True),
        (Status.DEGRADED, 0.9, 0.21, False),
        (Status.LOST, 0.9, 0.0, False),
    ],
)
def test_what_fits_loosely_in_the_open_is_worth_a_second_look(
    status, spread_ratio, occluded, is_worth_it
) -> None:
    verdict = Verdict(status, 0.2, occluded_fraction=occluded, spread_ratio=spread_ratio)
    assert is_worth_a_second_look(verdict) is is_worth_it


def test_a_pose_that_nothing_speaks_against_is_ok() -> None:
    assert decide(FINE) == Verdict(Status.OK, 0.4, (), 0.9, 0.0, 0.95, 0.1, 0.1, 0.8)


@pytest.mark.parametrize(("row", "rule"), PAIRS)
def test_a_rule_begins_just_beyond_its_limits(row: Row, rule: Rule) -> None:
    assert (rule.reason, rule.degraded, rule.lost) == (row.reason, row.degraded, row.lost)
    assert rule.is_below == (row.step < 0)
    limits = [limit for limit in (row.degraded, row.lost) if limit is not None]
    first, last = limits[0], limits[-1]
    # Just below the first one.
    within = row.evidence(first - row.step)
    assert rule.status(within) is Status.OK
    assert told(within) == (Status.OK, ())
    if row.degraded is not None:
        assert told(row.evidence(first + row.step)) == (Status.DEGRADED, (row.reason,))
    if row.lost is not None:
        before = Status.OK if row.degraded is None else Status.DEGRADED
        assert decide(row.evidence(last - row.step)).status in (before, Status.OK)
        assert rule.status(row.evidence(last + row.step)) is Status.LOST
        assert told(row.evidence(last + row.step)) == (Status.LOST, (row.reason,))


@pytest.mark.parametrize(("row", "rule"), PAIRS)
def test_at_the_limit_itself_nothing_is_said_yet(row: Row, rule: Rule) -> None:
    """Where a difference is looked at, its rounding decides."""
    for limit, status in ((row.degraded, Status.OK), (row.lost, Status.DEGRADED)):
        if limit is not None:
            evidence = row.evidence(limit)
            assert rule.measure(evidence) == pytest.approx(limit, abs=1e-12)
            expected = Status.OK if row.degraded is None else status
            if rule.measure(evidence) == limit:
                assert rule.status(evidence) is expected


def test_what_is_not_known_is_no_reason_and_no_pose_is_ok() -> None:
    assert decide(Evidence()) == Verdict(Status.LOST)
    fixed_by_nothing = replace(FINE, estimate=LOOSE, agreement=None)
    assert decide(fixed_by_nothing).status is Status.LOST
    assert Reason.DEGENERATE in decide(fixed_by_nothing).reasons


def test_what_the_judge_may_say_is_all_in_the_table() -> None:
    assert {rule.reason for rule in RULES} | set(CAUSES) == REASONS
    # Told by the session, which has no pose to judge.
    others = {reason for reason in Reason if reason not in REASONS}
    assert {reason.name for reason in others} == {
        "NOT_NAVIGATING", "BLANKED", "CAMERA_SILENT", "DEVICE_FAULT", "RIG_MOVED", "MIRROR_AWAY",
        "PROJECTOR_ALTERS", "PROJECTOR_LOST", "POSE_TOO_OLD", "TOO_SLOW", "STAGE_WITHOUT_BONE",
        "DISPLAY_DIFFERS", "DISPLAY_NOT_ACCEPTED", "DISPLAY_EXPIRED", "MOVES_TOO_FAST",
        "OTHER_EYE", "MIRROR_INEXACT", "MIRROR_UNCHECKED", "MIRROR_CHECK_FAILED",
        "MIRROR_CHECK_OLD", "CHECK_FAILED", "TIME_OUT_OPEN",
    }  # fmt: skip


def test_reasons_are_told_in_the_order_of_the_table_and_once() -> None:
    evidence = known(
        jump_deg=20.0, jump_mm=20.0, correlated_ratio=3.0, dark_fraction=0.9, is_rig_accepted=False,
        agreement=replace(AGREEMENT, spread_ratio=2.0, behind_fraction=0.1),
    )  # fmt: skip
    assert told(evidence) == (
        Status.DEGRADED,
        (
            Reason.PICTURE_DARK,
            Reason.SURFACE_MISFIT,
            Reason.SEEN_THROUGH,
            Reason.RIG_NOT_ACCEPTED,
            Reason.JUMPED,
        ),
    )


def test_the_worst_rule_decides_and_a_lost_pose_keeps_its_figures() -> None:
    lost = known(
        dark_fraction=0.9, agreement=replace(AGREEMENT, inlier_fraction=0.4), is_rig_accepted=False
    )
    verdict = decide(lost)
    assert verdict.status is Status.LOST
    assert verdict.reasons == (
        Reason.PICTURE_DARK,
        Reason.OUTLIERS,
        Reason.RIG_NOT_ACCEPTED,
    )
    assert (verdict.predicted_tre_mm, verdict.inlier_fraction) == (0.4, 0.4)


def test_without_a_pose_the_pair_is_told_first() -> None:
    assert told(Evidence(missing=Reason.OUT_OF_VIEW, saturated_fraction=0.9)) == (
        Status.LOST,
        (Reason.PICTURE_OVEREXPOSED, Reason.OUT_OF_VIEW),
    )
    assert decide(Evidence(missing=Reason.BONE_LOST)).predicted_tre_mm is None


def test_the_bound_is_held_against_the_tolerance_beside_other_reasons() -> None:
    """With what rows cost, which the bound holds."""
    assert told(known(bound_mm=2.1, row_error_mm=1.0)) == (
        Status.DEGRADED,
        (Reason.ROWS_DISAGREE, Reason.TRE_TOO_LARGE),
    )
    assert told(known(bound_mm=2.1, goal=replace(GOAL, tolerance_mm=2.2))) == (Status.OK, ())


def test_what_the_plan_costs_is_not_held_against_the_view() -> None:
    """In squares."""
    assert told(known(seen_error_mm=0.9)) == (Status.DEGRADED, (Reason.POSE_UNCERTAIN,))
    assert told(known(seen_error_mm=0.9, plan_mm=0.76)) == (Status.OK, ())
    assert told(known(seen_error_mm=0.9, goal=replace(GOAL, seen_limit_mm=np.inf))) == (
        Status.OK,
        (),
    )
    assert GOAL.seen_limit_mm == OK_ERROR_MM == 0.5


def test_what_a_fitted_thickness_explains_is_no_spread() -> None:
    wide = seen(spread_ratio=1.2)
    assert told(wide) == (Status.DEGRADED, (Reason.SURFACE_MISFIT,))
    fitted = decide(replace(wide, estimate=replace(ESTIMATE, thickness_ratio=0.8)))
    assert fitted.reasons == ()
    assert not is_worth_a_second_look(fitted)


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({}, False),
        ({"coverage": 0.14}, True),
        ({"coverage": 0.16}, False),
        ({"coverage": 0.09, "hidden_fraction": 0.9}, True),
        ({"behind_fraction": 0.16}, True),
        ({"behind_fraction": 0.14}, False),
        ({"inlier_fraction": 0.49}, True),
        ({"spread_ratio": 9.0}, False),
    ],
)
def test_a_bone_that_agrees_too_little_is_bone_absent(changes, expected: bool) -> None:
    assert is_bone_absent(replace(AGREEMENT, **changes)) is expected


@pytest.mark.parametrize("reason", sorted(REASONS, key=lambda one: one.name))
def test_some_reasons_speak_against_the_place(reason: Reason) -> None:
    speaks = {
        Reason.NOT_CONVERGED,
        Reason.DEGENERATE,
        Reason.AMBIGUOUS,
        Reason.SURFACE_MISFIT,
        Reason.COVERAGE_LOW,
        Reason.SEEN_THROUGH,
        Reason.OUTLIERS,
    }
    doubted = Verdict(Status.DEGRADED, 0.5, (reason,))
    assert is_place_doubted(doubted) is (reason in speaks)
    assert is_place_doubted(Verdict(Status.LOST, None, (reason,)))
    assert is_misfit(replace(doubted, occluded_fraction=0.1)) is (reason in speaks)
    # No better place mends that little is seen of a bone that something hides.
    hidden = replace(doubted, occluded_fraction=0.3)
    assert is_misfit(hidden) is (reason in speaks - {Reason.COVERAGE_LOW, Reason.DEGENERATE})


def test_the_cause_comes_first_and_once_and_an_ok_has_none() -> None:
    verdict = Verdict(Status.LOST, None, (Reason.TOO_FEW_POINTS,))
    lost = TrackedFrame("femur", None, verdict, FrameTimings())
    assert lost.with_cause(None) is lost
    named = lost.with_cause(Reason.PICTURES_SWAPPED)
    assert named.verdict.reasons == (Reason.PICTURES_SWAPPED, Reason.TOO_FEW_POINTS)
    again = named.with_cause(Reason.PICTURES_SWAPPED)
    assert again.verdict.reasons == named.verdict.reasons
    assert (verdict.cause, named.verdict.cause) == (None, Reason.PICTURES_SWAPPED)
    fine = replace(lost, verdict=Verdict(Status.OK, 0.1))
    assert fine.with_cause(Reason.OTHER_SIDE) is fine


def limit_of(rule: Rule, limit: float | None) -> str:
    return "-" if limit is None else f"{'<' if rule.is_below else '>'} {limit:g}"


def rows_of_the_docs() -> list[str]:
    """The table of docs/how/registration.md, as it follows from the rules."""
    rows = ["| reason | looked at | DEGRADED | LOST | limit from |", "|---|---|---|---|---|"]
    for rule in RULES:
        degraded, lost = (limit_of(rule, limit) for limit in (rule.degraded, rule.lost))
        rows.append(
            f"| {rule.reason.name} | {rule.quantity} | {degraded} | {lost} | {rule.source} |"
        )
    return rows


def test_the_docs_have_the_rules() -> None:
    lines = DOCS.read_text(encoding="utf-8").splitlines()
    expected = rows_of_the_docs()
    first = lines.index(expected[0])
    n_rows = next(k for k, line in enumerate(lines[first:]) if not line.startswith("|"))
    assert lines[first : first + n_rows] == expected
