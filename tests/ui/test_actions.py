from collections import Counter

import pytest

from navapp.control.rules import why_refused
from navapp.control.stages import STAGES
from navapp.control.states import SessionState
from navapp.ui.actions import ACTION_OF_NAME, ACTIONS, is_possible
from navapp.values import Status, Verdict
from tests.ui import snapshots


def test_every_key_has_one_action() -> None:
    assert Counter(action.key for action in ACTIONS).most_common(1)[0][1] == 1


@pytest.mark.parametrize("state", list(SessionState))
@pytest.mark.parametrize("is_silent", [False, True])
def test_blank_and_quit_are_possible_in_every_state(state: SessionState, is_silent: bool) -> None:
    snapshot = snapshots.navigating(state=state)
    assert is_possible(ACTION_OF_NAME["blank"], snapshot, is_silent)
    assert is_possible(ACTION_OF_NAME["quit"], snapshot, is_silent)


def test_nothing_is_accepted_on_an_old_word() -> None:
    assert is_possible(ACTION_OF_NAME["accept"], snapshots.review(), is_silent=False)
    assert not is_possible(ACTION_OF_NAME["accept"], snapshots.review(), is_silent=True)


@pytest.mark.parametrize("state", list(SessionState))
def test_accept_and_reject_need_a_candidate(state: SessionState) -> None:
    snapshot = snapshots.review(state=state, candidate_id=None)
    assert not is_possible(ACTION_OF_NAME["accept"], snapshot, is_silent=False)
    assert not is_possible(ACTION_OF_NAME["reject"], snapshot, is_silent=False)


def test_stages_end_at_the_first_and_the_last() -> None:
    first = snapshots.navigating(stage=STAGES[0])
    last = snapshots.navigating(stage=STAGES[-1])
    assert not is_possible(ACTION_OF_NAME["previous-stage"], first, is_silent=False)
    assert is_possible(ACTION_OF_NAME["next-stage"], first, is_silent=False)
    assert is_possible(ACTION_OF_NAME["previous-stage"], last, is_silent=False)
    assert not is_possible(ACTION_OF_NAME["next-stage"], last, is_silent=False)


def test_a_candidate_that_is_lost_can_only_be_rejected() -> None:
    snapshot = snapshots.review(verdict=Verdict(Status.LOST))
    assert not is_possible(ACTION_OF_NAME["accept"], snapshot, is_silent=False)
    assert is_possible(ACTION_OF_NAME["reject"], snapshot, is_silent=False)


def test_the_eye_needs_a_simulated_mirror() -> None:
    assert not is_possible(ACTION_OF_NAME["eye"], snapshots.navigating(), is_silent=False)
    assert is_possible(ACTION_OF_NAME["eye"], snapshots.navigating(has_eye=True), is_silent=False)


def test_a_page_can_always_be_opened() -> None:
    for action in ACTIONS:
        if action.command is None:
            assert is_possible(action, snapshots.starting(), is_silent=True), action.name


@pytest.mark.parametrize("name", ["accept", "reject"])
def test_a_key_decides_about_no_candidate_that_was_not_on_the_screen(name: str) -> None:
    command = ACTION_OF_NAME[name].command(snapshots.navigating(candidate_id=None))
    shown = snapshots.navigating(candidate_id=3, verdict=snapshots.navigating().verdict)
    assert why_refused(command, shown) == "another candidate is under review now"
