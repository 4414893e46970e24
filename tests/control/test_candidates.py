"""Several candidates: compared, chosen among, accepted one by one."""

import pytest

from navapp.control.command_files import command_from_json, command_to_json
from navapp.control.commands import Accept, ChooseCandidate, Register, Reject
from navapp.values import Reason, Status
from tests.control.fakes import Bench, a_pose, answer


@pytest.fixture
def bench() -> Bench:
    """Three candidates wait, 30 mm beside each other."""
    bench = Bench()
    bench.script.found = [answer(pose=a_pose(x_mm=x_mm)) for x_mm in (-30.0, 0.0, 30.0)]
    bench.frames(1)
    bench.do(Register())
    bench.frames(2)
    return bench


def shown(bench: Bench) -> list[int]:
    return [one.number for one in bench.snapshot.candidates if one.is_shown]


def test_the_arrows_go_through_all_candidates_and_round(bench: Bench) -> None:
    seen = shown(bench)
    for step in (1, 1, 1, -1):
        bench.do(ChooseCandidate(step))
        bench.frames(1)
        seen += shown(bench)
    assert seen == [1, 2, 3, 1, 3]
    assert [one.number for one in bench.snapshot.candidates] == [1, 2, 3]


def test_what_is_accepted_is_the_candidate_that_is_shown(bench: Bench) -> None:
    bench.do(ChooseCandidate(-1))
    bench.frames(1)
    bench.do(Accept(bench.snapshot.candidate_id))
    assert bench.state == "navigating"
    _, track, _ = bench.script.tracks[-1]
    assert track.left_from_bone.translation_mm[0] == 30.0


def test_a_key_pressed_for_the_candidate_before_decides_nothing(bench: Bench) -> None:
    before = bench.snapshot.candidate_id
    bench.do(ChooseCandidate(1))
    bench.frames(1)
    bench.do(Accept(before))
    assert "another candidate is under review now" in bench.refused()
    assert bench.state == "review"


def test_it_cannot_be_accepted_before_it_was_judged_anew(bench: Bench) -> None:
    bench.do(ChooseCandidate(1))
    bench.do(Accept(bench.snapshot.candidate_id))
    assert "the candidate is not on the screen yet" in bench.refused()


def test_a_rejected_one_is_no_longer_among_them(bench: Bench) -> None:
    bench.do(ChooseCandidate(1))
    bench.frames(1)
    bench.do(Reject(bench.snapshot.candidate_id))
    bench.frames(1)
    assert [one.number for one in bench.snapshot.candidates] == [1, 3]
    assert shown(bench) == [1]


def test_one_alone_has_no_other(bench: Bench) -> None:
    for _ in range(2):
        bench.do(Reject(bench.snapshot.candidate_id))
        bench.frames(1)
    bench.do(ChooseCandidate(1))
    assert "there is no other candidate" in bench.refused()
    assert all(one.picture is None for one in bench.snapshot.candidates)


def test_each_has_a_picture_with_its_own_outline(bench: Bench) -> None:
    pictures = [one.picture for one in bench.snapshot.candidates]
    assert all(picture is not None and picture.any() for picture in pictures)
    first = pictures[0]
    bench.frames(1)
    assert bench.snapshot.candidates[0].picture is first, "drawn once, not with every frame"
    bench.do(ChooseCandidate(1))
    bench.frames(1)
    assert bench.snapshot.candidates[0].picture is not first


def test_of_a_lost_candidate_no_outline_is_drawn(bench: Bench) -> None:
    bench.script.tracked = answer(Status.LOST, Reason.COVERAGE_LOW, has_pose=True)
    bench.frames(1)
    assert not bench.snapshot.candidates[0].picture[20:-20].any(), "nor once it is lost"
    bench.do(ChooseCandidate(1))
    bench.script.tracked = answer()
    bench.frames(1)
    first, second, _ = bench.snapshot.candidates
    assert first.verdict.status is Status.LOST
    assert not first.picture[20:-20].any()
    assert second.picture[20:-20].any()


def test_the_command_is_kept_in_recordings() -> None:
    for step in (1, -1):
        assert command_from_json(command_to_json(ChooseCandidate(step))) == ChooseCandidate(step)
