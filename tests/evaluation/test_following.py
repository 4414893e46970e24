"""A method on a sequence: what the operator of a test does, and that the truth is hidden."""

import time
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from navapp.config import Configuration
from navapp.control.commands import Accept, Register, Reject
from navapp.control.controller import SessionController
from navapp.control.stages import STAGES
from navapp.control.states import SessionState
from navapp.evaluation import following
from navapp.evaluation.following import Operator, follow
from navapp.evaluation.paper.cases import Case, CaseTest
from navapp.evaluation.scoring import score_answers
from navapp.evaluation.sequence import KnownSequence
from navapp.evaluation.worst_frame import draw_worst_frame
from navapp.values import Prior, Status
from tests.control.fakes import (
    DOUBTED,
    GONE,
    LOST,
    PERIOD_NS,
    Bench,
    FakeTracker,
    Script,
    a_frame,
    a_plan,
    a_pose,
    a_rig,
    answer,
)

N = 9
NONSENSE = a_pose(x_mm=57.0, turn_deg=80.0)


@pytest.fixture
def script(monkeypatch) -> Script:
    """What the trackers of the next sessions answer."""
    script = Script()
    make = partial(SessionController, make_tracker=lambda _, bone, *__: FakeTracker(script, bone))
    monkeypatch.setattr(following, "SessionController", make)
    return script


@pytest.fixture
def given(monkeypatch) -> list[type]:
    """The commands that operators give, by their kind."""
    kinds: list[type] = []
    whole = Operator.commands

    def note(self, snapshot):
        commands = whole(self, snapshot)
        kinds.extend(type(one) for one in commands)
        return commands

    monkeypatch.setattr(Operator, "commands", note)
    return kinds


def a_sequence(truth=None, n=N) -> KnownSequence:
    frames = [a_frame(10**9 + number * PERIOD_NS, number) for number in range(n)]
    prior = Prior({"femur": a_pose()})
    return KnownSequence(
        frames, truth or [a_pose()] * n, Configuration(), a_rig(), a_plan(), prior, STAGES[0]
    )


@pytest.mark.parametrize("method", ["icp", "paper", "bimcc"])
def test_it_is_registered_once_and_then_followed(script, given, method) -> None:
    answers = follow(a_sequence(), method)
    assert script.calls == ["register femur"] + ["track femur"] * (N - 1)
    assert given == [Register, Accept]
    assert [frame.is_search for frame in answers.frames] == [True] + [False] * (N - 1)
    assert all(frame.is_ok for frame in answers.frames)
    assert len(answers.poses) == N
    assert answers.n_registrations == 1
    assert answers.registration_s > 0.0


@pytest.mark.parametrize(("method", "found"), [("icp", GONE), ("bimcc", GONE), ("bimcc", LOST)])
def test_a_search_that_fails_is_made_five_times(script, given, method, found) -> None:
    script.found = [found]
    answers = follow(a_sequence(), method)
    assert script.calls == ["register femur"] * 5
    assert Accept not in given
    assert answers.n_registrations == 5
    assert answers.registration_s is None, "nothing was found"
    assert [frame.is_search for frame in answers.frames] == [True] * 5 + [False] * (N - 5)
    assert not any(frame.is_ok for frame in answers.frames)


def test_a_rejected_pose_is_no_registration(script, given, monkeypatch) -> None:
    script.found = [DOUBTED]
    whole = FakeTracker.register

    def register(self, *arguments):
        if script.calls.count("register femur") == 1:
            script.found = [LOST]
        return whole(self, *arguments)

    monkeypatch.setattr(FakeTracker, "register", register)
    answers = follow(a_sequence(n=12), "bimcc")
    assert answers.n_registrations == 5
    assert Accept not in given
    assert answers.registration_s is None, "the first search found a pose, which was rejected"


@pytest.mark.parametrize("first", [LOST, DOUBTED])
def test_a_later_search_counts_with_those_before(script, monkeypatch, first) -> None:
    script.found = [first]
    whole = FakeTracker.register

    def register(self, *arguments):
        if script.calls.count("register femur") == 2:
            script.found = [answer()]
            time.sleep(0.05)
        return whole(self, *arguments)

    monkeypatch.setattr(FakeTracker, "register", register)
    answers = follow(a_sequence(), "bimcc")
    assert answers.n_registrations == 3
    assert answers.registration_s > 0.05, "until the answer that was accepted"
    n_before = next(place for place, frame in enumerate(answers.frames) if frame.is_ok)
    # One that has to be rejected is searched for again a frame later.
    assert n_before == (2 if first is LOST else 4)
    assert all(frame.is_ok for frame in answers.frames[n_before:])


@pytest.mark.parametrize(
    ("verdict", "follows_refused", "expected"),
    [
        (answer().verdict, False, [Accept(3)]),
        (answer().verdict, True, [Accept(3)]),
        (DOUBTED.verdict, False, [Reject(3)]),
        (DOUBTED.verdict, True, [Accept(3)]),
        (LOST.verdict, False, [Reject(3)]),
        (LOST.verdict, True, []),
        (None, False, [Reject(3)]),
        (None, True, []),
    ],
)
def test_what_is_lost_is_never_accepted(verdict, follows_refused, expected) -> None:
    snapshot = replace(Bench().snapshot, state=SessionState.REVIEW, verdict=verdict, candidate_id=3)
    assert Operator(follows_refused=follows_refused).commands(snapshot) == expected


def test_nothing_is_done_while_it_navigates() -> None:
    snapshot = replace(Bench().snapshot, state=SessionState.NAVIGATING, verdict=LOST.verdict)
    assert Operator(follows_refused=False).commands(snapshot) == []


def test_ours_accepts_what_is_doubted_when_it_has_searched_often(script, given) -> None:
    script.found, script.tracked = [DOUBTED], DOUBTED
    answers = follow(a_sequence(n=11), "bimcc")
    assert given == [Register, Reject] * 4 + [Register, Accept]
    assert answers.frames[-1].verdict.status is Status.DEGRADED
    assert answers.registration_s is not None


@pytest.mark.parametrize("method", ["icp", "paper"])
def test_the_papers_methods_carry_on_what_is_refused_and_never_accept_it(
    script, given, method
) -> None:
    script.found, script.tracked = [LOST], LOST
    answers = follow(a_sequence(), method)
    assert given == [Register]
    assert script.calls == ["register femur"] + ["track femur"] * (N - 1)
    assert all(pose is not None for pose in answers.poses)
    assert {frame.verdict.status for frame in answers.frames} == {Status.LOST}
    assert answers.registration_s is not None


def test_nothing_of_the_truth_is_read(script) -> None:
    class Forbidden:
        """A truth that must not be read."""

        def __getitem__(self, place: int):
            raise AssertionError("the truth was read")

        def __len__(self) -> int:
            raise AssertionError("the truth was read")

    assert follow(replace(a_sequence(), truth=Forbidden()), "bimcc").frames[0].is_ok


@pytest.fixture(scope="module")
def knee() -> KnownSequence:
    """A simulated knee under an instrument, four frames of it."""
    return CaseTest(Case("man", "drilling", "instrument"), 0, 1).render(4)


@pytest.mark.release
@pytest.mark.slow
def test_a_simulated_bone_is_followed_whatever_the_truth_is_said_to_be(knee) -> None:
    answers = follow(knee, "bimcc")
    frames = score_answers(knee, answers, has_budget=True).frames
    assert [frame.status for frame in frames] == ["OK"] * 3
    assert all(frame.tre_mm < 0.5 and frame.displacement_mm < 0.5 for frame in frames)
    # This plan and rig are exact: the judge adds nothing to what the covariance says.
    assert [frame.claimed_mm[2] for frame in frames] == pytest.approx(
        [frame.bound_mm for frame in frames]
    )
    assert [frame.budget is not None for frame in frames] == [True, False, False]
    assert frames[0].budget.reached_mm >= frames[0].tre_mm
    nonsense = replace(knee, truth=[NONSENSE] * 4)
    misled = follow(nonsense, "bimcc")
    for pose, other in zip(answers.poses, misled.poses, strict=True):
        np.testing.assert_array_equal(pose.matrix, other.matrix)
    wrong = score_answers(nonsense, misled, has_budget=False).frames
    assert all(frame.tre_mm > 20.0 for frame in wrong)
    assert draw_worst_frame(knee, answers, frames)[:2] == b"\xff\xd8"


def test_a_simulated_test_knows_where_the_bone_is(knee) -> None:
    assert knee.stage.name == "drilling"
    assert len(knee.frames) == len(knee.truth) == 4
    places = np.array([pose.translation_mm for pose in knee.truth])
    assert 0.0 < np.linalg.norm(places[-1] - places[0]) < 20.0, "the leg breathes"
    times_ns = [frame.captured_ns for frame in knee.frames]
    assert sorted(set(times_ns)) == times_ns
    assert set(knee.made_steps) <= set(knee.plan.content.steps)


def test_what_is_left_out_reaches_the_tracker_and_nothing_is_by_default(monkeypatch) -> None:
    made = []

    def make_tracker(_, bone, settings, *__):
        made.append(settings)
        return FakeTracker(Script(), bone)

    make = partial(SessionController, make_tracker=make_tracker)
    monkeypatch.setattr(following, "SessionController", make)
    for parts in (frozenset(), frozenset({"contour", "judge"})):
        follow(a_sequence(), "bimcc", parts)
        assert made[-1].leaves_out == parts
        assert not made[-1].follows_refused
    follow(a_sequence(), "bimcc")
    assert made[-1].leaves_out == frozenset()
