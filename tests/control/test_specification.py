import pytest

from navapp.config import parse
from navapp.control.specification import SessionSpecification, specify_session
from navapp.control.stages import STAGES
from navapp.values import Prior
from tests.control.fakes import a_plan, a_rig

CONTENT = {
    "camera": {"depth_mm": [350.0, 600.0]},
    "display": {"valid_ms": 400.0, "delay_ms": 90.0},
    "mirror": {"calibrated_deg": 44.0},
    "recording": {"folder": "sessions/01"},
    "tracking": {"method": "icp"},
}


def specified(*, is_live: bool, **more) -> SessionSpecification:
    configuration = parse(CONTENT, "test")
    stage = STAGES[1]
    return specify_session(
        configuration, a_rig(), a_plan(), Prior(), stage, is_live=is_live, **more
    )


@pytest.mark.parametrize("is_live", [True, False])
def test_what_is_configured_counts_in_live_sessions_and_replays(is_live: bool) -> None:
    specification = specified(is_live=is_live)
    assert specification.stage is STAGES[1]
    assert specification.method == "icp"
    assert specification.tracker_settings.method == "icp"
    assert specification.tracker_settings.depth_mm == (350.0, 600.0)
    assert specification.mirror_deg == 44.0


def test_only_live_pictures_are_seen_late_and_only_live_sessions_are_recorded() -> None:
    live, replayed = specified(is_live=True), specified(is_live=False)
    assert (live.overlay_valid_ms, replayed.overlay_valid_ms) == (310.0, 400.0)
    assert (live.is_recording, replayed.is_recording) == (True, False)


def test_a_replay_may_choose_the_method_further_bones_and_layers() -> None:
    assert specified(is_live=False).layers is None
    specification = specified(is_live=False, method="bimcc", others=("tibia",), layers=("bone",))
    assert specification.layers == ("bone",)
    assert specification.method == "bimcc"
    assert specification.others == ("tibia",)
