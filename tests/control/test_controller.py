from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from drivers.interfaces import PowerState
from drivers.no_projector import NoProjector
from navapp.control.controller import SessionOptions
from navapp.control.executors import InlineExecutor, ThreadExecutor
from navapp.control.interlocks import navigable
from navapp.control.recorder import RecordingStopped
from navapp.control.session import SessionHooks
from navapp.control.states import (
    Accept,
    Blank,
    Cancel,
    DeviceHealth,
    EnterStage,
    EventLevel,
    Interrupt,
    Propose,
    Quit,
    Reconnect,
    Register,
    Reject,
    Show,
)
from navapp.errors import DeviceLost, DeviceNotFound, DeviceTimeout, WrongDevice
from navapp.values import Prior, Reason, Status
from tests.control.fakes import PERIOD_NS, Bench, a_plan, a_pose, answer, wait_for


@pytest.fixture
def bench(monkeypatch) -> Bench:
    return Bench(monkeypatch)


def navigating(bench: Bench) -> Bench:
    bench.frames(1)
    bench.do(Register())
    bench.frames(1)
    bench.do(Accept())
    bench.frames(1)
    assert bench.state == "navigating"
    return bench


LOST = answer(Status.LOST, Reason.COVERAGE_LOW)
DOUBTED = answer(Status.DEGRADED, Reason.TRE_TOO_LARGE)


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
    assert bench.do(Accept()).state.value == "navigating"
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


def test_lost_candidates_are_never_offered(bench: Bench) -> None:
    bench.script.found = [LOST, answer(), LOST]
    bench.frames(1)
    bench.do(Register())
    bench.frames(1)
    assert "candidate 1 of 1" in bench.events[-1].text


def test_several_candidates_are_reviewed_one_after_the_other(bench: Bench) -> None:
    bench.script.found = [answer(pose=a_pose(x_mm=x)) for x in (0.0, 5.0, 9.0)]
    bench.frames(1)
    bench.do(Register())
    bench.frames(1)
    for number in (1, 2):
        assert bench.do(Reject()).state.value == "review"
        assert bench.events[-1].text.startswith(f"candidate {number} of 3 rejected")
        assert not bench.snapshot.is_candidate
        assert bench.frames(1).is_candidate
    assert bench.do(Reject()).state.value == "ready"
    assert bench.do(Accept()).state.value == "ready"
    assert "no candidate" in bench.refused()


def test_the_accepted_candidate_is_the_one_under_review(bench: Bench) -> None:
    bench.script.found = [answer(pose=a_pose(x_mm=x)) for x in (0.0, 5.0)]
    bench.frames(1)
    bench.do(Register())
    bench.frames(1)
    bench.do(Reject())
    bench.do(Accept())
    track = bench.controller._pursuit._tracks["femur"]
    assert track.left_from_bone.translation_mm[0] == 5.0


def test_a_candidate_that_was_lost_meanwhile_cannot_be_accepted(bench: Bench) -> None:
    bench.frames(1)
    bench.do(Register())
    bench.script.tracked = LOST
    bench.frames(2)
    assert bench.do(Accept()).state.value == "review"
    assert "lost" in bench.refused()


def test_a_rejected_candidate_leaves_the_screen_at_once(bench: Bench) -> None:
    bench.frames(1)
    bench.do(Register())
    bench.frames(1)
    assert bench.shows_guides
    bench.do(Reject())
    assert not bench.shows_guides


@pytest.mark.parametrize("command", [Accept(), Reject(), Cancel()])
def test_commands_out_of_place_are_refused_and_change_nothing(bench: Bench, command) -> None:
    bench.frames(1)
    assert bench.do(command).state.value == "ready"
    assert type(command).__name__.lower() in bench.refused()


def test_a_running_registration_does_not_stop_the_pictures(monkeypatch) -> None:
    import threading

    bench = Bench(monkeypatch, executor=ThreadExecutor())
    bench.script.gate = threading.Event()
    try:
        bench.frames(1)
        bench.do(Register())
        bench.frames(1)
        assert bench.script.started.wait(5.0)
        before = len(bench.results)
        snapshot = bench.frames(5)
        assert len(bench.results) == before + 5
        assert snapshot.state.value == "registering"
        assert snapshot.progress.share == pytest.approx(0.5)
        assert not snapshot.is_navigable
        bench.script.gate.set()
        wait_for(lambda: bench.frames(1).state.value == "review", "the candidate")
        assert bench.script.calls.count("register femur") == 1
    finally:
        bench.script.gate.set()
        bench.controller.close()


def test_a_worker_that_ends_between_two_frames_is_used_from_the_next_one(monkeypatch) -> None:
    """Recorded and replayed alike: its pose is followed into the first frame that shows it."""

    class Late(InlineExecutor):
        """Has finished when it is asked for the third time."""

        n_asked = 0

        def take_due(self, job, sequence: int) -> bool:
            self.n_asked += 1
            return self.n_asked >= 3

    bench = Bench(monkeypatch, executor=Late())
    bench.script.found = [answer(pose=a_pose(x_mm=7.0))]
    bench.frames(1)
    bench.do(Register())
    while bench.state != "review":
        bench.frames(1)
    first = next(r for r in bench.results if r.state.value == "review")
    assert first.frame.sequence == 3
    assert first.tracked.left_from_bone.translation_mm[0] == 0.0
    assert bench.take_overs == [3]


def test_a_registration_can_be_cancelled_while_it_hangs(monkeypatch) -> None:
    import threading

    bench = Bench(monkeypatch, executor=ThreadExecutor())
    bench.script.gate = threading.Event()
    try:
        bench.frames(1)
        bench.do(Register())
        bench.frames(1)
        assert bench.script.started.wait(5.0)
        assert bench.do(Cancel()).state.value == "ready"
        assert bench.snapshot.progress is None
        bench.script.gate.set()
        assert bench.frames(5).state.value == "ready"
        assert bench.take_overs == []
        bench.script.gate = None
        bench.do(Register())
        wait_for(lambda: bench.frames(1).state.value == "review", "the second try")
    finally:
        if bench.script.gate is not None:
            bench.script.gate.set()
        bench.controller.close()


def test_a_bug_in_the_search_is_not_hidden(bench: Bench) -> None:
    bench.script.error = ZeroDivisionError("bug")
    bench.frames(1)
    bench.do(Register())
    with pytest.raises(ZeroDivisionError):
        bench.frames(1)


def test_without_a_prior_the_failure_says_what_is_missing(monkeypatch) -> None:
    bench = Bench(monkeypatch)
    bench.script.found = []
    bench.controller._pursuit._prior = Prior()
    bench.frames(1)
    bench.do(Register())
    bench.frames(1)
    assert "no start pose is known for the femur" in bench.events[-1].text


# -- proposed poses -----------------------------------------------------------------------------


def test_a_proposed_pose_is_judged_as_it_stands(bench: Bench) -> None:
    bench.frames(1)
    pose = a_pose(x_mm=4.0)
    assert bench.do(Propose(pose)).state.value == "review"
    bench.frames(2)
    assert bench.script.calls == ["assess femur", "assess femur"]
    np.testing.assert_array_equal(bench.snapshot.left_from_bone.matrix, pose.matrix)
    bench.do(Accept())
    bench.frames(1)
    assert bench.state == "navigating"
    assert bench.script.calls[-1] == "track femur"


def test_a_proposed_pose_cannot_be_accepted_before_it_is_judged(bench: Bench) -> None:
    bench.frames(1)
    bench.do(Propose(a_pose()))
    assert bench.do(Accept()).state.value == "review"
    assert "lost" in bench.refused()


def test_a_proposed_pose_that_is_lost_cannot_be_accepted(bench: Bench) -> None:
    bench.script.assessed = LOST
    bench.frames(1)
    bench.do(Propose(a_pose(turn_deg=15.0)))
    bench.frames(1)
    assert bench.do(Accept()).state.value == "review"
    assert not bench.snapshot.is_navigable


# -- blank --------------------------------------------------------------------------------------


def test_blank_is_black_at_once_and_until_show(bench: Bench) -> None:
    navigating(bench)
    bench.controller.submit(Blank())
    assert bench.is_dark
    bench.frames(4)
    assert bench.is_dark
    assert bench.snapshot.is_blanked
    assert Reason.BLANKED in bench.snapshot.reasons
    assert not bench.results[-1].is_navigable
    bench.do(Show())
    assert bench.is_dark
    bench.frames(1)
    assert bench.shows_guides


def test_blank_works_while_the_pipeline_hangs_in_a_frame(bench: Bench) -> None:
    import threading

    navigating(bench)
    inside, release = threading.Event(), threading.Event()
    track = type(bench.controller._pursuit._lines["femur"]).track

    def hanging(self, *arguments):
        inside.set()
        release.wait(10.0)
        return track(self, *arguments)

    line = bench.controller._pursuit._lines["femur"]
    line.track = hanging.__get__(line)
    thread = threading.Thread(target=bench.controller.step)
    thread.start()
    assert inside.wait(5.0)
    assert bench.shows_guides
    bench.controller.submit(Blank())
    assert bench.is_dark
    release.set()
    thread.join(10.0)
    assert bench.is_dark
    bench.frames(3)
    assert bench.is_dark


def test_blank_while_the_picture_is_on_its_way_wins(bench: Bench) -> None:
    navigating(bench)
    show = bench.display.show

    def late(image, valid_until_ns):
        bench.controller.submit(Blank())
        show(image, valid_until_ns)

    bench.display.show = late
    bench.frames(1)
    assert bench.is_dark


# -- stages -------------------------------------------------------------------------------------


def test_another_stage_of_the_same_bone_goes_on(bench: Bench) -> None:
    navigating(bench)
    assert bench.do(EnterStage(2)).stage.name == "drilling"
    assert bench.frames(1).state.value == "navigating"
    assert bench.results[-1].stage.name == "drilling"


def test_another_bone_must_be_registered_and_the_first_is_kept(bench: Bench) -> None:
    navigating(bench)
    snapshot = bench.do(EnterStage(5))
    assert snapshot.state.value == "ready"
    assert not bench.shows_guides
    assert bench.do(EnterStage(1)).state.value == "suspended"
    assert bench.frames(1).state.value == "navigating"


def test_a_stage_whose_bone_is_not_planned_shows_and_looks_for_nothing(bench: Bench) -> None:
    navigating(bench)
    snapshot = bench.do(EnterStage(4))
    assert snapshot.state.value == "ready"
    assert Reason.STAGE_WITHOUT_BONE in snapshot.reasons
    assert not bench.shows_guides
    calls = len(bench.script.calls)
    for command in (Register(), Propose(a_pose("patella"))):
        assert bench.do(command).state.value == "ready"
        assert "no model of the patella" in bench.refused()
    bench.frames(2)
    assert len(bench.script.calls) == calls


def test_changing_the_bone_during_a_review_drops_the_candidate(bench: Bench) -> None:
    bench.frames(1)
    bench.do(Register())
    bench.frames(1)
    assert bench.do(EnterStage(5)).state.value == "ready"
    bench.do(Accept())
    assert "no candidate" in bench.refused()


@pytest.mark.parametrize("number", [0, 6, -1])
def test_a_stage_that_does_not_exist_is_refused(bench: Bench, number: int) -> None:
    bench.frames(1)
    assert bench.do(EnterStage(number)).stage.number == 1
    assert "stage" in bench.refused()


def test_the_room_is_told_of_stages_and_may_not_know_one(monkeypatch) -> None:
    from navapp.control.controller import SessionHooks
    from navapp.errors import UsageError

    told: list[str] = []

    def tell(name: str) -> None:
        told.append(name)
        if name == "implant":
            raise UsageError("the simulator shows no stage 'implant'")

    bench = Bench(monkeypatch, hooks=SessionHooks(on_stage=(tell,)))
    bench.frames(1)
    assert bench.do(EnterStage(3)).stage.name == "implant"
    assert told == ["opening", "implant"]
    assert any("shows no stage" in event.text for event in bench.events)


# -- devices ------------------------------------------------------------------------------------


def test_a_lost_camera_is_a_fault_and_dark_and_it_comes_back_suspended(bench: Bench) -> None:
    navigating(bench)
    bench.camera.error = DeviceLost("the camera was unplugged")
    snapshot = bench.frames(1)
    assert snapshot.state.value == "fault"
    assert snapshot.reasons[0] is Reason.DEVICE_FAULT
    assert bench.is_dark
    assert not snapshot.is_over
    assert snapshot.devices[0].health is DeviceHealth.LOST
    bench.camera.opening_error = DeviceNotFound("still unplugged")
    for _ in range(20):
        assert bench.frames(1).state.value == "fault"
    assert "still unplugged" in bench.snapshot.devices[0].detail
    bench.camera.error = bench.camera.opening_error = None
    for _ in range(10):
        if bench.frames(1).state.value == "suspended":
            break
    assert bench.state == "suspended"
    assert bench.frames(1).state.value == "navigating"
    assert bench.shows_guides
    assert bench.snapshot.devices[0].health is DeviceHealth.OK


def test_a_camera_lost_before_a_registration_comes_back_ready(bench: Bench) -> None:
    bench.frames(1)
    bench.do(Register())
    bench.camera.error = DeviceLost("gone")
    bench.frames(1)
    assert bench.do(Register()).state.value == "fault"
    assert "camera is lost" in bench.refused()
    bench.camera.error = None
    bench.do(Reconnect())
    assert bench.frames(1).state.value == "ready"


def test_another_camera_is_not_taken_for_the_calibrated_one(bench: Bench) -> None:
    navigating(bench)
    bench.camera.error = DeviceLost("gone")
    bench.frames(1)
    bench.camera.opening_error = WrongDevice("serial numbers differ")
    bench.do(Reconnect())
    for _ in range(15):
        assert bench.frames(1).state.value == "fault"
    assert bench.is_dark
    assert "serial numbers differ" in bench.snapshot.devices[0].detail


def test_attempts_to_reopen_pause_for_a_second(bench: Bench) -> None:
    attempts = []
    bench.frames(1)
    bench.camera.error = DeviceLost("gone")
    bench.frames(1)

    def refuse() -> None:
        attempts.append(bench.clock.now_ns())
        raise DeviceNotFound("no")

    bench.camera.open = refuse
    start_ns = bench.clock.now_ns()
    while bench.clock.now_ns() < start_ns + 5 * 10**9:
        bench.frames(1)
    assert 4 <= len(attempts) <= 5
    assert min(np.diff(attempts)) >= 10**9


def test_a_camera_that_nobody_can_reopen_ends_the_session(monkeypatch) -> None:
    bench = Bench(monkeypatch, can_reopen=False)
    bench.frames(1)
    bench.camera.error = DeviceLost("gone")
    assert bench.frames(1).is_over


def test_a_silent_camera_turns_everything_dark(bench: Bench) -> None:
    navigating(bench)
    bench.camera.is_silent = True
    for _ in range(8):
        bench.controller.step(0.2)
    assert bench.is_dark
    assert Reason.CAMERA_SILENT in bench.snapshot.reasons
    assert Reason.POSE_TOO_OLD in bench.snapshot.reasons
    bench.camera.is_silent = False
    assert bench.frames(1).is_navigable


def test_guides_leave_the_display_when_their_pose_is_too_old(monkeypatch) -> None:
    """However long a picture is said to stay valid."""
    bench = navigating(Bench(monkeypatch, options=SessionOptions(overlay_valid_ms=60_000.0)))
    bench.camera.is_silent = True
    bench.controller.step(0.3)
    assert bench.shows_guides
    bench.controller.step(0.3)
    assert Reason.POSE_TOO_OLD in bench.snapshot.reasons
    assert not bench.shows_guides


def test_a_picture_is_dark_when_its_time_is_over(bench: Bench) -> None:
    navigating(bench)
    valid_ns = bench.results[-1].picture.valid_until_ns
    assert valid_ns == bench.results[-1].frame.captured_ns + 500_000_000
    bench.clock.wait_until_ns(valid_ns - 1)
    assert bench.shows_guides
    bench.clock.wait_until_ns(valid_ns)
    assert bench.is_dark


def test_a_failing_display_does_not_stop_the_line(bench: Bench) -> None:
    navigating(bench)
    show = bench.display.show

    def fail(image, valid_until_ns):
        raise DeviceLost("the display is gone")

    bench.display.show = fail
    bench.frames(3)
    assert bench.results[-1].frame.sequence == bench.snapshot.sequence
    assert bench.snapshot.devices[1].health is DeviceHealth.TROUBLE
    assert sum("display is gone" in event.text for event in bench.events) == 1
    bench.display.show = show
    bench.frames(1)
    assert bench.snapshot.devices[1].health is DeviceHealth.OK
    assert bench.shows_guides


class BrokenProjector(NoProjector):
    """Says nothing when asked."""

    def status(self):
        raise DeviceTimeout("the projector does not answer")


def test_a_projector_that_does_not_answer_is_told_and_stops_nothing(monkeypatch) -> None:
    bench = Bench(monkeypatch, projector=BrokenProjector())
    navigating(bench)
    line = next(line for line in bench.snapshot.devices if line.kind == "projector")
    assert line.health is DeviceHealth.LOST
    assert "does not answer" in line.detail
    assert NoProjector().status().power is PowerState.ABSENT


def test_a_mirror_that_does_not_answer_is_told_and_stops_nothing(monkeypatch) -> None:
    from drivers.fixed_mirror import FixedMirror

    class Broken(FixedMirror):
        def position_deg(self) -> float:
            raise DeviceLost("the mirror's cable is out")

    bench = Bench(monkeypatch, mirror=Broken(45.0))
    navigating(bench)
    line = next(line for line in bench.snapshot.devices if line.kind == "mirror")
    assert line.health is DeviceHealth.LOST
    assert "cable is out" in line.detail


# -- the end ------------------------------------------------------------------------------------


def test_quit_is_dark_and_over(bench: Bench) -> None:
    navigating(bench)
    assert bench.do(Quit()).is_over
    assert bench.is_dark


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


def test_commands_are_told_before_they_act_with_their_frame(monkeypatch) -> None:
    told: list[tuple[str, int]] = []
    hooks = SessionHooks(on_command=(lambda c, s: told.append((type(c).__name__, s)),))
    bench = Bench(monkeypatch, hooks=hooks)
    bench.do(Show())
    bench.frames(2)
    bench.do(Register())
    assert told == [("Show", -1), ("Register", 1)]


# -- never --------------------------------------------------------------------------------------

ACTIONS = st.lists(
    st.sampled_from(
        [
            *["frame"] * 8, "ok", "doubted", "lost", "nowhere", "late", "silent", "speaks",
            "unplug", "plug", Register(), Register(), Accept(), Accept(), Reject(), Cancel(),
            Propose(a_pose(x_mm=2.0)), Blank(), Show(), Show(), EnterStage(1), EnterStage(2),
            EnterStage(4), EnterStage(5), Reconnect(),
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
def test_guides_are_never_seen_when_they_must_not_be(monkeypatch, actions) -> None:
    bench = Bench(monkeypatch)
    for action in ["frame", Register(), "frame", Accept(), "frame", *actions]:
        act(bench, action)
        snapshot = bench.snapshot
        assert snapshot.reasons == navigable(snapshot)
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


def test_the_same_session_on_another_plan_knows_its_bones(monkeypatch) -> None:
    bench = Bench(monkeypatch, plan=replace(a_plan("tibia")))
    bench.frames(1)
    assert not bench.snapshot.is_bone_planned
    bench.do(EnterStage(5))
    assert bench.snapshot.is_bone_planned


# -- what must not outlive its reason -------------------------------------------------------------


def test_a_new_stage_does_not_inherit_the_old_stages_verdict(bench: Bench) -> None:
    navigating(bench)
    after = bench.do(EnterStage(2))
    assert not after.is_navigable
    assert not bench.shows_guides
    assert bench.frames(1).is_navigable


def test_a_candidate_judged_in_another_stage_cannot_be_accepted(bench: Bench) -> None:
    bench.frames(1)
    bench.do(Register())
    bench.frames(1)
    bench.do(EnterStage(2))
    assert bench.do(Accept()).state.value == "review"
    assert "lost" in bench.refused()
    bench.frames(1)
    assert bench.do(Accept()).state.value == "navigating"


def test_an_interruption_in_a_recording_forgets_what_the_camera_looked_at(bench: Bench) -> None:
    bench.frames(1)
    bench.do(Register())
    bench.frames(1)
    assert bench.do(Interrupt()).state.value == "ready"
    assert bench.controller.step().left_from_bone is None
    navigating(bench)
    assert bench.do(Interrupt()).state.value == "suspended"


def test_a_loss_of_the_camera_is_told_as_a_command_that_a_replay_can_give(monkeypatch) -> None:
    told = []
    hooks = SessionHooks(on_command=(lambda command, sequence: told.append((command, sequence)),))
    bench = navigating(Bench(monkeypatch, hooks=hooks))
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


def test_a_recording_that_stops_is_an_alarm_and_not_the_end(monkeypatch) -> None:
    def stop(result) -> None:
        raise RecordingStopped("recording stopped: the disk is full")

    bench = Bench(monkeypatch)
    bench.controller._session.hooks = replace(bench.controller._session.hooks, on_frame=(stop,))
    bench.frames(2)
    assert bench.state == "ready"
    assert [e.level for e in bench.events if e.kind == "recording"] == [EventLevel.ALARM] * 2
