import numpy as np
import pytest

from navapp.preop.usual_approaches import usual_approaches
from sim_devices.scenario import Scenario
from sim_devices.world import World


@pytest.mark.release
@pytest.mark.parametrize("side", ["left", "right"])
@pytest.mark.parametrize("bone", ["femur", "tibia", "patella"])
def test_the_simulated_cameras_stand_well_inside_the_usual_cone(bone: str, side: str) -> None:
    world = World(Scenario(seed=12, side=side))  # type: ignore[arg-type]
    pose = getattr(world, f"nominal_left_from_{bone}")
    seen_from = pose.inverse().apply(0.5 * world.rig.right_from_left.inverse().translation_mm)
    cone = usual_approaches([bone])[bone]
    away_deg = cone.off_axis_deg((seen_from / np.linalg.norm(seen_from))[None])
    assert away_deg[0] < 0.5 * cone.half_angle_deg


def test_bones_without_a_usual_one_have_none() -> None:
    assert list(usual_approaches(["femur", "fibula"])) == ["femur"]
