from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from navapp.errors import UsageError
from navapp.geometry.camera import Camera
from navapp.geometry.rectification import Rectifier
from navapp.geometry.transform import RigidTransform, rotation_angle_deg
from sim_devices.renderer import Renderer
from sim_devices.scenario import Scenario
from sim_devices.world import World

SECOND = 1_000_000_000
PLAIN = Scenario(blood=0.0, motion="still")
MIRROR = np.diag([-1.0, 1.0, 1.0, 1.0])


@lru_cache(maxsize=12)
def world(scenario=PLAIN):
    return World(scenario)


def grey(radiance):
    """Grey levels as a camera's tone curve makes them."""
    return np.minimum(radiance @ (0.114, 0.587, 0.299), 1.0) ** 0.45


def smooth(image, sigma):
    import cv2

    return cv2.GaussianBlur(image, (0, 0), sigma)


def shrunk(mask, size):
    import cv2

    return cv2.erode(mask.astype(np.uint8), np.ones((size, size), np.uint8)) > 0


def mask_of(picture, body):
    return picture.body == picture.bodies.index(body)


@pytest.mark.release
def test_pictures_have_the_size_of_the_scaled_rig():
    assert world().render("left", 0).shape == (720, 1280, 3)
    small = world().render("right", 0, 0.5)
    assert small.shape == (360, 640, 3)
    assert small.dtype == np.float32
    assert np.isfinite(small).all()


@pytest.mark.release
def test_a_small_picture_shows_the_same_as_a_large_one():
    large = smooth(world().render("left", 0), 4.0)[::2, ::2]
    small = smooth(world().render("left", 0, 0.5), 2.0)
    assert np.median(np.abs(large - small)) < 0.02


def test_the_bone_is_as_large_and_as_bright_as_a_real_one():
    picture = world().depth("left", 0)
    v, u = np.nonzero(mask_of(picture, "femur"))
    assert 200 < np.ptp(u) < 320
    assert 440.0 < np.median(picture.depth_mm[v, u]) < 500.0
    assert 0.3 < np.median(grey(world().render("left", 0))[v, u]) ** (1 / 0.45) < 0.8
    for body in ("tibia", "tissue", "drape"):
        assert mask_of(picture, body).sum() > 8000


@pytest.mark.parametrize("shake_mm", [0.0, 1.0])
def test_equal_scenarios_give_equal_pictures_and_other_seeds_do_not(shake_mm):
    scenario = Scenario(seed=3, motion="patient", instrument="sweep", shake_mm=shake_mm)
    first = World(scenario).render("left", 2 * SECOND, 0.25)
    again = World(scenario)
    again.render("left", 7 * SECOND, 0.25)
    # Within one step of what is kept.
    again.render("left", 2 * SECOND + SECOND // 10_000, 0.25)
    np.testing.assert_array_equal(again.render("left", 2 * SECOND, 0.25), first)
    other = World(replace(scenario, seed=4)).render("left", 2 * SECOND, 0.25)
    assert np.abs(other - first).mean() > 0.01


def test_what_is_seen_of_the_femur_is_the_anatomy_at_the_true_pose():
    o3d = pytest.importorskip("open3d")
    for eye in ("left", "right"):
        picture = world().depth(eye, 0)
        femur = mask_of(picture, "femur")
        pose = world().left_from_body("femur", 0)
        if eye == "right":
            pose = world().rig.right_from_left @ pose
        bone = world().anatomy.bones["femur"].transform(pose)
        scene = o3d.t.geometry.RaycastingScene(nthreads=1)
        scene.add_triangles(
            o3d.core.Tensor(np.array(bone.vertices_mm, dtype=np.float32)),
            o3d.core.Tensor(np.array(bone.faces, dtype=np.uint32)),
        )
        v, u = np.nonzero(femur)
        camera = world().rig.left if eye == "left" else world().rig.right
        directions = camera.rays(np.column_stack([u, v]))
        rays = np.hstack([np.zeros_like(directions), directions]).astype(np.float32)
        depth = scene.cast_rays(o3d.core.Tensor(rays))["t_hit"].numpy()
        hit = np.isfinite(depth)
        assert hit.mean() > 0.999
        error = np.abs(depth - picture.depth_mm[v, u])[hit]
        assert np.median(error) < 1e-3
        assert np.percentile(error, 99) < 0.02


@pytest.mark.release
def test_the_nominal_start_is_the_book_and_the_truth_is_off_by_the_placement_error():
    for seed in (1, 2, 3):
        true = world(replace(PLAIN, seed=seed)).left_from_body("femur", 0)
        nominal = world(replace(PLAIN, seed=seed)).nominal_left_from_femur
        np.testing.assert_array_equal(nominal.matrix, world().nominal_left_from_femur.matrix)
        assert 6.0 <= rotation_angle_deg(true, nominal) <= 9.0
        shift = np.linalg.norm(true.translation_mm - nominal.translation_mm)
        assert 6.0 - 1e-9 <= shift <= 10.0 + 1e-9


@pytest.mark.parametrize("side", ["right", "left"])
def test_by_the_book_the_knee_is_bent_as_it_is_at_rest(side):
    simulated = world(replace(PLAIN, side=side))
    true_femur, true_tibia = (simulated.left_from_body(name, 0) for name in ("femur", "tibia"))
    true_patella = simulated.left_from_body("patella", 0)
    for true, nominal in (
        (true_tibia, simulated.nominal_left_from_tibia),
        (true_patella, simulated.nominal_left_from_patella),
    ):
        np.testing.assert_allclose(
            (simulated.nominal_left_from_femur.inverse() @ nominal).matrix,
            (true_femur.inverse() @ true).matrix,
            atol=1e-9,
        )
        assert rotation_angle_deg(true, nominal) >= 6.0


def test_the_approach_axis_points_from_the_bone_to_the_cameras():
    axis = world().approach_axis
    assert np.linalg.norm(axis) == pytest.approx(1.0)
    middle = 0.5 * world().rig.right_from_left.inverse().translation_mm
    true = world().left_from_body("femur", 0).inverse().apply(middle)
    angle = np.degrees(np.arccos(axis @ true / np.linalg.norm(true)))
    assert angle < world().approach_half_angle_deg / 2
    # From the front and from below.
    assert axis[1] < -0.3
    assert axis[2] < -0.6


def test_stages_change_the_picture_and_not_the_pose():
    site = World(PLAIN)
    assert site.states.now.stage == "opening"
    opening, pose = site.render("left", SECOND, 0.5), site.left_from_body("femur", SECOND)
    site.states.set_stage("drilling")
    assert site.states.now.stage == "drilling"
    drilling = site.render("left", SECOND, 0.5)
    assert (np.abs(opening - drilling).max(axis=2) > 0.05).sum() > 1000
    np.testing.assert_array_equal(site.left_from_body("femur", SECOND).matrix, pose.matrix)
    site.states.set_stage("opening")
    np.testing.assert_array_equal(site.render("left", SECOND, 0.5), opening)


def test_a_drilled_hole_is_seen_when_the_drill_is_away():
    site = World(replace(PLAIN, stage="drilling"))
    before, after = (w.depth("left", int(4.4 * SECOND)) for w in (world(), site))
    both = mask_of(before, "femur") & mask_of(after, "femur")
    deeper = (after.depth_mm - before.depth_mm)[both] > 5.0
    assert deeper.sum() > 200


def test_the_drill_turns():
    site = World(replace(PLAIN, stage="drilling"))
    a, b = (site.left_from_body("drill", t).rotation for t in (SECOND, SECOND + 50_000_000))
    assert not np.allclose(a, b, atol=0.1)


def test_an_unknown_stage_names_the_known_ones():
    with pytest.raises(UsageError, match=r"lunch.*opening, drilling"):
        world().states.set_stage("lunch")
    with pytest.raises(UsageError, match="opening"):
        World(replace(PLAIN, stage="lunch"))


def test_an_unknown_body_is_refused():
    with pytest.raises(UsageError, match="femur, tibia, patella"):
        world().left_from_body("nose", 0)


def test_a_left_knee_is_the_mirror_image_of_a_right_one():
    right, left = world(), world(replace(PLAIN, side="left"))
    table = right._left_from_table.inverse()
    for body in right.bodies:
        a, b = ((table @ w.left_from_body(body, 0)).matrix for w in (right, left))
        np.testing.assert_allclose(b, MIRROR @ a @ MIRROR, atol=1e-9)
    camera = Camera(
        np.array([[350.0, 0, 159.5], [0, 350.0, 89.5], [0, 0, 1]]), np.zeros(5), 320, 180
    )
    camera_from_table = RigidTransform.from_parts("camera", "table", np.eye(3), (0.0, 0.0, 450.0))
    pictures = []
    for site in (right, left):
        parts = site._scenes.scene(site._state).parts
        poses = {
            part.body: camera_from_table @ table @ site.left_from_body(part.body, 0)
            for part in parts
        }
        renderer = Renderer(camera, parts, site._scenes.surfaces, frozenset({"drape"}))
        pictures.append(renderer.render(poses, camera_from_table))
    difference = np.abs(pictures[0] - pictures[1][:, ::-1]).max(axis=2)
    assert np.median(difference) < 1e-3
    assert (difference > 0.05).mean() < 0.01


@pytest.mark.release
def test_the_texture_of_bone_has_the_contrast_asked_for():
    for contrast in (0.03, 0.05, 0.08):
        with_texture, without = (
            world(replace(PLAIN, contrast=c)).render("left", 0) for c in (contrast, 0.0)
        )
        picture = world().depth("left", 0)
        lit = smooth((without.max(axis=2) < 0.7).astype(np.float32), 4.0) > 0.99
        bone = shrunk(mask_of(picture, "femur"), 9) & lit
        assert bone.sum() > 8000
        ratio = (smooth(grey(with_texture), 0.5) / smooth(grey(without), 0.5))[bone]
        assert 0.85 * contrast < ratio.std() < 1.25 * contrast


def test_the_high_passed_bone_shows_3_to_8_percent():
    levels = smooth(grey(world().render("left", 0)), 0.5)
    lit = smooth((world().render("left", 0).max(axis=2) < 0.7).astype(np.float32), 4.0) > 0.99
    bone = shrunk(mask_of(world().depth("left", 0), "femur"), 9) & lit
    weight = bone.astype(np.float64)
    mean = smooth(levels * weight, 8.0) / np.maximum(smooth(weight, 8.0), 1e-6)
    assert 0.03 < (levels[bone] / mean[bone] - 1.0).std() < 0.08


def test_the_hand_hides_part_of_the_bone_and_leaves():
    site = World(replace(PLAIN, instrument="sweep"))
    seen = [
        mask_of(site.depth("left", int(t * SECOND), 0.25), "femur").sum()
        for t in np.arange(0.0, 6.0, 0.25)
    ]
    free = mask_of(world().depth("left", 0, 0.25), "femur").sum()
    assert seen[0] == free
    assert 0.60 < min(seen) / free < 0.85


def test_tissue_follows_the_femur_by_nine_tenths_and_the_drape_not_at_all():
    site = World(replace(PLAIN, motion="jump"))
    moved = {
        body: site.left_from_body(body, 10 * SECOND).matrix - site.left_from_body(body, 0).matrix
        for body in ("femur", "tissue", "drape")
    }
    assert np.abs(moved["drape"]).max() == 0.0
    turned = rotation_angle_deg(
        site.left_from_body("tissue", 10 * SECOND), site.left_from_body("tissue", 0)
    )
    assert turned == pytest.approx(9.0, abs=0.01)
    assert np.linalg.norm(moved["femur"][:3, 3]) == pytest.approx(15.0, abs=0.01)


def test_a_patient_bends_the_knee_a_little():
    site = World(replace(PLAIN, motion="patient"))
    relative = [
        site.left_from_body("femur", t).inverse() @ site.left_from_body("tibia", t)
        for t in (0, int(0.7 * SECOND))
    ]
    assert 0.05 < rotation_angle_deg(*relative) < 3.0


def test_cartilage_lies_on_the_bone_except_at_the_defect():
    covered = World(replace(PLAIN, cartilage_mm=2.0))
    bare, thick = (w.depth("left", 0) for w in (world(), covered))
    both = shrunk(mask_of(bare, "femur") & mask_of(thick, "femur"), 5)
    nearer = (bare.depth_mm - thick.depth_mm)[both]
    assert 1.0 < np.median(nearer) < 3.5
    worn = covered.left_from_body("femur", 0).apply(covered._defect_mm())
    u, v = np.rint(covered.rig.left.project(worn)[0]).astype(int)
    assert abs(bare.depth_mm[v, u] - thick.depth_mm[v, u]) < 0.2


@pytest.mark.parametrize("side", ["left", "right"])
def test_the_surface_that_is_seen_lies_its_true_thickness_above_the_bone(side):
    site = World(replace(PLAIN, side=side, cartilage_mm=2.0))
    bone, thickness = site.anatomy.bones["femur"], site.cartilage_mm("femur")
    above = bone.vertices_mm + thickness[:, None] * bone.normals
    chosen = np.flatnonzero(thickness > 1.0)[::40]
    pose, camera = site.left_from_body("femur", 0), site.rig.left
    points = pose.apply(above[chosen])
    u, v = np.rint(camera.project(points)).astype(int).T
    picture = site.depth("left", 0)
    is_femur = mask_of(picture, "femur")[v, u]
    off_mm = (picture.depth_mm[v, u] - points[:, 2])[is_femur]
    # What turns away from the camera is behind something nearer.
    is_seen = off_mm > -1.0
    assert is_seen.sum() > 30
    assert np.median(np.abs(off_mm[is_seen])) < 0.1
    assert 0.8 < thickness[chosen].min() < thickness.max() < 3.3


def test_a_bare_bone_has_no_thickness_anywhere():
    assert not any(world().cartilage_mm(name).any() for name in world().anatomy.bones)


def test_edges_of_large_triangles_follow_the_lens():
    site = world()
    parts = site._scenes.scene(site._state).parts
    camera = site.rig.left
    for part in parts:
        pose = site.left_from_body(part.body, 0)
        points = pose.apply(part.mesh.vertices_mm)
        a, b = points[part.mesh.faces[:, 0]], points[part.mesh.faces[:, 1]]
        ends = [camera.project(end) for end in (a, b)]
        inside = [
            (e > 0).all(axis=1) & (e < (camera.width, camera.height)).all(axis=1) for e in ends
        ]
        keep = inside[0] & inside[1]
        if not keep.any():
            continue
        first, along = ends[0][keep], (ends[1] - ends[0])[keep]
        middle = camera.project(0.5 * (a + b)[keep]) - first
        length = np.maximum(np.linalg.norm(along, axis=1), 1e-9)
        off = np.abs(along[:, 0] * middle[:, 1] - along[:, 1] * middle[:, 0]) / length
        assert off.max() < 0.05


@pytest.mark.release
def test_block_matching_finds_the_bone():
    import cv2

    site = World(Scenario(seed=2, motion="still"))
    rectifier = Rectifier(site.rig)
    rendered = [site.render(eye, 0) for eye in ("left", "right")]
    levels = [np.rint(255.0 * smooth(grey(image), 0.5)).astype(np.uint8) for image in rendered]
    pair = rectifier.rectify(*levels)
    geometry = pair.geometry
    low = int(geometry.disparity_px(560.0))
    matcher = cv2.StereoSGBM_create(low, 96, 5, 200, 800, 1, 31, 5, 50, 2)
    disparity = matcher.compute(pair.left, pair.right).astype(np.float32) / 16.0
    picture = site.depth("left", 0)
    v, u = np.nonzero(shrunk(mask_of(picture, "femur"), 7))
    rays = site.rig.left.rays(np.column_stack([u, v]))
    points = geometry.rectified_from_left.apply(rays * picture.depth_mm[v, u][:, None])
    column, row = np.rint(geometry.project(points)).astype(int).T
    found = disparity[row, column]
    matched = found > low
    assert matched.mean() > 0.8
    error = geometry.focal_px * geometry.baseline_mm / found[matched] - points[matched, 2]
    assert np.median(np.abs(error)) < 1.0
