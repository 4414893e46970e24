"""What moves the whole view or the whole leg: the arm's shake, the drift; and the rows' times."""

from dataclasses import replace

import numpy as np
import pytest

from navapp.geometry.transform import rotation_angle_deg
from sim_devices.drift import compute_drift_mm
from sim_devices.rigs import make_default_rig
from sim_devices.scenario import Scenario
from sim_devices.truth import TruthOracle
from sim_devices.world import World

MS = 1_000_000
SCALE = 0.25
STILL = Scenario(seed=4, motion="still", blood=0.0)
CREST_NS = round(1e9 / 32.0)  # of a shake of 8 Hz


def place_px(picture, body="femur"):
    """Middle of what is seen of a body."""
    v, u = np.nonzero(picture.body == picture.bodies.index(body))
    return np.array([u.mean(), v.mean()])


def test_the_shake_moves_all_bodies_alike_in_the_left_camera():
    shaking, still = World(replace(STILL, shake_mm=2.0)), World(STILL)
    moved = [
        shaking.left_from_body(body, CREST_NS) @ still.left_from_body(body, CREST_NS).inverse()
        for body in ("femur", "tibia", "tissue", "drape", "hand")
    ]
    for one in moved[1:]:
        np.testing.assert_allclose(one.matrix, moved[0].matrix, atol=1e-9)
    assert np.linalg.norm(moved[0].inverse().translation_mm) == pytest.approx(2.0)
    assert rotation_angle_deg(moved[0], moved[0] @ moved[0]) == pytest.approx(
        np.degrees(2.0 / 800.0), rel=1e-3
    )


@pytest.mark.parametrize("body", ["femur", "drape"])
def test_pictures_show_the_bodies_where_the_shaking_rig_sees_them(body):
    shaking, still = World(replace(STILL, shake_mm=2.0)), World(STILL)
    seen = shaking.depth("left", CREST_NS, SCALE)
    points = [one.left_from_body(body, CREST_NS).apply((0.0, 0.0, 0.0)) for one in (shaking, still)]
    moved_px = np.subtract(*(still.rig.left.scale(SCALE).project(p[None])[0] for p in points))
    if body == "femur":
        shown_px = place_px(seen) - place_px(still.depth("left", CREST_NS, SCALE))
        np.testing.assert_allclose(shown_px, moved_px, atol=0.25)
    assert np.linalg.norm(moved_px) > 1.0
    first, second = (one.render("left", CREST_NS, SCALE) for one in (shaking, still))
    assert np.abs(first - second)[:30].mean() > 0.005


def test_what_lies_still_is_drawn_anew_as_the_rig_shakes_and_depends_on_the_time_alone():
    scenario = replace(STILL, shake_mm=1.0)
    once, often = World(scenario), World(scenario)
    for time_ns in (0, CREST_NS // 2, CREST_NS, 3 * CREST_NS):
        often.render("left", time_ns, SCALE)
    np.testing.assert_array_equal(
        often.render("left", CREST_NS, SCALE), once.render("left", CREST_NS, SCALE)
    )


def test_the_drift_moves_the_leg_across_the_view_and_leaves_the_room():
    world, time_ns = World(replace(STILL, drift_mm_s=100.0)), 380 * MS
    still = World(STILL)
    for body in ("femur", "tibia", "tissue", "patella"):
        moved = world.left_from_body(body, time_ns).translation_mm
        moved = moved - still.left_from_body(body, time_ns).translation_mm
        assert moved[0] == pytest.approx(compute_drift_mm(100.0, 0.38), rel=2e-3)
        assert abs(moved[1]) < 0.2
    np.testing.assert_array_equal(
        world.left_from_body("drape", time_ns).matrix, still.left_from_body("drape", time_ns).matrix
    )


def test_the_speed_of_the_drift_gives_the_blur():
    """In px: speed times exposure times focal length over depth."""
    world = World(replace(STILL, drift_mm_s=120.0))
    depth_mm = world.left_from_body("femur", 0).translation_mm[2]
    expected_px = 120.0 * 0.008 * world.rig.left.focal_px / depth_mm
    path_px = world.path_px(340 * MS, 348 * MS)
    assert expected_px == pytest.approx(3.0, abs=0.3)
    # The fastest point is nearer to the camera than the bone's origin.
    assert expected_px < path_px < 1.25 * expected_px


def test_a_shaking_rig_moves_even_what_lies_still():
    assert World(STILL).path_px(0, 8 * MS) == 0.0
    assert World(replace(STILL, shake_mm=0.3)).path_px(0, 8 * MS) > 0.2


def rolling_world(scenario, row_delay_ns):
    return World(scenario, replace(make_default_rig(), row_delay_ns=row_delay_ns))


def test_a_body_is_seen_when_the_middle_row_of_its_box_is_exposed():
    world, time_ns = rolling_world(STILL, 20_000), 400 * MS
    for body in ("femur", "tibia"):
        shown = world.depth("left", time_ns)
        rows = np.flatnonzero((shown.body == shown.bodies.index(body)).any(axis=1))
        middle = 0.5 * (rows[0] + rows[-1]) - 359.5
        # The rows are looked for in a coarse picture.
        assert abs(world.seen_ns(body, time_ns) - time_ns - 20_000 * middle) <= 4 * 20_000
    tibia_ns, femur_ns = (world.seen_ns(body, time_ns) for body in ("tibia", "femur"))
    assert tibia_ns > time_ns
    assert tibia_ns - femur_ns > MS


def test_without_a_rolling_shutter_a_body_is_seen_at_capture():
    assert World(STILL).seen_ns("tibia", 5 * MS) == 5 * MS


def test_what_is_not_in_the_picture_is_taken_at_capture():
    assert rolling_world(STILL, 20_000).seen_ns("patella", 5 * MS) == 5 * MS


def test_the_truth_of_an_answer_is_that_of_the_bodys_own_rows():
    world = rolling_world(replace(STILL, drift_mm_s=200.0), 20_000)
    oracle = TruthOracle(world, lambda captured_ns: captured_ns - MS)
    time_ns = 310 * MS
    seen = oracle.left_from_seen_body("tibia", time_ns + MS)
    apart_ns = world.seen_ns("tibia", time_ns) - time_ns
    at_capture = oracle.left_from_body("tibia", time_ns + MS)
    moved_mm = seen.translation_mm[0] - at_capture.translation_mm[0]
    assert moved_mm == pytest.approx(200.0 * apart_ns * 1e-9, rel=0.01)
