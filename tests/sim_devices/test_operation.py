import pytest

from navapp.errors import UsageError
from sim_devices.operation import STAGES, STEPS, State, enter

FEMORAL = (
    "femur_distal",
    "femur_anterior",
    "femur_posterior",
    "femur_chamfer_anterior",
    "femur_chamfer_posterior",
)


def test_a_stage_is_entered_after_all_steps_of_the_stages_before() -> None:
    assert enter("opening").made == frozenset()
    assert enter("drilling").made == {"femoral_guide"}
    assert enter("implant").made_of("femur") == ("femoral_guide", *FEMORAL)
    assert not enter("implant").is_made("femoral_implant")
    assert enter("patella").is_made("femoral_implant")
    assert not enter("patella").is_made("patella")
    assert enter("spacer").made_of("tibia") == ("tibia_proximal",)
    assert set(FEMORAL) < enter("spacer").made


@pytest.mark.parametrize("stage", STAGES)
def test_advancing_makes_the_steps_of_the_stage_in_order_and_then_ends(stage) -> None:
    state = State(stage, frozenset())
    for step in [step for step in STEPS if step.stage == stage]:
        state = state.advance()
        assert state.is_made(step.name)
    with pytest.raises(UsageError, match="every step"):
        state.advance()


def test_what_there_is_not_is_refused() -> None:
    with pytest.raises(UsageError, match=r"lunch.*opening, drilling"):
        enter("lunch")
    with pytest.raises(UsageError, match=r"nail.*femoral_guide"):
        State("opening", frozenset({"nail"}))
