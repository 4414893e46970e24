"""The operation in the simulated room: what each of its states shows, and where its bones are."""

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from navapp.errors import UsageError
from navapp.geometry.transform import rotation_angle_deg
from sim_devices.materials import MaterialId
from sim_devices.operation import State, enter
from sim_devices.rigs import camera_from_left
from sim_devices.scenario import Scenario
from sim_devices.world import World
from tests.many import few_of

SECOND = 1_000_000_000
PLAIN = Scenario(blood=0.0, motion="still")
PATIENTS = [
    PLAIN,
    replace(PLAIN, seed=2, side="left", sex="male", age_group="old"),
    *(
        replace(PLAIN, seed=seed, side=side, sex=sex, age_group=age)
        for seed, (side, sex, age) in enumerate(
            [
                ("right", "male", "young"),
                ("left", "female", "middle"),
                ("right", "female", "old"),
                ("left", "male", "young"),
                ("right", "male", "middle"),
                ("left", "female", "old"),
                ("right", "female", "young"),
                ("left", "male", "middle"),
                ("right", "male", "old"),
                ("left", "female", "young"),
            ],
            start=3,
        )
    ),
]
# The posterior faces turn away from the cameras.
SEEN = {
    "implant": ("femur_distal", "femur_anterior", "femur_chamfer_anterior"),
    "patella": ("patella",),
    "spacer": ("tibia_proximal",),
}
BONES = {"implant": "femur", "patella": "patella", "spacer": "tibia"}


@lru_cache(maxsize=2)
def world(scenario=PLAIN):
    return World(scenario)


def share_seen(site, eye, part):
    """Part of the vertices of a part that a camera sees."""
    left_from_body = site.left_from_body(part.body, 0)
    pose = camera_from_left(site.rig, eye, (0.0, 0.0, 0.0)) @ left_from_body
    camera = site.rig.left if eye == "left" else site.rig.right
    points = pose.apply(part.mesh.vertices_mm[np.unique(part.mesh.faces)])
    u, v = np.rint(camera.project(points)).astype(int).T
    depth_mm = site.depth(eye, 0).depth_mm[v, u]
    return float((points[:, 2] < depth_mm + 1.0).mean())


@pytest.mark.parametrize("scenario", few_of(PATIENTS))
@pytest.mark.parametrize("stage", few_of(SEEN))
def test_both_cameras_see_the_cut_faces_of_the_stage(scenario, stage) -> None:
    site = world(scenario)
    site.states.set_stage(stage)
    if stage == "patella":
        site.states.show(site.states.now.advance())
    planes = site.record.made_planes
    faces = [
        part
        for part in site._scenes.scene(site._state).parts
        if part.material is MaterialId.SAWN_BONE and part.body == BONES[stage]
    ]
    for name in SEEN[stage]:
        point_mm, normal = planes[name]
        heights = [np.abs((face.mesh.vertices_mm - point_mm) @ normal).max() for face in faces]
        face = faces[int(np.argmin(heights))]
        assert min(heights) < 1e-6
        for eye in ("left", "right"):
            assert share_seen(site, eye, face) > 0.6, (name, eye)


@pytest.mark.release
@pytest.mark.parametrize("scenario", PATIENTS)
def test_the_patella_that_is_turned_over_lies_free_and_shows_its_joint_side(scenario) -> None:
    site = world(scenario)
    site.states.set_stage("patella")
    for eye in ("left", "right"):
        picture = site.depth(eye, 0)
        seen = picture.body == picture.bodies.index("patella")
        assert seen.sum() > 8000
    bone, pose = site.anatomy.bones["patella"], site.left_from_body("patella", 0)
    towards = pose.rotate(np.array([0.0, 1.0, 0.0]))
    assert towards[2] < -0.9
    (skin, *_) = [p for p in site._scenes.scene(site._state).parts if p.body == "patella"]
    joint = bone.normals[:, 1] > 0.5
    assert joint.mean() > 0.25
    assert share_seen(site, "left", skin) > 0.35


@pytest.mark.release
@pytest.mark.parametrize("case", [("patella", 2), ("implant", 1), ("spacer", 1)], ids=str)
def test_advancing_makes_the_next_step_and_changes_the_picture(case: tuple[str, int]) -> None:
    stage, n_steps = case
    site = world()
    site.states.set_stage(stage)
    before = site.render("left", 0, 0.5)
    for _ in range(n_steps):
        made = site.states.now.made
        site.states.show(site.states.now.advance())
        assert len(site.states.now.made - made) == 1
        after = site.render("left", 0, 0.5)
        assert (np.abs(after - before).max(axis=2) > 0.05).sum() > 500
        before = after
    with pytest.raises(UsageError, match="every step"):
        site.states.show(site.states.now.advance())


def test_any_steps_can_be_shown() -> None:
    site = world()
    site.states.set_stage("implant")
    site.states.show(State("implant", frozenset({"femur_distal"})))
    assert site.states.now.made_of("femur") == ("femur_distal",)
    assert site.states.now.stage == "implant"
    with pytest.raises(UsageError, match="nail"):
        site.states.make("nail")
    assert site.states.set_stage("spacer") == enter("spacer").made


@pytest.mark.release
def test_metal_mirrors_the_lamps_and_bone_does_not() -> None:
    site = world()
    site.states.set_stage("implant")
    bone = site.render("left", 0, 0.5)
    site.states.show(site.states.now.advance())
    metal = site.render("left", 0, 0.5)
    picture = site.depth("left", 0, 0.5)
    femur = picture.body == picture.bodies.index("femur")
    # A lamp's image is far beyond what the sensor holds.
    assert (metal[femur].max(axis=1) > 3.0).sum() > 30
    assert (bone[femur].max(axis=1) > 3.0).sum() == 0
    table = site._scenes.surfaces.materials
    assert table[MaterialId.METAL, 21] > 0.5
    assert table[MaterialId.METAL, 22] <= 0.2


@pytest.mark.release
def test_the_pose_of_an_earlier_picture_is_still_known_after_the_knee_has_changed() -> None:
    site = World(PLAIN)
    site.states.set_stage("spacer")
    site.render("left", SECOND, 0.25)
    before = site.left_from_body("tibia", SECOND)
    site.states.show(site.states.now.advance())
    np.testing.assert_array_equal(site.left_from_body("tibia", SECOND).matrix, before.matrix)
    after = site.left_from_body("tibia", SECOND + 1)
    assert np.linalg.norm(after.translation_mm - before.translation_mm) > 0.01


def test_the_oracle_knows_what_was_made_and_it_is_not_what_was_planned() -> None:
    site = world()
    assert set(site.record.made_planes) == set(site.planned_cuts)
    for name, (point_mm, normal) in site.record.made_planes.items():
        planned = site.planned_cuts[name]
        assert 0.0 < abs(planned.heights_mm(point_mm[None])[0]) < 4.0
        assert 0.0 < np.degrees(np.arccos(min(1.0, normal @ planned.normal))) < 6.0
    (entry_mm, axis), (planned_mm, planned_axis) = site.record.made_hole, site.drill_line
    assert 0.0 < np.linalg.norm(np.cross(entry_mm - planned_mm, planned_axis)) < 4.0
    assert axis @ planned_axis > np.cos(np.radians(6.0))


def test_everything_that_is_made_on_a_left_knee_is_the_mirror_image() -> None:
    right, left = world(), world(replace(PLAIN, side="left"))
    flip = np.array([-1.0, 1.0, 1.0])
    for name, (point_mm, normal) in right.record.made_planes.items():
        np.testing.assert_allclose(left.record.made_planes[name][0], point_mm * flip, atol=1e-9)
        np.testing.assert_allclose(left.record.made_planes[name][1], normal * flip, atol=1e-9)
    assert left.record.made_insert_mm == right.record.made_insert_mm
    for name, motion in right.record.made_parts.items():
        assert rotation_angle_deg(motion, left.record.made_parts[name]) < 12.0
        mirrored = np.diag([*flip, 1.0])
        np.testing.assert_allclose(
            left.record.made_parts[name].matrix, mirrored @ motion.matrix @ mirrored, atol=1e-9
        )


@pytest.mark.parametrize("scenario", few_of(PATIENTS, 0))
@pytest.mark.parametrize("stage", ["opening", "drilling", "implant", "patella", "spacer"])
def test_every_patient_can_be_operated_to_the_end(scenario, stage) -> None:
    site = world(scenario)
    site.states.set_stage(stage)
    while True:
        picture = site.render("right", 0, 0.5)
        assert np.isfinite(picture).all()
        try:
            site.states.show(site.states.now.advance())
        except UsageError:
            return
