"""A rough pose from landmarks that were picked in the left picture."""

import numpy as np
import pytest

from navapp.geometry.transform import RigidTransform
from navapp.tracking.picked_landmarks import find_rough_poses, fit_poses, measure_picks_mm
from navapp.values import Pick, Prior, Status
from tests.pictures import Pictures
from tests.registration.shapes import TRUE
from tests.tracking.rooms import GOAL, room

POINTS_MM = np.array([[30.0, 0.0, 5.0], [-30.0, 4.0, 0.0], [2.0, 25.0, -8.0], [0.0, -5.0, 20.0]])


def picked(n: int, error_px: float = 0.0, error_mm: float = 0.0) -> tuple[Pick, ...]:
    """Places of the room's femur that are bare, far from each other."""
    a = room()
    truth, mesh = a.truth(a.frames[0]), a.tracker.model.bone.mesh
    seen = mesh.vertices_mm[mesh.visible_vertices(truth)]
    bare = seen[seen[:, 2] < mesh.vertices_mm[:, 2].min() + 8.0]
    chosen = [bare[bare[:, 0].argmax()]]
    while len(chosen) < n:
        apart = np.linalg.norm(bare[:, None] - np.array(chosen), axis=2).min(axis=1)
        chosen.append(bare[apart.argmax()])
    rng = np.random.default_rng(8)
    pixels = a.rig.left.project(truth.apply(np.array(chosen))) + rng.normal(0, error_px, (n, 2))
    return tuple(
        Pick(str(k), "femur", (float(u), float(v)), point + rng.normal(0.0, error_mm, 3))
        for k, ((u, v), point) in enumerate(zip(pixels, chosen, strict=True))
    )


def test_points_without_error_give_the_pose() -> None:
    (found,) = fit_poses(TRUE.apply(POINTS_MM), POINTS_MM, "femur")
    np.testing.assert_allclose(found.matrix, TRUE.matrix, atol=1e-9)
    assert (found.target, found.source) == ("left", "femur")


def test_three_points_are_enough_and_never_mirrored() -> None:
    (found,) = fit_poses(TRUE.apply(POINTS_MM[:3]), POINTS_MM[:3], "femur")
    np.testing.assert_allclose(found.matrix, TRUE.matrix, atol=1e-9)


def test_points_on_a_line_leave_the_turn_about_it_to_be_tried() -> None:
    line_mm = np.linspace(-30.0, 30.0, 4)[:, None] * [0.6, 0.0, 0.8] + [5.0, 2.0, 1.0]
    found = fit_poses(TRUE.apply(line_mm), line_mm, "femur")
    assert len(found) == 12
    for pose in found:
        np.testing.assert_allclose(pose.apply(line_mm), TRUE.apply(line_mm), atol=1e-6)
    off_deg = [turn_deg(pose, TRUE) for pose in found]
    assert min(off_deg) <= 15.0
    assert max(off_deg) >= 165.0


def turn_deg(a: RigidTransform, b: RigidTransform) -> float:
    cosine = (np.trace(a.rotation.T @ b.rotation) - 1.0) / 2.0
    return float(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))))


def test_picks_are_measured_where_the_bone_is() -> None:
    a = room()
    frame, picks = a.frames[0], picked(15)
    found = measure_picks_mm(frame, picks, a.tracker.meter)
    true = a.truth(frame).apply(np.array([pick.model_mm for pick in picks]))
    # At the rim of the bone what lies behind it is matched as well.
    assert np.median(np.linalg.norm(found - true, axis=1)) < 1.5


def test_without_texture_nothing_is_measured_and_no_pose_made() -> None:
    a = room()
    dark = np.zeros_like(a.frames[0].left)
    assert np.isnan(measure_picks_mm(Pictures(dark, dark), picked(3), a.tracker.meter)).all()
    assert find_rough_poses(Pictures(dark, dark), picked(3), a.tracker.meter) == []
    found = a.tracker.register(Pictures(dark, dark), Prior(picks=picked(3)), GOAL)
    assert all(one.verdict.status is Status.LOST for one in found)


@pytest.mark.slow
def test_three_picks_with_a_persons_error_find_the_bone() -> None:
    a = room()
    frame, picks = a.frames[0], picked(3, 6.0, 3.0)
    best = a.tracker.register(frame, Prior(picks=picks), GOAL)[0]
    assert best.verdict.status is Status.OK
    assert best.left_from_bone is not None
    assert a.error_mm(best.left_from_bone, frame) < 0.3


def test_picks_of_another_bone_or_too_few_are_no_start() -> None:
    assert Prior(picks=picked(3)).has_start("femur")
    assert not Prior(picks=picked(3)).has_start("tibia")
    assert not Prior(picks=picked(3)[:2]).has_start("femur")
