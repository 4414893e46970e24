"""How measured points lie about a face."""

from types import SimpleNamespace

import numpy as np
import pytest

from navapp.face_tracking.face_plane import FaceHeights
from navapp.geometry.transform import RigidTransform, rotation_from_vector
from navapp.values import MeasuredFace, ResectionPlane

PLANE = ResectionPlane("patella", np.zeros(3), np.array([0.0, 0.0, 1.0]))
FACE = MeasuredFace(PLANE, np.array([0.0, 0.0, 0.5]), 1e-4 * np.eye(3), 1.0)


def seen(tilt_rad: float) -> RigidTransform:
    """The face towards the camera, tilted."""
    turn = rotation_from_vector((np.pi - tilt_rad, 0.0, 0.0))
    return RigidTransform.from_parts("left_rect", "patella", turn, (0.0, 0.0, 400.0))


def measured(points_mm: np.ndarray) -> SimpleNamespace:
    sigma_mm = np.full(len(points_mm), 0.1, dtype=np.float32)
    return SimpleNamespace(cloud=SimpleNamespace(points_mm=points_mm, sigma_ray_mm=sigma_mm))


@pytest.mark.parametrize("tilt_rad", [0.0, 0.6])
def test_heights_are_over_the_face_and_their_errors_lie_along_the_rays(tilt_rad: float) -> None:
    rng, pose = np.random.default_rng(1), seen(tilt_rad)
    flat_mm = np.column_stack([rng.uniform(-5.0, 5.0, (200, 2)), np.full(200, 0.5)])
    flat_mm[:, 2] += rng.normal(0.0, 0.1, 200)
    flat_mm[0, 2] = 9.0
    heights = FaceHeights.of(measured(pose.apply(flat_mm)), FACE, pose, 1.5)
    assert len(heights.height_mm) == 199
    np.testing.assert_allclose(heights.height_mm, flat_mm[1:, 2] - 0.5, atol=1e-9)
    np.testing.assert_allclose(heights.sigma_mm, 0.15 * np.cos(tilt_rad), rtol=0.02)
    np.testing.assert_allclose(heights.less(np.full(199, 0.1)).height_mm, heights.height_mm - 0.1)
    told = heights.describe(pose, np.eye(6))
    assert told.expected_rms_mm == pytest.approx(0.15 * np.cos(tilt_rad), rel=0.02)
    assert 0.08 < told.rms_mm < 0.11


def test_a_few_points_are_no_face() -> None:
    pose = seen(0.0)
    few_mm = pose.apply(np.column_stack([np.arange(59.0), np.zeros(59), np.full(59, 0.5)]))
    assert FaceHeights.of(measured(few_mm), FACE, pose, 1.0) is None


def test_what_lies_off_the_others_weighs_little() -> None:
    heights = FaceHeights(np.zeros((100, 3)), np.full(100, 0.05), np.full(100, 0.1))
    heights.height_mm[0] = 2.0
    assert heights.weight[0] < 1e-6 < 0.5 < heights.weight[1]
