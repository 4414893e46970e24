"""The eye that looks into the simulated mirror: the site where light's laws say, guides on it."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from navapp.devices.simulated_mirror import true_display
from navapp.geometry.camera import Camera
from navapp.geometry.transform import RigidTransform
from navapp.overlay import MirrorView, Scene, compose_mirror
from navapp.tracking import Goal, TrackState, make_tracker
from navapp.values import Plan
from sim_devices.materials import MaterialId, make_material_table
from sim_devices.mirror_setups import make_practice_setup
from sim_devices.renderer import Part, Renderer, Surfaces
from sim_devices.rigs import make_default_rig
from sim_devices.scenario import Scenario
from sim_devices.simulated_eye import SimulatedEye
from sim_devices.textures import make_noise_tile
from tests.geometry.shapes import sphere
from tests.knees import SimulatedKnee
from tests.overlay.scenes import STAGE, grown

SETUP = make_practice_setup(make_default_rig())
# Guides reach so far from the site's middle, along the left camera's axes.
REACH_MM = np.array([50.0, 40.0, 25.0])
# Twice what a black panel sends, cd/m^2.
NOT_LIT_CD_M2 = 0.3


class OneMarble:
    """A world with a small ball at a point of the left camera's frame, and nothing else."""

    def __init__(self, point_mm: np.ndarray) -> None:
        self.part = Part("ball", sphere(1.5, centre_mm=point_mm), MaterialId.GLOVE)

    def render_for(self, camera: Camera, seen_from: RigidTransform, time_ns: int) -> np.ndarray:
        surfaces = Surfaces(
            make_material_table(0.0, 0.0), make_noise_tile(0), np.array([[0.0, 0.0, -1.0, 0.1]]),
            ambient=1.0,
        )  # fmt: skip
        poses = {"ball": seen_from @ RigidTransform.identity("left", "ball")}
        return Renderer(camera, [self.part], surfaces).render(poses, seen_from)


@pytest.mark.kernel
@pytest.mark.parametrize("seed", range(4))
def test_a_point_of_the_world_is_seen_where_its_rays_arrive(seed: int) -> None:
    point = SETUP.site_mm + np.random.default_rng(seed).uniform(-1.0, 1.0, 3) * REACH_MM
    eye = SimulatedEye(OneMarble(point), SETUP)
    rows, columns = np.nonzero(eye.expose(eye.render_site(0), None).max(axis=2) > 20)
    assert len(rows) > 10
    seen = np.array([columns.mean(), rows.mean()])
    assert np.linalg.norm(seen - eye.view.site_px(point[None])[0]) < 1.0


@pytest.mark.kernel
def test_without_the_shift_of_the_plate_it_would_be_elsewhere() -> None:
    """3 mm at 45 degrees shift the site by 1.0 mm, across the line of sight."""
    eye = SimulatedEye(OneMarble(SETUP.site_mm), SETUP)
    straight = eye.view.camera.project(eye.view.eye_from_left.apply(SETUP.site_mm[None]))
    far_px = np.linalg.norm(straight - eye.view.site_px(SETUP.site_mm[None]))
    distance_mm = np.linalg.norm(SETUP.site_mm - SETUP.eye_mm)
    assert far_px * distance_mm / eye.view.camera.focal_px == pytest.approx(1.0, abs=0.05)


@cache
def knee() -> SimulatedKnee:
    return SimulatedKnee(Scenario())


@pytest.mark.kernel
def test_another_camera_sees_what_the_rig_sees_at_that_moment() -> None:
    world, time_ns = knee().world, 400_000_000
    here = RigidTransform.identity("left", "left")
    picture = world.render_for(world.rig.left, here, time_ns)
    np.testing.assert_array_equal(picture, world.render("left", time_ns))


@pytest.mark.kernel
def test_light_of_the_display_is_added_to_the_site() -> None:
    world = knee().world
    eye = SimulatedEye(world, SETUP, 96, 60)
    site = eye.render_site(0)
    panel = SETUP.panel
    white = np.full((panel.height_px, panel.width_px, 3), 255, np.uint8)
    alone, lit = eye.expose(site, None), eye.expose(site, white)
    assert alone.shape == lit.shape == (60, 96, 3)
    assert alone.mean() > 20
    # The panel's image ends a little before the picture does.
    assert lit[8:-8, 8:-8].min() > 240
    np.testing.assert_array_equal(lit[:, 0], alone[:, 0])


def test_guides_of_the_product_lie_on_the_bone_that_the_eye_sees() -> None:
    one = knee()
    (frame,) = one.frames(1)
    true = one.oracle.left_from_body("femur", frame.captured_ns)
    tracker = make_tracker(one.rig, one.bone)
    state = TrackState.at_rest(true, frame.captured_ns)
    goal = Goal(np.empty((0, 3)), 2.0)
    tracked, _ = tracker.track(frame, state, goal)
    assert tracked.left_from_bone is not None
    view = MirrorView(true_display(SETUP).view(), one.rig)
    scene = Scene(
        Plan({"femur": one.bone}), STAGE, tracked.left_from_bone, view, False, tracked.foreground,
        ("bone",),
    )  # fmt: skip
    shown = compose_mirror(scene, view.eye_view, "", is_guiding=True)
    # The ghost of the back face lies 2 mm beside.
    setup = replace(SETUP, plate=replace(SETUP.plate, back_reflection=0.0))
    eye = SimulatedEye(one.world, setup)
    time_ns = one.camera.world_time_ns(frame.captured_ns)
    guides = eye.view.render(shown)[:, :, 1] > NOT_LIT_CD_M2
    whole, seen = bone_masks(eye, time_ns)
    # Tissue covers much of the bone: guides beneath it are drawn, too. The outline is 1 px wide.
    assert (guides & grown(whole, 1)).sum() > 0.99 * guides.sum()
    assert (guides & seen).sum() > 0.9 * seen.sum()


def bone_masks(eye: SimulatedEye, time_ns: int) -> tuple[np.ndarray, np.ndarray]:
    """(h, w) of the femur from the eye: all of it, and what nothing hides."""
    world, camera = knee().world, eye.view.camera
    state = world._state
    renderer, parts = world._scenes.renderer_for(state, camera), world._scenes.scene(state).parts
    poses = world._poses(eye._seen_from, state, time_ns)
    femur = [part for part in parts if part.body == "femur"]
    alone = Renderer(camera, femur, world._scenes.surfaces)
    seen = renderer.depth(*poses)
    return alone.depth(*poses).body >= 0, seen.body == seen.bodies.index("femur")
