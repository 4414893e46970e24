from functools import cache

import numpy as np
import pytest

from navapp.geometry.zbuffer import render_rectified
from navapp.registration import DepthMap, PoseSampler, is_same_pose
from navapp.registration.score_kernels import Optics, SurfacePoints, score_poses
from navapp.values import DisparityMap, Origin
from tests.reference import pose_sampler_reference as reference
from tests.registration.shapes import GEOMETRY, TRUE, femur, femur_for_registration
from tests.views import project_box

CENTRE_MM = femur().mesh.centroid_mm


@cache
def sampler() -> PoseSampler:
    return PoseSampler(femur_for_registration())


def seen_map(noise_mm: float = 0.1) -> DisparityMap:
    """What stereo would measure of the bone at `TRUE`."""
    box = project_box(femur().mesh, TRUE, GEOMETRY)
    depth = render_rectified(femur().mesh, TRUE, GEOMETRY, box).depth_mm
    noise = noise_mm * np.random.default_rng(3).standard_normal(depth.shape)
    is_there = np.isfinite(depth)
    disparity = np.where(is_there, GEOMETRY.focal_px * GEOMETRY.baseline_mm / (depth + noise), 0)
    return DisparityMap(
        disparity.astype(np.float32),
        np.full(depth.shape, 0.1, np.float32),
        np.where(is_there, Origin.MATCHED, Origin.UNKNOWN).astype(np.uint8),
        box.x,
        box.y,
    )


@pytest.mark.kernel
def test_scores_as_the_reference() -> None:
    rng = np.random.default_rng(0)
    normals = rng.standard_normal((60, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    surface = SurfacePoints(rng.uniform(-20, 20, (60, 3)), normals, rng.uniform(0.0, 0.2, 60))
    depth = rng.uniform(395, 405, (40, 50)).astype(np.float32)
    depth[rng.random(depth.shape) < 0.2] = 0
    optics = Optics(400.0, 24.0, 19.0, 80.0)
    turn = np.linalg.qr(rng.standard_normal((4, 3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))[:, None, None]
    shifts = rng.uniform(-2, 2, (4, 3)) + np.array([0.0, 0.0, 400.0])
    found = np.full(4, np.nan)
    score_poses(surface, 60, turn, shifts, DepthMap(depth, optics), 1.5, found, (1, 4))
    assert np.isnan(found[0])
    for k in range(1, 4):
        expected = reference.score(turn[k], shifts[k], surface, depth, optics, 1.5)
        assert found[k] == pytest.approx(expected, abs=1e-9)
    assert len(set(found[1:])) == 3


def test_a_rough_pose_leads_to_the_true_one() -> None:
    depth = DepthMap.of(GEOMETRY, seen_map())
    rough = TRUE.move((12.0, -9.0, 5.0, 0.12, -0.1, 0.08), TRUE.apply(CENTRE_MM))
    best = sampler().search(depth, rough, 4)[0]
    assert is_same_pose(best.scene_from_bone, TRUE, femur_for_registration().centre_mm)
    assert best.score > sampler().score(depth, rough, 0.3, 3000) + 0.2


def test_what_is_seen_through_costs() -> None:
    depth = DepthMap.of(GEOMETRY, seen_map())
    ray = TRUE.apply(CENTRE_MM) / TRUE.apply(CENTRE_MM)[2]
    nearer, further = (
        TRUE.move((*(shift_mm * ray), 0.0, 0.0, 0.0), np.zeros(3)) for shift_mm in (-20.0, 20.0)
    )
    true, before, behind = (
        sampler().score(depth, pose, 0.3, 3000) for pose in (TRUE, nearer, further)
    )
    assert before < -0.5 < behind < 0.3 < true


def test_only_what_is_matched_has_a_depth() -> None:
    origin = np.full((6, 8), Origin.MATCHED, np.uint8)
    origin[5] = Origin.FILLED_BORDER
    values = np.full((6, 8), 200.0, np.float32)
    values[0, 0] = np.nan
    depth = DepthMap.of(GEOMETRY, DisparityMap(values, values, origin, 100, 50))
    expected = np.full((6, 8), GEOMETRY.focal_px * GEOMETRY.baseline_mm / 200.0)
    expected[5] = expected[0, 0] = 0.0
    np.testing.assert_allclose(depth.depth_mm, expected, rtol=1e-6)
    assert (depth.optics.centre_x_px, depth.optics.centre_y_px) == (540.0, 310.0)


@pytest.mark.release
def test_the_same_map_gives_the_same_bits() -> None:
    depth = DepthMap.of(GEOMETRY, seen_map())
    first, second = (sampler().search(depth, TRUE, 1)[0].scene_from_bone for _ in range(2))
    assert first.matrix.tobytes() == second.matrix.tobytes()
