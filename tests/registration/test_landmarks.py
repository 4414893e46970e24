import numpy as np
import pytest

from navapp.errors import InputError
from navapp.geometry.transform import RigidTransform, rotation_angle_deg, rotation_from_vector
from navapp.registration import register_landmarks

BONE = np.array([(0.0, 0, 0), (70, 5, 0), (30, 40, 12), (35, -20, 30)])
TRUE = RigidTransform.from_parts(
    "left", "femur", rotation_from_vector((0.7, -0.4, 1.9)), (20.0, -10.0, 450.0)
)


@pytest.mark.parametrize("n", [3, 4])
def test_exact_landmarks_give_the_pose(n: int) -> None:
    found = register_landmarks(BONE[:n], TRUE.apply(BONE[:n]))
    np.testing.assert_allclose(found.scene_from_bone.matrix, TRUE.matrix, atol=1e-9)
    assert found.scene_from_bone.name == "left_from_femur"
    np.testing.assert_allclose(found.residual_mm, np.zeros(n), atol=1e-9)


def test_the_residual_points_at_the_wrong_landmark() -> None:
    scene = TRUE.apply(BONE)
    scene[1] += (0.0, 6.0, 0.0)
    found = register_landmarks(BONE, scene)
    assert found.residual_mm.argmax() == 1
    assert found.residual_mm[1] > 1.0
    assert rotation_angle_deg(found.scene_from_bone, TRUE) < 10.0


def test_a_mirrored_bone_never_becomes_a_reflection() -> None:
    found = register_landmarks(BONE * (-1, 1, 1), TRUE.apply(BONE))
    assert np.linalg.det(found.scene_from_bone.rotation) == pytest.approx(1.0)
    assert found.residual_mm.max() > 5.0


@pytest.mark.parametrize(
    ("bone", "scene", "said"),
    [
        (BONE[:2], BONE[:2], "2 pairs of landmarks fix no pose"),
        (BONE, BONE[:3], "are no pairs"),
        (BONE[:, :2], BONE[:, :2], "are no pairs"),
        (np.outer(np.arange(4), (1, 2, 3)), BONE, "of the bone lie on one line"),
        (BONE, np.outer(np.arange(4), (1, 2, 3)), "of the scene lie on one line"),
        (np.zeros((3, 3)), BONE[:3], "of the bone lie on one line"),
        (np.where(BONE == 70, np.nan, BONE), BONE, "not finite"),
    ],
)
def test_what_fixes_no_pose_is_refused(bone, scene, said: str) -> None:
    with pytest.raises(InputError, match=said):
        register_landmarks(bone, scene)
