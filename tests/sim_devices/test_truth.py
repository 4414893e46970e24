import ast
from pathlib import Path

import numpy as np

from drivers.clock import ManualClock
from sim_devices.camera import SimulatedCamera
from sim_devices.scenario import Scenario
from sim_devices.truth import TruthOracle
from sim_devices.world import World
from tests.sim_devices.plain_world import PlainWorld


def test_truth_is_that_of_the_capture_time():
    world, clock = PlainWorld(), ManualClock(5_000_000_000)
    camera = SimulatedCamera(world, clock, is_stepped=True, rate_hz=10.0)
    camera.open()
    oracle = TruthOracle(world, camera.world_time_ns)
    for k in range(3):
        frame = camera.read(1.0)
        pose = oracle.left_from_body("femur", frame.captured_ns)
        np.testing.assert_allclose(pose.translation_mm, (0.0, 0.0, 400.0 + 0.1 * k))
    camera.close()
    assert oracle.bodies == ("femur",)


def test_no_stage_of_the_line_knows_the_truth():
    root = Path(__file__).parents[2]
    packages = ("drivers", "calibration", "navapp/stereo", "navapp/registration", "navapp/tracking")
    files = [path for name in packages for path in (root / name).rglob("*.py")]
    assert files
    for path in files:
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            if isinstance(node, ast.ImportFrom):
                names = [node.module or ""]
            assert not any(name.startswith("sim_devices") for name in names), path


def test_what_was_made_is_that_of_the_world():
    world = World(Scenario(motion="still"))
    oracle = TruthOracle(world, lambda captured_ns: captured_ns)
    assert oracle.made_planes().keys() == world.planned_cuts.keys()
    assert oracle.made_parts().keys() == {"femoral_implant", "patellar_implant", "spacer"}
    np.testing.assert_array_equal(oracle.made_hole()[0], world.record.made_hole[0])
    assert oracle.made_insert() == world.record.made_insert_mm
