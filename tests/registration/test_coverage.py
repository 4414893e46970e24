import numpy as np
import pytest

from navapp.geometry.transform import RigidTransform
from navapp.registration import RegistrationModel, Scene
from navapp.registration.coverage import compute_coverage
from navapp.values import BoneModel
from tests.registration.shapes import (
    TRUE,
    disturbed,
    facing_points,
    femur,
    femur_for_registration,
    grid_mesh,
    seen_scene,
)

MODEL = femur_for_registration()
EYE = np.zeros(3)


def test_a_bone_that_is_seen_whole_is_covered_at_its_pose() -> None:
    points = facing_points(femur(), TRUE)
    assert compute_coverage(Scene(points, EYE), MODEL, TRUE, 0.5) > 0.93


def test_half_of_what_should_be_seen_is_half() -> None:
    points = facing_points(femur(), TRUE)
    half = points[points[:, 0] < np.median(points[:, 0])]
    found = compute_coverage(Scene(half, EYE), MODEL, TRUE, 0.5)
    assert 0.4 < found < 0.68


def test_a_wrong_pose_is_covered_less() -> None:
    scene = seen_scene(1500, 0.3)
    right = compute_coverage(scene, MODEL, TRUE, 0.75)
    wrong = [compute_coverage(scene, MODEL, disturbed(MODEL, 30.0, 8.0, s), 0.75) for s in range(4)]
    assert right > 0.9
    assert max(wrong) < 0.7
    assert compute_coverage(scene, MODEL, disturbed(MODEL, 0.0, 300.0, 1), 0.75) == 0.0


def test_a_narrow_kernel_asks_for_a_near_surface() -> None:
    points = facing_points(femur(), TRUE)
    scene = Scene(points * (1.0 + 2.0 / 470.0), EYE)
    assert compute_coverage(scene, MODEL, TRUE, 3.0) > 0.9
    assert compute_coverage(scene, MODEL, TRUE, 0.5) < 0.2


def test_a_surface_that_turns_its_back_is_not_covered() -> None:
    model = RegistrationModel(BoneModel("plate", grid_mesh(lambda x, y: 0.0 * x)))
    pose = RigidTransform.from_parts(
        "left_rect", "plate", np.diag([1.0, -1.0, -1.0]), (0.0, 0.0, 400.0)
    )
    scene = Scene(pose.apply(model.points_mm), EYE)
    assert compute_coverage(scene, model, pose, 1.0) == 0.0
    front = RigidTransform.from_parts("left_rect", "plate", np.eye(3), (0.0, 0.0, 400.0))
    assert compute_coverage(scene, model, front, 1.0) == 1.0


def test_without_a_camera_there_is_no_coverage() -> None:
    scene = Scene(facing_points(femur(), TRUE))
    with pytest.raises(ValueError, match="seen from"):
        compute_coverage(scene, MODEL, TRUE, 0.5)
