"""The simulated caliper reads what is left below a face, as a hand does."""

import numpy as np

from sim_devices.caliper import PLACE_SD_MM, READING_SD_MM, Caliper
from sim_devices.scenario import Scenario
from sim_devices.world import World


def test_readings_scatter_about_the_bone_that_is_left() -> None:
    world = World(Scenario(seed=5))
    made_mm, normal = world.record.made_planes["patella"]
    mesh = world.anatomy.bones["patella"]
    point_mm = mesh.vertices_mm.mean(axis=0)
    point_mm = point_mm + ((made_mm - point_mm) @ normal) * normal
    n = 300
    read_mm = Caliper(world).read("patella", np.tile(point_mm, (n, 1)), normal)
    # The opposite side of the bone, right below.
    away_mm = mesh.vertices_mm - point_mm
    flat_mm = np.linalg.norm(away_mm - np.outer(away_mm @ normal, normal), axis=1)
    below_mm = -(away_mm @ normal)[flat_mm < 1.5].min()
    assert abs(np.median(read_mm) - below_mm) < 0.2
    slope = 0.5  # of a patella's front, at most
    assert READING_SD_MM < read_mm.std() < np.hypot(READING_SD_MM, slope * PLACE_SD_MM)


def test_a_room_has_its_own_readings() -> None:
    def read(seed: int) -> np.ndarray:
        world = World(Scenario(seed=seed))
        made_mm, normal = world.record.made_planes["patella"]
        return Caliper(world).read("patella", made_mm[None], normal)

    np.testing.assert_array_equal(read(5), read(5))
