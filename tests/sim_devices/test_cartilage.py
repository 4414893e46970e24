import numpy as np
import pytest

from navapp.errors import UsageError
from sim_devices.anatomy import KneeSpec, make_knee
from sim_devices.cartilage import (
    compute_articular_weight,
    make_cartilage_thickness_mm,
    make_worn_patch,
    smoothstep,
    wear_patch,
    with_cartilage,
    with_defect,
)

BONES = ("femur", "tibia", "patella")


@pytest.fixture(scope="module")
def knee():
    return make_knee(KneeSpec(3))


@pytest.mark.release
@pytest.mark.parametrize("bone", BONES)
@pytest.mark.parametrize("mean_mm", [0.8, 2.2])
def test_thickness_has_its_mean_on_the_joint_surface_and_is_nowhere_else(knee, bone, mean_mm):
    thickness = make_cartilage_thickness_mm(knee, bone, mean_mm, 1)
    weight = compute_articular_weight(knee, bone)
    articular = thickness[weight > 0.5]
    assert articular.mean() == pytest.approx(mean_mm, rel=0.01)
    assert 0.08 < articular.std() / mean_mm < 0.45
    assert thickness.min() >= 0.0
    assert thickness.max() <= 3.2
    assert (thickness[weight == 0.0] == 0.0).all()
    assert 0.05 < (weight > 0.5).mean() < 0.5


def test_the_femur_s_cartilage_covers_condyles_and_trochlea_but_not_shaft_and_epicondyles(knee):
    from scipy.spatial import cKDTree

    weight = compute_articular_weight(knee, "femur")
    tree = cKDTree(knee.bones["femur"].vertices_mm)
    for name in ("medial_condyle", "lateral_condyle", "trochlea", "medial_posterior_condyle"):
        assert weight[tree.query(knee.landmarks[f"femur/{name}"])[1]] > 0.9
    for name in ("medial_epicondyle", "lateral_epicondyle", "anterior_cortex"):
        assert weight[tree.query(knee.landmarks[f"femur/{name}"])[1]] == 0.0


def test_thickness_changes_smoothly(knee):
    mesh = knee.bones["femur"]
    thickness = make_cartilage_thickness_mm(knee, "femur", 2.0, 1)
    along_edges = np.abs(thickness[mesh.faces[:, 0]] - thickness[mesh.faces[:, 1]])
    assert np.percentile(along_edges, 99) < 1.0


def test_a_left_knee_is_covered_like_a_right_one(knee):
    left = make_knee(KneeSpec(3, "left"))
    for bone in BONES:
        np.testing.assert_allclose(
            compute_articular_weight(left, bone), compute_articular_weight(knee, bone), atol=1e-9
        )


def test_seeds_differ_and_repeat(knee):
    first = make_cartilage_thickness_mm(knee, "femur", 2.0, 1)
    np.testing.assert_array_equal(first, make_cartilage_thickness_mm(knee, "femur", 2.0, 1))
    assert np.abs(first - make_cartilage_thickness_mm(knee, "femur", 2.0, 2)).max() > 0.2


def test_without_cartilage_the_bone_itself_is_seen(knee):
    mesh = knee.bones["femur"]
    thickness = make_cartilage_thickness_mm(knee, "femur", 0.0, 1)
    assert with_cartilage(mesh, thickness) is mesh


def test_cartilage_lies_its_thickness_outside_the_bone(knee):
    mesh = knee.bones["femur"]
    thickness = make_cartilage_thickness_mm(knee, "femur", 2.0, 1)
    covered = with_cartilage(mesh, thickness)
    assert covered.volume_mm3() > mesh.volume_mm3()
    moved = np.linalg.norm(covered.vertices_mm - mesh.vertices_mm, axis=1)
    np.testing.assert_allclose(moved, thickness, atol=1e-9)
    outside = knee.solids["femur"](covered.vertices_mm)
    full = thickness > 1.0
    assert np.median(np.abs(outside[full] - thickness[full])) < 0.25


def test_a_defect_is_bare_in_its_middle_and_whole_beyond_its_border(knee):
    mesh, centre = knee.bones["femur"], knee.landmarks["femur/medial_condyle"]
    thickness = make_cartilage_thickness_mm(knee, "femur", 2.0, 1)
    distance = np.linalg.norm(mesh.vertices_mm - centre, axis=1)
    left_over = wear_patch(mesh, thickness, centre, 10.0)
    assert (left_over[distance < 8.0] == 0.0).all()
    np.testing.assert_array_equal(left_over[distance > 12.0], thickness[distance > 12.0])
    surface = with_defect(mesh, thickness, centre, 10.0)
    np.testing.assert_array_equal(
        surface.vertices_mm[distance < 8.0], mesh.vertices_mm[distance < 8.0]
    )


@pytest.mark.parametrize(("bone", "mean_mm"), [("fibula", 2.0), ("femur", -0.1), ("femur", 4.0)])
def test_what_cannot_be_is_refused(knee, bone, mean_mm):
    with pytest.raises(UsageError):
        make_cartilage_thickness_mm(knee, bone, mean_mm, 1)


def test_smoothstep_rises_or_falls():
    np.testing.assert_allclose(smoothstep(1.0, 3.0, np.array([0.0, 2.0, 4.0])), [0.0, 0.5, 1.0])
    np.testing.assert_allclose(smoothstep(3.0, 1.0, np.array([0.0, 2.0, 4.0])), [1.0, 0.5, 0.0])


def test_the_worn_patch_is_round_its_centre_and_nowhere_else(knee):
    femur, centre = knee.bones["femur"], knee.landmarks["femur/medial_condyle"]
    worn = make_worn_patch(femur, centre, 9.0)
    distance = np.linalg.norm(femur.vertices_mm - centre, axis=1)
    assert worn[distance < 3.0].min() == 1.0
    assert worn[distance > 30.0].max() == 0.0
