from dataclasses import replace

import pytest

from navapp.control.interlocks import (
    MAX_POSE_AGE_MS,
    check_interlocks,
    describe_slowness,
    is_current,
)
from navapp.control.stages import STAGES
from navapp.control.states import (
    OtherBone,
    Rates,
    SessionState,
    Snapshot,
)
from navapp.values import Reason, Status, Verdict
from tests.control.fakes import a_pose

GOOD = Snapshot(
    time_ns=0,
    state=SessionState.NAVIGATING,
    stage=STAGES[0],
    stages=STAGES,
    reasons=(),
    verdict=Verdict(Status.OK, 0.5),
    left_from_bone=a_pose(),
    pose_age_ms=10.0,
)


def test_everything_in_order_is_navigable() -> None:
    assert check_interlocks(GOOD) == ()
    assert check_interlocks(replace(GOOD, pose_age_ms=MAX_POSE_AGE_MS)) == ()


@pytest.mark.parametrize("state", [s for s in SessionState if s is not SessionState.NAVIGATING])
def test_no_other_state_is_navigable(state: SessionState) -> None:
    assert check_interlocks(replace(GOOD, state=state))


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"is_blanked": True}, Reason.BLANKED),
        ({"is_camera_silent": True}, Reason.CAMERA_SILENT),
        ({"device_reasons": (Reason.MIRROR_AWAY,)}, Reason.MIRROR_AWAY),
        ({"is_bone_planned": False}, Reason.STAGE_WITHOUT_BONE),
        ({"state": SessionState.FAULT}, Reason.DEVICE_FAULT),
        ({"state": SessionState.SUSPENDED}, Reason.BONE_LOST),
        ({"state": SessionState.REVIEW}, Reason.NOT_NAVIGATING),
        ({"verdict": None}, Reason.BONE_LOST),
        ({"left_from_bone": None}, Reason.BONE_LOST),
        ({"pose_age_ms": None}, Reason.POSE_TOO_OLD),
        ({"pose_age_ms": MAX_POSE_AGE_MS + 1.0}, Reason.POSE_TOO_OLD),
        ({"verdict": Verdict(Status.DEGRADED, 9.0, (Reason.TRE_TOO_LARGE,))}, Reason.TRE_TOO_LARGE),
        ({"verdict": Verdict(Status.LOST)}, Reason.BONE_LOST),
        ({"verdict": Verdict(Status.DEGRADED)}, Reason.BONE_LOST),
    ],
)
def test_each_thing_that_is_wrong_is_named_first(change, reason: Reason) -> None:
    assert check_interlocks(replace(GOOD, **change))[0] is reason


def test_everything_that_is_wrong_is_named_the_most_urgent_first() -> None:
    bad = replace(
        GOOD, is_blanked=True, is_camera_silent=True, is_bone_planned=False, pose_age_ms=9e9,
        verdict=Verdict(Status.LOST, None, (Reason.OUT_OF_VIEW,)),
    )  # fmt: skip
    assert check_interlocks(bad) == (
        Reason.BLANKED,
        Reason.CAMERA_SILENT,
        Reason.STAGE_WITHOUT_BONE,
        Reason.OUT_OF_VIEW,
        Reason.POSE_TOO_OLD,
    )


def test_the_snapshots_own_answer_is_not_looked_at() -> None:
    assert check_interlocks(replace(GOOD, reasons=(Reason.BLANKED,))) == ()


@pytest.mark.parametrize(
    ("verdict", "age_ms", "is_so"),
    [
        (Verdict(Status.OK, 0.3), MAX_POSE_AGE_MS, True),
        (Verdict(Status.OK, 0.3), MAX_POSE_AGE_MS + 1.0, False),
        (Verdict(Status.DEGRADED, 0.3), 10.0, False),
        (Verdict(Status.LOST), 10.0, False),
        (None, None, False),
    ],
)
def test_another_bone_is_current_only_when_ok_and_fresh(verdict, age_ms, is_so: bool) -> None:
    assert is_current(OtherBone("tibia", verdict, age_ms)) == is_so


def test_other_bones_neither_make_navigable_nor_prevent_it() -> None:
    lost = (OtherBone("tibia", Verdict(Status.LOST), 9e9),)
    assert check_interlocks(replace(GOOD, others=lost)) == ()
    well = (OtherBone("tibia", Verdict(Status.OK, 0.1), 1.0),)
    assert check_interlocks(replace(GOOD, others=well, left_from_bone=None)) == (Reason.BONE_LOST,)


SLOW = Rates(frames_per_s=2.9, latency_history_ms=(340.0,) * 12)


def test_a_computer_that_is_too_slow_is_told_with_figures() -> None:
    slow = replace(GOOD, pose_age_ms=MAX_POSE_AGE_MS + 1.0, rates=SLOW)
    assert check_interlocks(slow) == (Reason.TOO_SLOW,)
    told = "too slow: 2.9 pictures a second, 340 ms late; guides need 4"
    assert describe_slowness(slow) == told


@pytest.mark.parametrize(
    "rates",
    [
        Rates(),
        Rates(frames_per_s=2.9),
        replace(SLOW, latency_history_ms=SLOW.latency_history_ms[:9]),
        # One picture took long; the others did not.
        Rates(frames_per_s=12.0, latency_history_ms=(60.0,) * 11 + (900.0,)),
    ],
)
def test_a_pose_that_is_too_old_once_says_nothing_of_the_computer(rates: Rates) -> None:
    old = replace(GOOD, pose_age_ms=MAX_POSE_AGE_MS + 1.0, rates=rates)
    assert check_interlocks(old) == (Reason.POSE_TOO_OLD,)


def test_a_slow_computer_may_show_guides_while_the_pose_is_young() -> None:
    assert check_interlocks(replace(GOOD, rates=SLOW)) == ()
