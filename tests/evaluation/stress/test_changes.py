"""Rigs and plans that are not quite the true ones."""

import numpy as np
import pytest

from navapp.evaluation.stress import changes
from navapp.geometry.mesh import TriangleMesh
from navapp.values import BoneModel, Plan
from sim_devices.rigs import make_default_rig

RIG = make_default_rig()
# A tetrahedron whose middle is at (1, 1, 1).
MESH = TriangleMesh(
    np.array([[0.0, 0, 0], [4, 0, 0], [0, 4, 0], [0, 0, 4]]),
    np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]], dtype=np.int32),
)
TARGETS = {"femur/notch": np.array([[2.0, 1.0, 1.0]]), "tibia/rim": np.array([[9.0, 9.0, 9.0]])}
PLAN = Plan(
    {"femur": BoneModel("femur", MESH, "right"), "tibia": BoneModel("tibia", MESH)}, TARGETS
)
NONE_MM = np.zeros(1)


@pytest.mark.parametrize("eye", changes.EYES)
@pytest.mark.parametrize(
    ("number", "place", "level", "expected"),
    [
        ("fx", (0, 0), 1.0, 1.01), ("fy", (1, 1), -0.5, 0.995), ("cx", (0, 2), 2.0, None),
        ("cy", (1, 2), 0.25, None),
    ],
)  # fmt: skip
def test_one_number_of_one_camera(eye, number, place, level, expected) -> None:
    changed = changes.change_camera(eye, number)(RIG, level)
    before, after = getattr(RIG, eye), getattr(changed, eye)
    wanted = before.matrix[place] * expected if expected else before.matrix[place] + level
    assert after.matrix[place] == pytest.approx(wanted)
    assert np.count_nonzero(after.matrix != before.matrix) == 1
    np.testing.assert_array_equal(after.distortion, before.distortion)
    other = "right" if eye == "left" else "left"
    assert getattr(changed, other) is getattr(RIG, other)
    assert changed.right_from_left is RIG.right_from_left


@pytest.mark.parametrize(("place", "number"), list(enumerate(("k1", "k2", "p1", "p2", "k3"))))
def test_a_number_of_a_lens(place, number) -> None:
    changed = changes.change_camera("right", number)(RIG, 0.01)
    differs = changed.right.distortion - RIG.right.distortion
    assert differs[place] == pytest.approx(0.01)
    assert np.count_nonzero(differs) == 1


def test_both_focal_lengths_of_both_cameras() -> None:
    changed = changes.change_both_focal(RIG, 0.2)
    for eye in changes.EYES:
        ratio = getattr(changed, eye).matrix[:2, :2] - 1.002 * getattr(RIG, eye).matrix[:2, :2]
        np.testing.assert_allclose(ratio, 0.0, atol=1e-9)


def test_a_camera_that_was_turned_sideways_sees_everything_beside_its_place() -> None:
    point_mm = np.array([[10.0, 5.0, 450.0]])
    before = RIG.right.project(RIG.right_from_left.apply(point_mm))[0]
    for axis, moved in ((1, 0), (0, 1)):
        turned = changes.change_turn(axis)(RIG, 0.01)
        after = turned.right.project(turned.right_from_left.apply(point_mm))[0]
        # A hundredth of a degree at 1400 px.
        assert abs(after - before)[moved] == pytest.approx(0.25, abs=0.03)
        assert abs(after - before)[1 - moved] < 0.02
        assert turned.baseline_mm == pytest.approx(RIG.baseline_mm)


def test_a_longer_baseline_and_a_camera_elsewhere() -> None:
    longer = changes.change_baseline(RIG, 0.5)
    assert longer.baseline_mm == pytest.approx(1.005 * RIG.baseline_mm)
    np.testing.assert_array_equal(longer.right_from_left.rotation, RIG.right_from_left.rotation)
    higher = changes.change_place(1)(RIG, 0.2)
    away_mm = higher.right_from_left.translation_mm - RIG.right_from_left.translation_mm
    np.testing.assert_allclose(away_mm, [0.0, 0.2, 0.0], atol=1e-12)


@pytest.mark.parametrize(
    "change",
    [changes.change_camera("left", "fx"), changes.change_camera("right", "p1"),
     changes.change_both_focal, changes.change_turn(1), changes.change_place(2),
     changes.change_baseline],
)  # fmt: skip
def test_a_rig_at_the_usual_level_is_the_true_one(change) -> None:
    assert change(RIG, 0.0).rig_id == RIG.rig_id
    assert change(RIG, 0.1).rig_id != RIG.rig_id


def test_a_plan_of_another_scale_is_larger_about_the_bones_middle() -> None:
    scaled = changes.scale_plan(PLAN, 10.0, NONE_MM)
    middle = MESH.centroid_mm
    np.testing.assert_allclose(
        scaled.bones["femur"].mesh.vertices_mm - middle, 1.1 * (MESH.vertices_mm - middle)
    )
    target = scaled.targets["femur/notch"]
    np.testing.assert_allclose(target - middle, 1.1 * (TARGETS["femur/notch"] - middle))
    np.testing.assert_array_equal(scaled.targets["tibia/rim"], TARGETS["tibia/rim"])
    assert scaled.bones["tibia"] is PLAN.bones["tibia"]
    assert scaled.digest != PLAN.digest


def test_a_surface_beside_its_targets() -> None:
    shifted = changes.shift_plan(PLAN, 2.0, NONE_MM)
    moved_mm = shifted.bones["femur"].mesh.vertices_mm - MESH.vertices_mm
    np.testing.assert_allclose(np.linalg.norm(moved_mm, axis=1), 2.0)
    np.testing.assert_array_equal(shifted.targets["femur/notch"], TARGETS["femur/notch"])


def test_a_surface_outside_the_bones() -> None:
    grown = changes.grow_plan(PLAN, 0.5, NONE_MM).bones["femur"].mesh
    np.testing.assert_allclose(grown.vertices_mm, MESH.vertices_mm + 0.5 * MESH.normals)
    assert grown.volume_mm3() > MESH.volume_mm3()


def test_a_thickness_is_misjudged_where_there_is_cartilage_and_stays_one() -> None:
    true_mm = np.array([0.0, 2.0, 0.3, 1.0])
    planned = changes.misjudge_cartilage(0.4)(PLAN, -0.5, true_mm).bones["femur"]
    np.testing.assert_allclose(planned.cartilage_mm, [0.0, 1.5, 0.0, 0.5])
    np.testing.assert_allclose(planned.cartilage_sd_mm, [0.0, 0.4, 0.4, 0.4])
    np.testing.assert_array_equal(planned.mesh.vertices_mm, MESH.vertices_mm)
