"""The tasks follow what a session goes through."""

import dataclasses

import numpy as np

from navapp.control.capture.states import CapturePhase, CaptureSnapshot, Outcome
from navapp.control.stages import STAGES
from navapp.control.states import SessionState, Snapshot
from navapp.ui.tutorial.tasks import (
    make_capture_guide,
    make_navigation_guide,
    make_room_guide,
)
from navapp.values import Reason
from tests.ui import snapshots

OPEN = (snapshots.condition("patient", "this is the plan's patient"),)
OPENING = snapshots.navigating(stage=STAGES[0])


def in_state(state: SessionState, *reasons: Reason) -> Snapshot:
    return dataclasses.replace(
        OPENING, state=state, reasons=reasons or (Reason.NOT_NAVIGATING,), time_out=OPEN
    )


REVIEW = dataclasses.replace(in_state(SessionState.REVIEW), candidate_id=1)
ACCEPTED = in_state(SessionState.NAVIGATING, Reason.TIME_OUT_OPEN)
BLANKED = dataclasses.replace(OPENING, is_blanked=True, reasons=(Reason.BLANKED,))


def test_the_room_is_gone_through_one_task_after_the_other() -> None:
    guide = make_room_guide()
    way = (
        in_state(SessionState.STARTING),
        in_state(SessionState.READY),
        in_state(SessionState.REGISTERING),
        REVIEW,
        ACCEPTED,
        OPENING,
        BLANKED,
        OPENING,
    )
    reached = []
    for snapshot in way:
        guide.observe(snapshot)
        reached.append(guide.n_reached)
    assert reached == [0, 1, 1, 2, 3, 4, 5, 6]
    assert guide.is_complete


def test_a_rejected_candidate_is_no_accepted_one() -> None:
    guide = make_room_guide()
    for snapshot in (REVIEW, in_state(SessionState.READY)):
        guide.observe(snapshot)
    assert guide.now.endswith("r and then g again.")


def test_navigation_ends_in_the_second_stage_with_guides() -> None:
    guide = make_navigation_guide()
    for snapshot in (REVIEW, ACCEPTED, OPENING):
        guide.observe(snapshot)
    assert guide.now.startswith("Press ]")
    guide.observe(dataclasses.replace(OPENING, refused_stage=2))
    assert guide.now.startswith("On the page of the gates")
    lost = snapshots.suspended(stage=STAGES[1])
    guide.observe(lost)
    assert not guide.is_complete
    guide.observe(snapshots.navigating())
    assert guide.is_complete


def capture(
    n_kept: int,
    *,
    is_following: bool = False,
    is_enough: bool = False,
    outcome: Outcome | None = None,
) -> CaptureSnapshot:
    return CaptureSnapshot(
        time_ns=n_kept,
        phase=CapturePhase.CAPTURING,
        camera="sim:camera",
        has_hand=True,
        is_following=is_following,
        pictures=None,
        n_seen=(0, 0, 70),
        checks=(),
        instruction="",
        n_kept=n_kept,
        bound_mm=None,
        worst_mm=None,
        stop_mm=0.15,
        is_enough=is_enough,
        covered=np.zeros((2, 6, 8), bool),
        progress=None,
        events=(),
        outcome=outcome,
    )


def test_a_capture_ends_with_an_accepted_rig() -> None:
    guide = make_capture_guide()
    way = (
        capture(0),
        capture(0, is_following=True),
        capture(5, is_following=True),
        capture(9, is_following=True, is_enough=True),
        capture(9, is_enough=True, outcome=Outcome(is_accepted=False, sentences=("no",))),
        capture(12, is_enough=True, outcome=Outcome(is_accepted=True, sentences=())),
    )
    reached = []
    for snapshot in way:
        guide.observe(snapshot)
        reached.append(guide.n_reached)
    assert reached == [0, 1, 2, 3, 3, 4]
