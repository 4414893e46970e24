"""A bone that was cut unknown to the plan."""

import numpy as np

from navapp.geometry.transform import RigidTransform
from navapp.tracking import Goal, TrackState, make_tracker
from navapp.values import Reason, Status
from sim_devices.scenario import Scenario
from sim_devices.sensor import SensorModel
from sim_devices.world import World
from tests.knees import femur_of
from tests.pictures import Pictures

# Of the clipped squares that are strewn over what is gone: distance, and side.
SPACING_PX, SIDE_PX = 14, 3


def strew(picture: np.ndarray, world: World, true: RigidTransform) -> np.ndarray:
    """The left picture with clipped squares where the bone was sawn off."""
    vertices = world.anatomy.bones["femur"].vertices_mm
    cuts = [world.record.made_planes[n] for n, c in world.record.planned_cuts.items()
            if c.bone == "femur"]  # fmt: skip
    is_gone = np.any([(vertices - point) @ normal > 0.5 for point, normal in cuts], axis=0)
    columns, rows = world.rig.left.project(true.apply(vertices[is_gone])).round().astype(int).T
    strewn = picture.copy()
    for y in range(rows.min(), rows.max(), SPACING_PX):
        for x in range(columns.min(), columns.max(), SPACING_PX):
            if np.min(np.hypot(rows - y, columns - x)) < SPACING_PX:
                strewn[y : y + SIDE_PX, x : x + SIDE_PX] = 255
    return strewn


def test_highlights_do_not_hide_that_a_face_was_sawn_unknown_to_the_plan() -> None:
    world, sensor = World(Scenario(seed=1)), SensorModel(seed=1)
    world.states.set_stage("implant")
    left, right = (sensor.picture(world.render(eye, 0), eye, 0) for eye in ("left", "right"))
    true = world.left_from_body("femur", 0)
    tracker = make_tracker(world.rig, femur_of(world))
    goal = Goal(np.empty((0, 3)), 2.0)
    pictures = Pictures(strew(left, world, true), right)
    found, _ = tracker.glance(pictures, TrackState.at_rest(true, 0), goal)
    assert found.verdict.status is not Status.OK
    assert Reason.SEEN_THROUGH in found.verdict.reasons
