"""What the operator's commands do."""

import numpy as np
import pytest

from navapp.control.commands import (
    Accept,
    Blank,
    Cancel,
    EnterStage,
    Propose,
    Quit,
    Register,
    Reject,
    Show,
)
from navapp.control.event_log import SessionHooks
from navapp.values import Reason
from tests.control.fakes import (
    LOST,
    Bench,
    a_pose,
    answer,
    hanging_registration,
    navigating,
    wait_for,
)


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
        assert bench.reject().state.value == "review"
        assert bench.events[-1].text.startswith(f"candidate {number} of 3 rejected")
        assert not bench.snapshot.is_candidate
        assert bench.frames(1).is_candidate
    assert bench.reject().state.value == "ready"
    assert bench.accept().state.value == "ready"
    assert "no candidate" in bench.refused()


def test_a_decision_that_crosses_with_a_new_candidate_is_refused(bench: Bench) -> None:
    """The operator presses the key while the next candidate is already under review."""
    bench.script.found = [answer(pose=a_pose(x_mm=x)) for x in (0.0, 5.0)]
    bench.frames(1)
    bench.do(Register())
    seen = bench.frames(1).candidate_id
    bench.do(Reject(seen))
    for decision in (Accept(seen), Reject(seen)):
        assert bench.do(decision).state.value == "review"
        assert "another candidate is under review now" in bench.refused()
    other = bench.frames(1).candidate_id
    assert other not in (None, seen)
    assert bench.do(Accept(seen)).state.value == "review"
    assert bench.do(Accept(other)).state.value == "navigating"


@pytest.mark.parametrize("next_step", [Register(), Propose(a_pose(x_mm=9.0))], ids=str)
def test_a_decision_of_an_earlier_search_is_refused(bench: Bench, next_step) -> None:
    bench.frames(1)
    bench.do(Register())
    seen = bench.frames(1).candidate_id
    bench.do(next_step)
    bench.frames(1)
    assert bench.do(Accept(seen)).state.value == "review"
    assert "another candidate" in bench.refused()
    assert bench.do(Accept(bench.snapshot.candidate_id)).state.value == "navigating"
    assert bench.snapshot.candidate_id is None


def test_the_candidate_keeps_its_identity_from_frame_to_frame(bench: Bench) -> None:
    bench.frames(1)
    bench.do(Register())
    seen = {bench.frames(1).candidate_id for _ in range(4)}
    assert len(seen) == 1
    assert None not in seen


def test_the_accepted_candidate_is_the_one_under_review(bench: Bench) -> None:
    bench.script.found = [answer(pose=a_pose(x_mm=x)) for x in (0.0, 5.0)]
    bench.frames(1)
    bench.do(Register())
    bench.frames(1)
    bench.reject()
    bench.accept()
    bench.frames(1)
    _, track, _ = bench.script.tracks[-1]
    assert track.left_from_bone.translation_mm[0] == 5.0


def test_a_candidate_that_was_lost_meanwhile_cannot_be_accepted(bench: Bench) -> None:
    bench.frames(1)
    bench.do(Register())
    bench.script.tracked = LOST
    bench.frames(2)
    assert bench.accept().state.value == "review"
    assert "lost" in bench.refused()


def test_a_rejected_candidate_leaves_the_screen_at_once(bench: Bench) -> None:
    bench.frames(1)
    bench.do(Register())
    bench.frames(1)
    assert bench.shows_guides
    bench.reject()
    assert not bench.shows_guides


@pytest.mark.parametrize("command", [Accept(None), Reject(None), Cancel()])
def test_commands_out_of_place_are_refused_and_change_nothing(bench: Bench, command) -> None:
    bench.frames(1)
    assert bench.do(command).state.value == "ready"
    assert type(command).__name__.lower() in bench.refused()


def test_a_registration_can_be_cancelled_while_it_hangs() -> None:
    with hanging_registration() as bench:
        assert bench.do(Cancel()).state.value == "ready"
        assert bench.snapshot.progress is None
        bench.script.gate.set()
        assert bench.frames(5).state.value == "ready"
        assert bench.take_overs == []
        bench.script.gate = None
        bench.do(Register())
        wait_for(lambda: bench.frames(1).state.value == "review", "the second try")


def test_a_proposed_pose_is_judged_as_it_stands(bench: Bench) -> None:
    bench.frames(1)
    pose = a_pose(x_mm=4.0)
    assert bench.do(Propose(pose)).state.value == "review"
    bench.frames(2)
    assert bench.script.calls == ["assess femur", "assess femur"]
    np.testing.assert_array_equal(bench.snapshot.left_from_bone.matrix, pose.matrix)
    bench.accept()
    bench.frames(1)
    assert bench.state == "navigating"
    assert bench.script.calls[-1] == "track femur"


def test_a_proposed_pose_cannot_be_accepted_before_it_is_judged(bench: Bench) -> None:
    bench.frames(1)
    bench.do(Propose(a_pose()))
    assert bench.accept().state.value == "review"
    assert "not on the screen yet" in bench.refused()


def test_a_proposed_pose_that_is_lost_cannot_be_accepted(bench: Bench) -> None:
    bench.script.assessed = LOST
    bench.frames(1)
    bench.do(Propose(a_pose(turn_deg=15.0)))
    bench.frames(1)
    assert bench.accept().state.value == "review"
    assert not bench.snapshot.is_navigable


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

    def hanging(*arguments):
        inside.set()
        release.wait(10.0)
        return track(*arguments)

    tracker = bench.trackers["femur"]
    track, tracker.track = tracker.track, hanging
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
    assert not any("patella" in call for call in bench.script.calls[calls:])


def test_changing_the_bone_during_a_review_drops_the_candidate(bench: Bench) -> None:
    bench.frames(1)
    bench.do(Register())
    bench.frames(1)
    assert bench.do(EnterStage(5)).state.value == "ready"
    bench.accept()
    assert "no candidate" in bench.refused()


@pytest.mark.parametrize("number", [0, 6, -1])
def test_a_stage_that_does_not_exist_is_refused(bench: Bench, number: int) -> None:
    bench.frames(1)
    assert bench.do(EnterStage(number)).stage.number == 1
    assert "stage" in bench.refused()


def test_the_room_is_told_of_stages_and_may_not_know_one() -> None:
    from navapp.control.event_log import SessionHooks
    from navapp.errors import UsageError

    told: list[str] = []

    def tell(name: str) -> None:
        told.append(name)
        if name == "implant":
            raise UsageError("the simulator shows no stage 'implant'")

    bench = Bench(hooks=SessionHooks(on_stage=(tell,)))
    bench.frames(1)
    assert bench.do(EnterStage(3)).stage.name == "implant"
    assert told == ["opening", "implant"]
    assert any("shows no stage" in event.text for event in bench.events)


def test_quit_is_dark_and_over(bench: Bench) -> None:
    navigating(bench)
    assert bench.do(Quit()).is_over
    assert bench.is_dark


def test_commands_are_told_before_they_act_with_their_frame() -> None:
    told: list[tuple[str, int]] = []
    hooks = SessionHooks(on_command=(lambda c, s: told.append((type(c).__name__, s)),))
    bench = Bench(hooks=hooks)
    bench.do(Show())
    bench.frames(2)
    bench.do(Register())
    assert told == [("Show", -1), ("Register", 1)]


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
    assert bench.accept().state.value == "review"
    assert "not on the screen yet" in bench.refused()
    bench.frames(1)
    assert bench.accept().state.value == "navigating"
