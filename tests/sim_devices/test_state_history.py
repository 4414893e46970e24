from sim_devices.operation import State, enter
from sim_devices.state_history import StateHistory

OPENING, IMPLANT, SPACER = (enter(stage) for stage in ("opening", "implant", "spacer"))


def test_before_any_picture_the_newest_state_counts_for_all_times() -> None:
    history = StateHistory(OPENING)
    history.show(IMPLANT)
    assert history.now == IMPLANT
    assert history.at(0) == IMPLANT


def test_a_picture_keeps_the_state_that_it_showed() -> None:
    history = StateHistory(OPENING)
    assert history.take_picture(100) == OPENING
    history.show(IMPLANT)
    assert history.take_picture(200) == IMPLANT
    history.show(SPACER)
    shown = [history.at(time_ns) for time_ns in (0, 100, 101, 200, 201)]
    assert shown == [OPENING, OPENING, IMPLANT, IMPLANT, SPACER]


def test_an_older_picture_does_not_move_the_change_back() -> None:
    history = StateHistory(OPENING)
    history.take_picture(200)
    history.take_picture(100)
    history.show(State("opening", frozenset({"femoral_guide"})))
    assert history.at(150) == OPENING


def test_steps_are_made_and_unmade_and_stages_gone_through() -> None:
    history = StateHistory(OPENING)
    assert history.go_on("implant") == {"femoral_guide"}
    history.make("femur_distal")
    assert history.now.made_of("femur") == ("femoral_guide", "femur_distal")
    assert "femur_distal" in history.go_on("patella")
    assert history.go_on("drilling") == {"femoral_guide"}
    assert history.go_on("opening") == frozenset()
    assert history.set_stage("implant") == IMPLANT.made
    history.unmake("femur_distal")
    assert "femur_distal" not in history.now.made
    assert IMPLANT.made < history.names
