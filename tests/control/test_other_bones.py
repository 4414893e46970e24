"""The other bones than the stage's: whose turn it is, and what is said of them."""

from itertools import pairwise

import pytest

from navapp.control.commands import (
    DistrustRig,
    EnterStage,
    Register,
)
from navapp.control.interlocks import is_current
from navapp.control.states import OtherBone
from navapp.errors import DeviceLost
from navapp.values import Reason, Status
from tests.control.fakes import LOST, PERIOD_NS, Bench, a_plan, a_pose, answer, navigating

STAGE_OF = {"femur": 1, "patella": 4, "tibia": 5}
FOUND = {name: answer(pose=a_pose(name)) for name in STAGE_OF}
LOST_OF = {name: answer(Status.LOST, Reason.COVERAGE_LOW, pose=a_pose(name)) for name in STAGE_OF}


def accepted(bench: Bench, *bones: str) -> Bench:
    """Each registered and accepted in its stage; the last one's stage stays."""
    bench.script.tracked_of = dict(FOUND)
    bench.frames(1)
    for bone in bones:
        bench.do(EnterStage(STAGE_OF[bone]))
        bench.script.found = [FOUND[bone]]
        bench.do(Register())
        bench.frames(1)
        bench.accept()
    bench.frames(1)
    assert bench.state == "navigating"
    assert bench.snapshot.stage.bone == bones[-1]
    return bench


def turns(bench: Bench, n_frames: int) -> list[str]:
    """Which other bone was followed in each of the next frames."""
    before = len(bench.results)
    bench.frames(n_frames)
    return [" ".join(result.others) for result in bench.results[before:]]


def other(bench: Bench) -> OtherBone:
    (one,) = bench.snapshot.others
    return one


def test_an_accepted_bone_is_followed_in_every_second_frame_of_anothers_stage(bench: Bench) -> None:
    accepted(bench, "femur", "tibia")
    seen = turns(bench, 8)
    assert sorted(seen) == [""] * 4 + ["femur"] * 4
    assert all(a != b for a, b in pairwise(seen))
    assert all(result.tracked is FOUND["tibia"] for result in bench.results[-8:])
    assert [r.others["femur"] for r in bench.results[-8:] if r.others] == [FOUND["femur"]] * 4


def test_two_others_take_turns_and_never_share_a_frame() -> None:
    bench = accepted(Bench(plan=a_plan(*STAGE_OF)), "femur", "patella", "tibia")
    seen = turns(bench, 16)
    assert sorted(seen) == [""] * 8 + ["femur"] * 4 + ["patella"] * 4
    for name in ("femur", "patella"):
        places = [number for number, said in enumerate(seen) if said == name]
        assert [b - a for a, b in pairwise(places)] == [4, 4, 4]


def test_turns_are_counted_in_frames_whatever_the_time_and_the_number() -> None:
    quick = turns(accepted(Bench(), "femur", "tibia"), 6)
    slow = accepted(Bench(), "femur", "tibia")
    seen = []
    for number in range(6):
        slow.clock.advance_ns(number * 17 * PERIOD_NS)
        slow.camera._sequence += 2 * number + 1
        seen += turns(slow, 1)
    assert seen == quick


def test_a_bone_that_was_not_accepted_is_not_followed(bench: Bench) -> None:
    navigating(bench)
    bench.do(EnterStage(5))
    bench.do(Register())
    bench.frames(1)
    assert bench.state == "review"
    bench.do(EnterStage(1))
    assert turns(bench, 4) == [""] * 4
    assert bench.snapshot.others == ()


def test_an_other_is_followed_while_the_stages_bone_is_looked_for(bench: Bench) -> None:
    navigating(bench)
    bench.do(EnterStage(5))
    assert bench.state == "ready"
    assert sorted(turns(bench, 2)) == ["", "femur"]
    bench.script.found = [FOUND["tibia"]]
    bench.do(Register())
    assert turns(bench, 2).count("femur") == 1
    assert bench.state == "review"


def test_each_is_judged_by_the_first_stage_that_follows_it(bench: Bench) -> None:
    accepted(bench, "femur", "tibia")
    bench.frames(2)
    goals = {bone: goal for bone, _, goal in bench.script.tracks[-3:]}
    assert goals["femur"].tolerance_mm == 2.0
    assert goals["tibia"].tolerance_mm == 1.0


def test_the_active_bones_picture_does_not_wait_for_another(bench: Bench) -> None:
    accepted(bench, "femur", "tibia")
    bench.script.on_track = lambda bone: bench.clock.advance_ns(5_000_000)
    assert sorted(turns(bench, 2)) == ["", "femur"]
    # Its own time is in it, so that this can fail.
    assert [result.picture.pose_age_ns for result in bench.results[-2:]] == [5_000_000] * 2


def test_a_bone_whose_stage_returns_goes_on_from_a_fresh_track(bench: Bench) -> None:
    accepted(bench, "femur", "tibia")
    bench.script.tracked_of["femur"] = answer(pose=a_pose(x_mm=4.0))
    bench.frames(30)
    bench.do(EnterStage(1))
    bench.frames(1)
    assert bench.results[-1].tracked is bench.script.tracked_of["femur"]
    _, state, goal = next(track for track in reversed(bench.script.tracks) if track[0] == "femur")
    assert (goal.tolerance_mm, bench.state) == (2.0, "navigating")
    assert state.left_from_bone.translation_mm[0] == 4.0
    assert bench.results[-1].frame.captured_ns - state.captured_ns <= 2 * PERIOD_NS
    assert [one.name for one in bench.snapshot.others] == ["tibia"]


def expected_x_mm(bench: Bench, *moves_mm: float, active: Status = Status.OK) -> list[float]:
    """Where the femur, never seen to move, is expected while the active tibia is at places."""
    first = len(bench.script.tracks)
    for x_mm in moves_mm:
        pose = a_pose("tibia", x_mm=x_mm)
        bench.script.tracked_of["tibia"] = answer(active, pose=pose)
        bench.frames(2)
    said = [track for track in bench.script.tracks[first:] if track[0] == "femur"]
    places = [state.expected or state.left_from_bone for _, state, _ in said]
    return [place.translation_mm[0] for place in places]


def test_an_other_is_expected_to_have_gone_with_the_active_bone(bench: Bench) -> None:
    accepted(bench, "femur", "tibia")
    bench.frames(2)
    assert expected_x_mm(bench, 3.0, 3.0, 7.0, 6.0) == pytest.approx([3.0, 0.0, 4.0, -1.0])


def test_a_lost_other_goes_along_until_it_is_found(bench: Bench) -> None:
    accepted(bench, "femur", "tibia")
    bench.frames(2)
    bench.script.tracked_of["femur"] = LOST_OF["femur"]
    assert expected_x_mm(bench, 3.0, 5.0, 9.0) == pytest.approx([3.0, 5.0, 9.0])


def test_with_an_active_bone_in_doubt_nothing_is_said_to_have_moved(bench: Bench) -> None:
    accepted(bench, "femur", "tibia")
    bench.frames(2)
    doubted = expected_x_mm(bench, 3.0, 9.0, active=Status.DEGRADED)
    assert doubted == [0.0, 0.0]
    # Nor by what it does until it is known again.
    assert expected_x_mm(bench, 12.0, 14.0) == pytest.approx([0.0, 2.0])


def test_from_one_candidate_to_the_next_nothing_has_moved(bench: Bench) -> None:
    navigating(bench)
    bench.do(EnterStage(5))
    bench.script.found = [FOUND["tibia"]] * 2
    bench.do(Register())
    bench.script.tracked_of = dict(FOUND)
    bench.frames(2)
    assert expected_x_mm(bench, 2.0) == pytest.approx([2.0])
    bench.reject()
    assert bench.state == "review"
    assert expected_x_mm(bench, 30.0) == pytest.approx([0.0])
    bench.accept()
    # What was accepted is the candidate that was followed until then.
    assert expected_x_mm(bench, 31.0) == pytest.approx([1.0])


def test_a_new_registration_of_the_active_bone_moves_nothing(bench: Bench) -> None:
    accepted(bench, "femur", "tibia")
    # The other's turns are the frames between which all of this happens.
    while turns(bench, 1) != ["femur"]:
        pass
    bench.script.found = [answer(pose=a_pose("tibia", x_mm=20.0))]
    bench.do(Register())
    bench.frames(1)
    bench.accept()
    assert expected_x_mm(bench, 20.0, 21.0) == pytest.approx([0.0, 1.0])


def test_a_lost_other_disturbs_nothing_and_says_since_when(bench: Bench) -> None:
    accepted(bench, "femur", "tibia")
    bench.frames(2)
    assert is_current(other(bench))
    bench.script.tracked_of["femur"] = LOST_OF["femur"]
    bench.frames(2)
    lost = other(bench)
    assert lost.verdict.status is Status.LOST
    assert not is_current(lost)
    assert lost.age_ms >= 2 * PERIOD_NS / 1e6
    assert bench.state == "navigating"
    assert bench.shows_guides
    bench.frames(2)
    assert other(bench).age_ms == pytest.approx(lost.age_ms + 2 * PERIOD_NS / 1e6)
    bench.script.tracked_of["femur"] = FOUND["femur"]
    bench.frames(4)
    assert is_current(other(bench))


def test_a_found_other_does_not_make_a_lost_bone_navigable(bench: Bench) -> None:
    accepted(bench, "femur", "tibia")
    bench.script.tracked_of["tibia"] = LOST_OF["tibia"]
    bench.frames(2)
    assert is_current(other(bench))
    assert bench.state == "suspended"
    assert not bench.shows_guides
    assert bench.snapshot.left_from_bone.source == "tibia"


@pytest.mark.parametrize("active", ["OK", "DEGRADED", "LOST"])
def test_the_active_bone_is_never_kept_waiting_by_a_search_for_another(bench, active) -> None:
    accepted(bench, "femur", "tibia")
    bench.script.tracked_of["femur"] = LOST_OF["femur"]
    bench.script.tracked_of["tibia"] = answer(Status[active], pose=a_pose("tibia"))
    first = len(bench.script.calls)
    bench.frames(6)
    said = bench.script.calls[first:]
    assert sorted(said) == ["glance at femur"] * 3 + ["track tibia"] * 6


def test_who_stays_lost_keeps_its_turns_and_is_searched_in_its_stage(bench: Bench) -> None:
    accepted(bench, "femur", "tibia")
    bench.script.tracked_of["femur"] = LOST_OF["femur"]
    assert turns(bench, 40).count("femur") == 20
    bench.do(EnterStage(1))
    bench.frames(1)
    assert "track femur" in bench.script.calls[-2:]


def test_a_bone_that_is_only_loosely_fixed_keeps_its_turns(bench: Bench) -> None:
    accepted(bench, "femur", "tibia")
    loose = answer(Status.DEGRADED, Reason.TRE_TOO_LARGE)
    bench.script.tracked_of["femur"] = loose
    assert turns(bench, 12).count("femur") == 6
    assert not is_current(other(bench))


def test_the_loss_of_the_camera_is_the_end_of_what_was_said(bench: Bench) -> None:
    accepted(bench, "femur", "tibia")
    bench.frames(2)
    bench.camera.error = DeviceLost("unplugged")
    bench.frames(1)
    assert other(bench) == OtherBone("femur")
    bench.camera.error = None
    bench.frames(12)
    assert is_current(other(bench))


def test_with_a_rig_that_moved_nothing_is_said_of_any_bone(bench: Bench) -> None:
    accepted(bench, "femur", "tibia")
    bench.frames(2)
    assert is_current(other(bench))
    bench.do(DistrustRig("a test"))
    asked = len(bench.script.calls)
    assert turns(bench, 4) == [""] * 4
    assert bench.state == "fault"
    assert bench.script.calls[asked:] == []
    assert other(bench) == OtherBone("femur")


def test_a_bone_asked_for_is_not_registered_with_a_rig_that_moved() -> None:
    bench = replayed([FOUND["tibia"]])
    bench.do(DistrustRig("a test"))
    assert turns(bench, 4) == [""] * 4
    assert bench.script.calls == []


# -- bones that a replay asks for ------------------------------------------------------------------


def replayed(found) -> Bench:
    bench = Bench(others=("tibia",))
    bench.script.found = found
    bench.script.tracked_of = {**FOUND}
    return bench


def test_a_bone_asked_for_is_registered_in_its_turn_and_followed_without_a_word() -> None:
    bench = replayed([FOUND["tibia"], LOST])
    assert turns(bench, 6) == ["tibia", "", "tibia", "", "tibia", ""]
    assert bench.script.calls == ["register tibia", "glance at tibia", "glance at tibia"]
    assert bench.state == "ready"


def test_a_bone_asked_for_that_is_not_found_is_looked_for_in_its_next_turn() -> None:
    bench = replayed([LOST_OF["tibia"]])
    assert turns(bench, 4) == ["tibia", "", "tibia", ""]
    assert bench.script.calls == ["register tibia"] * 2
    assert other(bench).verdict.status is Status.LOST
    bench.script.found = []
    assert turns(bench, 2) == ["tibia", ""]
    bench.script.found = [FOUND["tibia"]]
    bench.frames(4)
    assert bench.script.calls[-2:] == ["register tibia", "glance at tibia"]
    assert is_current(other(bench))
