import numpy as np
import pytest

from navapp.evaluation import compute_mean_tre_mm
from navapp.geometry.transform import RigidTransform
from navapp.values import BoneModel
from tests.geometry.shapes import sphere

BONE = BoneModel("femur", sphere(30.0))
TRUE = RigidTransform.from_parts("left", "femur", np.eye(3), [0.0, 0.0, 400.0])
NONE = np.empty((0, 3))


def test_the_truth_has_no_error():
    assert compute_mean_tre_mm(TRUE, TRUE, BONE, np.eye(3)) == 0.0
    assert compute_mean_tre_mm(TRUE, TRUE, BONE, NONE) == 0.0


def test_a_shift_is_an_error_everywhere():
    shifted = TRUE.move([3.0, 0.0, 4.0, 0, 0, 0], np.zeros(3))
    assert compute_mean_tre_mm(shifted, TRUE, BONE, np.eye(3) * 50) == pytest.approx(5.0)
    assert compute_mean_tre_mm(shifted, TRUE, BONE, NONE) == pytest.approx(5.0)


def test_a_turn_is_an_error_that_grows_with_the_distance():
    turned = TRUE.move([0, 0, 0, 0, 0, 0.1], TRUE.translation_mm)
    targets = np.array([[10.0, 0, 0], [0, 30, 5], [0, 0, 50]])
    expected = 2 * np.sin(0.05) * (10 + 30 + 0) / 3
    assert compute_mean_tre_mm(turned, TRUE, BONE, targets) == pytest.approx(expected)


def test_without_targets_the_vertices_visible_at_the_true_pose_count():
    turned = TRUE.move([0, 0, 0, 0, 0.6, 0], TRUE.translation_mm)
    seen = BONE.mesh.vertices_mm[BONE.mesh.visible_vertices(TRUE)]
    assert 0.2 * len(BONE.mesh.vertices_mm) < len(seen) < 0.5 * len(BONE.mesh.vertices_mm)
    assert compute_mean_tre_mm(turned, TRUE, BONE, NONE) == pytest.approx(
        compute_mean_tre_mm(turned, TRUE, BONE, seen), abs=1e-12
    )
    everywhere = compute_mean_tre_mm(turned, TRUE, BONE, BONE.mesh.vertices_mm)
    assert abs(compute_mean_tre_mm(turned, TRUE, BONE, NONE) - everywhere) > 0.5


def test_a_bone_that_shows_nothing_has_no_error():
    inside_out = BoneModel("femur", sphere(30.0, 12).flip())
    far = RigidTransform.from_parts("left", "femur", np.eye(3), [0.0, 0.0, 1e6])
    half = inside_out.mesh.vertices_mm[:, 2] < 0
    kept = inside_out.mesh.faces[half[inside_out.mesh.faces].all(axis=1)]
    bowl = BoneModel("femur", type(BONE.mesh)(inside_out.mesh.vertices_mm, kept))
    assert compute_mean_tre_mm(far, far, bowl, NONE) is None
