from navapp.cli.practice_cuts import PracticeCuts
from navapp.control.commands import ConfirmCut, WithdrawCut

ROOM = {"opening": (), "implant": ("distal", "anterior"), "spacer": ("distal", "anterior", "tibia")}


def make(planned=("distal", "anterior", "tibia")):
    sent = []
    cuts = PracticeCuts(ROOM.__getitem__, planned)
    return cuts, sent


def test_the_cuts_of_the_first_stage_are_told_once_the_session_listens() -> None:
    cuts, sent = make()
    cuts.enter_stage("implant")
    assert sent == []
    cuts.connect(sent.append)
    assert sent == [ConfirmCut("distal"), ConfirmCut("anterior")]


def test_a_later_stage_tells_what_has_changed() -> None:
    cuts, sent = make()
    cuts.enter_stage("implant")
    cuts.connect(sent.append)
    sent.clear()
    cuts.enter_stage("spacer")
    assert sent == [ConfirmCut("tibia")]
    sent.clear()
    cuts.enter_stage("opening")
    assert sent == [WithdrawCut("distal"), WithdrawCut("anterior"), WithdrawCut("tibia")]


def test_what_the_sessions_plan_does_not_hold_is_not_told() -> None:
    cuts, sent = make(planned=("tibia",))
    cuts.enter_stage("spacer")
    cuts.connect(sent.append)
    assert sent == [ConfirmCut("tibia")]
