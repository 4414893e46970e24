from dataclasses import replace

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from navapp.control.commands import (
    Accept,
    Blank,
    Cancel,
    EnterStage,
    Interrupt,
    Propose,
    Reconnect,
    Register,
    Reject,
    Show,
    ToggleDepth,
    ToggleLayer,
)
from navapp.control.event_log import SessionHooks
from navapp.control.executors import InlineExecutor
from navapp.control.interlocks import check_interlocks
from navapp.control.recorder import RecordingStopped
from navapp.control.states import EventLevel
from navapp.errors import DeviceLost, DeviceNotFound
from navapp.values import Prior, Reason, Status
from tests.control.fakes import (
    DOUBTED,
    LOST,
    PERIOD_NS,
    Bench,
    a_plan,
    a_pose,
    answer,
    hanging_registration,
    navigating,
    wait_for,
)

# -- the way to navigation ----------------------------------------------------------------------


def test_a_session_starts_waits_for_pictures_and_is_ready(bench: Bench) -> None:
    assert bench.state == "starting"
    assert bench.snapshot.progress is not None
    assert bench.frames(1).state.value == "ready"
    assert bench.snapshot.progress is None
    assert bench.script.calls == []


def test_registering_leads_to_review_and_accepting_to_navigation(bench: Bench) -> None:
    bench.frames(1)
    assert bench.do(Register()).state.value == "registering"
    assert bench.frames(1).state.value == "review"
    assert bench.snapshot.is_candidate
    assert not bench.snapshot.is_navigable
    assert bench.take_overs == [1]
    assert bench.accept().state.value == "navigating"
    assert bench.frames(1).is_navigable
    assert bench.shows_guides


def test_a_session_without_a_registration_shows_no_guides(bench: Bench) -> None:
    bench.frames(3)
    assert not bench.shows_guides
    assert not bench.is_dark
    assert bench.snapshot.reasons == (Reason.NOT_NAVIGATING,)
    assert not any(result.is_navigable for result in bench.results)


def test_the_bone_is_followed_from_frame_to_frame(bench: Bench) -> None:
    navigating(bench)
    bench.script.tracked = answer(pose=a_pose(x_mm=3.0))
    bench.frames(1)
    assert bench.snapshot.left_from_bone.translation_mm[0] == 3.0
    assert bench.results[-1].tracked.left_from_bone.translation_mm[0] == 3.0
    assert bench.script.calls[-1] == "track femur"


def test_a_lost_bone_suspends_and_its_return_resumes(bench: Bench) -> None:
    navigating(bench)
    bench.script.tracked = LOST
    assert bench.frames(1).state.value == "suspended"
    assert not bench.shows_guides
    assert Reason.BONE_LOST in bench.snapshot.reasons
    assert bench.events[-1].level is EventLevel.ALARM
    assert Reason.COVERAGE_LOW.value in bench.events[-1].text
    assert bench.frames(1).state.value == "suspended"
    bench.script.tracked = answer()
    assert bench.frames(1).state.value == "navigating"
    assert bench.shows_guides


def test_a_doubted_pose_keeps_navigating_without_guides(bench: Bench) -> None:
    navigating(bench)
    bench.script.tracked = DOUBTED
    assert bench.frames(1).state.value == "navigating"
    assert bench.snapshot.reasons == (Reason.TRE_TOO_LARGE,)
    assert not bench.shows_guides
    assert not bench.results[-1].is_navigable


def test_a_lost_answer_without_a_pose_is_survived(bench: Bench) -> None:
    navigating(bench)
    bench.script.tracked = answer(Status.LOST, Reason.OUT_OF_VIEW, has_pose=False)
    assert bench.frames(2).state.value == "suspended"
    assert bench.snapshot.left_from_bone is None
    assert not bench.shows_guides


# -- registration -------------------------------------------------------------------------------


@pytest.mark.parametrize("found", [[], [LOST], [LOST, LOST]])
def test_a_registration_that_finds_nothing_falls_back(bench: Bench, found) -> None:
    bench.script.found = found
    bench.frames(1)
    bench.do(Register())
    assert bench.frames(1).state.value == "ready"
    assert "registration failed" in bench.events[-1].text
    assert bench.events[-1].level is EventLevel.WARNING


def test_a_failed_registration_keeps_the_accepted_track(bench: Bench) -> None:
    navigating(bench)
    bench.script.found = []
    bench.do(Register())
    assert not bench.shows_guides
    assert bench.frames(1).state.value == "suspended"
    assert bench.frames(1).state.value == "navigating"


def test_a_running_registration_does_not_stop_the_pictures() -> None:
    with hanging_registration() as bench:
        before = len(bench.results)
        snapshot = bench.frames(5)
        assert len(bench.results) == before + 5
        assert snapshot.state.value == "registering"
        assert snapshot.progress.share == pytest.approx(0.5)
        assert not snapshot.is_navigable
        bench.script.gate.set()
        wait_for(lambda: bench.frames(1).state.value == "review", "the candidate")
        assert bench.script.calls.count("register femur") == 1


def test_a_worker_that_ends_between_two_frames_is_used_from_the_next_one() -> None:
    """Recorded and replayed alike: its pose is followed into the first frame that shows it."""

    class Late(InlineExecutor):
        """Has finished when it is asked for the third time."""

        n_asked = 0

        def take_due(self, job, sequence: int) -> bool:
            self.n_asked += 1
            return self.n_asked >= 3

    bench = Bench(executor=Late())
    bench.script.found = [answer(pose=a_pose(x_mm=7.0))]
    bench.frames(1)
    bench.do(Register())
    while bench.state != "review":
        bench.frames(1)
    first = next(r for r in bench.results if r.state.value == "review")
    assert first.frame.sequence == 3
    assert first.tracked.left_from_bone.translation_mm[0] == 0.0
    assert bench.take_overs == [3]


def test_a_bug_in_the_search_is_not_hidden(bench: Bench) -> None:
    bench.script.error = ZeroDivisionError("bug")
    bench.frames(1)
    bench.do(Register())
    with pytest.raises(ZeroDivisionError):
        bench.frames(1)


def test_without_a_prior_the_failure_says_what_is_missing() -> None:
    bench = Bench(prior=Prior())
    bench.script.found = []
    bench.frames(1)
    bench.do(Register())
    bench.frames(1)
    assert "nothing tells where the femur is: draw a box" in bench.events[-1].text


# -- the end ------------------------------------------------------------------------------------


def test_the_end_of_a_sequence_is_the_end(bench: Bench) -> None:
    bench.camera._n_frames = 2
    assert not bench.frames(2).is_over
    assert bench.frames(1).is_over
    assert bench.events[-1].kind == "end"


def test_closing_is_dark_offline_and_works_twice(bench: Bench) -> None:
    navigating(bench)
    bench.controller.close()
    bench.controller.close()
    assert bench.is_dark
    assert bench.state == "offline"
    assert not bench.snapshot.is_navigable
    assert not bench.camera.is_open


# -- never --------------------------------------------------------------------------------------

ACTIONS = st.lists(
    st.sampled_from(
        [
            *["frame"] * 8, "ok", "doubted", "lost", "nowhere", "late", "silent", "speaks",
            "unplug", "plug", Register(), Register(), Accept(None), Accept(None), Reject(None),
            Cancel(), Propose(a_pose(x_mm=2.0)), Blank(), Show(), Show(), ToggleDepth(),
            ToggleLayer("bone"), ToggleLayer("scale"), EnterStage(1),
            EnterStage(2), EnterStage(4), EnterStage(5), Reconnect(),
        ]
    ),
    min_size=5,
    max_size=40,
)  # fmt: skip

ANSWERS = {
    "ok": answer(),
    "doubted": DOUBTED,
    "lost": LOST,
    "nowhere": answer(Status.LOST, Reason.OUT_OF_VIEW, has_pose=False),
}


def act(bench: Bench, action) -> None:
    if not isinstance(action, str):
        bench.controller.submit(action)
    elif action in ANSWERS:
        bench.script.tracked = bench.script.assessed = ANSWERS[action]
    elif action == "late":
        bench.clock.advance_ns(9 * PERIOD_NS)
    elif action in ("silent", "speaks"):
        bench.camera.is_silent = action == "silent"
    elif action in ("unplug", "plug"):
        is_out = action == "unplug"
        bench.camera.error = DeviceLost("gone") if is_out else None
        bench.camera.opening_error = DeviceNotFound("gone") if is_out else None
    bench.controller.step()


@settings(
    max_examples=60, deadline=None, derandomize=True,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)  # fmt: skip
@given(actions=ACTIONS)
def test_guides_are_never_seen_when_they_must_not_be(actions) -> None:
    bench = Bench()
    for action in ["frame", Register(), "frame", Accept(None), "frame", *actions]:
        act(bench, action)
        snapshot = bench.snapshot
        assert snapshot.reasons == check_interlocks(snapshot)
        if bench.shows_guides:
            is_candidate = snapshot.state.value == "review" and not snapshot.is_blanked
            assert snapshot.is_navigable or is_candidate
        if snapshot.is_blanked:
            assert bench.is_dark
        if snapshot.is_navigable:
            assert snapshot.verdict.status is Status.OK
            assert snapshot.state.value == "navigating"
            assert snapshot.pose_age_ms <= 500.0
            assert not snapshot.is_camera_silent
    for result in bench.results:
        if result.is_navigable:
            assert result.state.value == "navigating"
            assert result.tracked.verdict.status is Status.OK
    bench.controller.close()
    assert bench.is_dark


def test_the_same_session_on_another_plan_knows_its_bones() -> None:
    bench = Bench(plan=replace(a_plan("tibia")))
    bench.frames(1)
    assert not bench.snapshot.is_bone_planned
    bench.do(EnterStage(5))
    assert bench.snapshot.is_bone_planned


# -- what must not outlive its reason -------------------------------------------------------------


def test_an_interruption_in_a_recording_forgets_what_the_camera_looked_at(bench: Bench) -> None:
    bench.frames(1)
    bench.do(Register())
    bench.frames(1)
    assert bench.do(Interrupt()).state.value == "ready"
    assert bench.controller.step().left_from_bone is None
    navigating(bench)
    assert bench.do(Interrupt()).state.value == "suspended"


def test_a_loss_of_the_camera_is_told_as_a_command_that_a_replay_can_give() -> None:
    told = []
    hooks = SessionHooks(on_command=(lambda command, sequence: told.append((command, sequence)),))
    bench = navigating(Bench(hooks=hooks))
    bench.camera.error = DeviceLost("unplugged")
    bench.frames(1)
    assert told[-1] == (Interrupt(), bench.snapshot.sequence)
    assert isinstance(bench.controller.lost_device, DeviceLost)
    bench.camera.error = None
    bench.frames(10)
    assert bench.controller.lost_device is None


def test_a_failed_registration_hands_out_the_judges_reasons(bench: Bench) -> None:
    bench.script.found = [LOST]
    bench.frames(1)
    bench.do(Register())
    bench.frames(1)
    assert bench.state == "ready"
    assert bench.results[-1].tracked.verdict.reasons == (Reason.COVERAGE_LOW,)
    assert not bench.shows_guides


def test_a_recording_that_stops_is_an_alarm_and_not_the_end() -> None:
    def stop(result) -> None:
        raise RecordingStopped("recording stopped: the disk is full")

    bench = Bench(hooks=SessionHooks(on_frame=(stop,)))
    bench.frames(2)
    assert bench.state == "ready"
    assert [e.level for e in bench.events if e.kind == "recording"] == [EventLevel.ALARM] * 2
