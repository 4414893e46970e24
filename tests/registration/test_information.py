from dataclasses import replace

import numpy as np
import pytest

from navapp.geometry.mesh import TriangleMesh
from navapp.registration import BimccSettings, RegistrationModel, Scene, fit_bimcc
from navapp.registration.information import (
    compute_information,
    leaves_direction_free,
)
from navapp.registration.pairing_kernels import Pairs, make_pairs
from navapp.registration.step_kernels import weigh
from tests.reference import bimcc_reference as reference
from tests.registration.kernel_cases import POSE, make_case, measured_pairs
from tests.registration.shapes import (
    TRUE,
    ball_mesh,
    blob_mesh,
    femur,
    grid_mesh,
    seen_cloud,
    tube_mesh,
)

CENTRE = np.array([4.0, -3.0, 8.0])
# The columns of a surface's own axes in the scene, where a pose turns them.
AXES = POSE.rotation.T


def pairs_on(points: np.ndarray, normals: np.ndarray) -> tuple[Pairs, int]:
    pairs = make_pairs(len(points))
    pairs.point[:], pairs.direction[:], pairs.weight[:] = points, normals, 4.0
    return pairs, len(points)


@pytest.mark.kernel
def test_the_covariance_is_the_inverse_of_the_information() -> None:
    pairs, n, measured, _ = measured_pairs(make_case())
    weigh(pairs, n, 1.0, 2.5, 0.0)
    found = compute_information(pairs, n, POSE, CENTRE, 1.0)
    expected = np.linalg.inv(reference.twist_information(measured, pairs.weight[:n], POSE, CENTRE))
    np.testing.assert_allclose(
        found.covariance, expected, rtol=1e-5, atol=1e-6 * np.abs(expected).max()
    )
    np.testing.assert_array_equal(found.covariance, found.covariance.T)
    assert not found.is_degenerate
    assert found.free_in_words() == []


def test_points_that_share_their_errors_count_as_one() -> None:
    pairs, n, _, _ = measured_pairs(make_case())
    weigh(pairs, n, 1.0, 2.5, 0.0)
    alone = compute_information(pairs, n, POSE, CENTRE, 1.0).covariance
    np.testing.assert_allclose(
        compute_information(pairs, n, POSE, CENTRE, 9.0).covariance, 9.0 * alone
    )


def test_a_ball_leaves_three_rotations_free() -> None:
    mesh = ball_mesh(20.0, 1000)
    found = compute_information(
        *pairs_on(mesh.vertices_mm, mesh.vertices_mm / 20.0), POSE, CENTRE, 1.0
    )
    assert len(found.free) == 3
    np.testing.assert_allclose(found.free[:, :3], 0.0, atol=1e-3)
    np.testing.assert_allclose(np.linalg.norm(found.free, axis=1), 1.0)
    assert all(words.startswith("rotation about (") for words in found.free_in_words())


def test_a_plane_leaves_two_translations_and_a_rotation_free() -> None:
    points = np.random.default_rng(1).uniform(-20.0, 20.0, (400, 3)) * (1.0, 1.0, 0.0)
    found = compute_information(
        *pairs_on(points, np.tile([0.0, 0.0, 1.0], (400, 1))), POSE, CENTRE, 1.0
    )
    assert len(found.free) == 3
    words = sorted(words.split(" (")[0] for words in found.free_in_words())
    assert words == ["rotation about", "translation along", "translation along"]
    # Whatever is free keeps the plane where it is: shifts across its normal, turns about it.
    shifts, turns = found.free[:, :3], found.free[:, 3:]
    np.testing.assert_allclose(shifts @ AXES[2], 0.0, atol=1e-6)
    np.testing.assert_allclose(turns @ AXES[:2].T, 0.0, atol=1e-6)
    assert not np.isfinite(np.diag(found.covariance)).any()


def test_a_tube_leaves_a_rotation_and_a_translation_free() -> None:
    mesh = tube_mesh(20.0, 30.0)
    found = compute_information(*pairs_on(mesh.vertices_mm, mesh.normals), POSE, CENTRE, 1.0)
    assert len(found.free) == 2
    words = found.free_in_words()
    assert sorted(w.split(" (")[0] for w in words) == ["rotation about", "translation along"]
    # Both about the tube's axis, written with its largest component positive.
    axis = AXES[1] * np.sign(AXES[1][np.abs(AXES[1]).argmax()])
    x, y, z = (round(float(value), 2) + 0.0 for value in axis)
    assert {w.split(" (")[1] for w in words} == {f"{x:g}, {y:g}, {z:g})"}


def test_a_bone_and_a_bowl_leave_nothing_free_or_a_turn() -> None:
    bone = blob_mesh()
    assert not compute_information(
        *pairs_on(bone.vertices_mm, bone.normals), POSE, CENTRE, 1.0
    ).is_degenerate
    bowl = grid_mesh(lambda x, y: 0.02 * (x * x + y * y), 30.0)
    free = compute_information(*pairs_on(bowl.vertices_mm, bowl.normals), POSE, CENTRE, 1.0).free
    assert len(free) == 1
    np.testing.assert_allclose(np.abs(free[0, 3:] @ AXES[2]), 1.0, atol=1e-3)


@pytest.mark.parametrize("mesh", [blob_mesh(), grid_mesh(lambda x, y: 0.02 * (x * x + y * y), 30)])
def test_a_covariance_leaves_free_what_the_pairs_leave_free(mesh) -> None:
    # So that the inverse exists whatever the surface leaves free.
    normals = mesh.normals + np.random.default_rng(2).normal(0.0, 0.03, mesh.normals.shape)
    found = compute_information(*pairs_on(mesh.vertices_mm, normals), POSE, CENTRE, 1.0)
    seen_mm = POSE.rotation @ mesh.vertices_mm.T
    centre_mm = POSE.rotation @ CENTRE
    covariance = found.covariance
    assert leaves_direction_free(covariance, centre_mm, seen_mm.T) == found.is_degenerate
    # The turn about its own axis that a bowl leaves free is fixed by whatever knows of it.
    information = np.linalg.inv(covariance)
    axis = POSE.rotation[:, 2]
    turn = np.concatenate([np.zeros(3), axis])
    fixed = information + 0.05 * np.trace(information[3:, 3:]) * np.outer(turn, turn)
    assert not leaves_direction_free(np.linalg.inv(fixed), centre_mm, seen_mm.T)


def test_a_single_point_fixes_one_direction_of_six() -> None:
    points, normals = np.tile(CENTRE, (80, 1)), np.tile([0.0, 0.0, 1.0], (80, 1))
    found = compute_information(*pairs_on(points, normals), POSE, CENTRE, 1.0)
    assert len(found.free) == 5
    assert not np.isfinite(np.diag(found.covariance)).any()


def on_model(points_mm: np.ndarray, sigma_ray_mm: np.ndarray) -> Scene:
    """Points that tell the size, as those that were measured on a model."""
    return Scene(points_mm, np.zeros(3), sigma_ray_mm, tells_shape=True)


@pytest.mark.parametrize("size", [0.97, 1.0, 1.03])
def test_the_size_of_a_bone_is_told_beside_its_pose(size: float) -> None:
    """At the rms distance of what is seen from its middle, in mm."""
    own = femur()
    cloud = seen_cloud(own, 2500, 0.1)
    points = cloud.points_mm - TRUE.translation_mm
    scene = on_model(TRUE.translation_mm + size * points, cloud.sigma_ray_mm)
    found = fit_bimcc(scene, RegistrationModel(own), TRUE)
    lever_mm = np.sqrt(((points - points.mean(axis=0)) ** 2).sum(axis=1).mean())
    assert found.sized.growth_sigma_mm < 0.05
    # A kernel makes less of what lies far off: what is found is a little smaller.
    assert found.sized.growth_mm == pytest.approx((size - 1.0) * lever_mm, rel=0.3, abs=0.03)


@pytest.mark.parametrize("size", [0.97, 1.03])
def test_a_model_of_the_seen_size_would_lie_where_the_twist_says(size: float) -> None:
    own = femur()
    cloud = seen_cloud(own, 2500, 0.1)
    scene = on_model(cloud.points_mm, cloud.sigma_ray_mm)
    centre_mm = own.mesh.centroid_mm
    grown = TriangleMesh(centre_mm + size * (own.mesh.vertices_mm - centre_mm), own.mesh.faces)
    # A kernel so wide that all points count, however far off they are.
    found = fit_bimcc(
        scene, RegistrationModel(replace(own, mesh=grown)), TRUE, BimccSettings(narrowest_mm=20.0)
    )
    moved = found.camera_from_bone.move(
        found.sized.twist_at(np.zeros(3)), found.camera_from_bone.apply(centre_mm)
    )
    off_mm, left_mm = (
        float(np.linalg.norm(one.apply(centre_mm) - TRUE.apply(centre_mm)))
        for one in (found.camera_from_bone, moved)
    )
    assert off_mm > 0.5
    assert left_mm < 0.3 * off_mm


def test_one_side_of_a_plane_has_no_size() -> None:
    points = np.random.default_rng(1).uniform(-20.0, 20.0, (400, 3)) * (1.0, 1.0, 0.0)
    bent = np.tile([0.0, 0.0, 1.0], (400, 1))
    bent[:, :2] = np.random.default_rng(2).normal(0.0, 1e-3, (400, 2))
    found = compute_information(*pairs_on(points, bent), POSE, CENTRE, 1.0, tells_size=True)
    # As before anything was seen: some per cent at the lever.
    assert found.sized.growth_mm == pytest.approx(0.0, abs=1e-6)
    assert found.sized.growth_sigma_mm == pytest.approx(0.05 * found.sized.lever_mm, rel=0.05)


def test_a_free_measurement_tells_no_size() -> None:
    mesh = blob_mesh()
    pairs = pairs_on(mesh.vertices_mm, mesh.normals)
    assert compute_information(*pairs, POSE, CENTRE, 1.0).sized is None
    assert compute_information(*pairs, POSE, CENTRE, 1.0, tells_size=True).sized is not None
