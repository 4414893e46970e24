"""What two poses say of the limb: gaps on both sides, their bounds, and what is not known."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from navapp.geometry.mesh import TriangleMesh, join_meshes
from navapp.geometry.transform import RigidTransform
from navapp.limb import BoneSurface, LimbMeter
from navapp.limb.gaps import GapMeter, cover_with_points
from navapp.values import BoneModel, Plan, SurgicalContent
from sim_devices.anatomy import KneeSpec, make_knee
from tests.geometry.shapes import sphere
from tests.limb.knees import camera_from_femur, estimate, landmarks

APART = RigidTransform.from_parts("femur", "tibia", np.eye(3), (0.0, 0.0, -4.0))


def balls(x_mm: float):
    """Two balls side by side, 40 mm apart."""
    return join_meshes(*(sphere(10.0, 48, (x, 0.0, 0.0)) for x in (-x_mm, x_mm)))


@pytest.mark.parametrize("side", ["right", "left"])
def test_each_side_has_its_own_gap(side) -> None:
    meter = GapMeter(balls(20.0), balls(20.0), 0.0, side)
    femur = camera_from_femur()
    lean = RigidTransform.from_parts("femur", "tibia", np.eye(3), (0.0, 0.0, -24.0)).move(
        (0.0, 0.0, 0.0, 0.0, np.radians(2.0), 0.0), (0.0, 0.0, -24.0)
    )
    gaps = meter.measure(estimate(femur), estimate(femur @ lean), (np.zeros(3), np.zeros(3)))
    wide, narrow = ("medial", "lateral") if side == "right" else ("lateral", "medial")
    assert gaps[wide].mm == pytest.approx(4.7, abs=0.15)
    assert gaps[narrow].mm == pytest.approx(3.3, abs=0.15)


def test_a_gap_is_as_unsure_as_its_two_points() -> None:
    meter = GapMeter(balls(20.0), balls(20.0), 0.0, "right")
    femur = camera_from_femur()
    away = RigidTransform.from_parts("femur", "tibia", np.eye(3), (0.0, 0.0, -25.0))
    covariance = np.diag([0.01, 0.01, 0.01, 0.0, 0.0, 0.0])
    found = meter.measure(
        estimate(femur, covariance), estimate(femur @ away, covariance), (np.zeros(3), np.zeros(3))
    )
    assert found["medial"].bound_mm == pytest.approx(1.96 * 0.1 * 2**0.5)
    covariance[3:, 3:] = np.radians(0.5) ** 2 * np.eye(3)
    turned = meter.measure(
        estimate(femur, covariance), estimate(femur @ away, covariance), (np.zeros(3), np.zeros(3))
    )
    assert turned["medial"].bound_mm > 1.96 * 20.0 * np.radians(0.5)


def test_the_face_of_a_cut_is_covered_with_points() -> None:
    corners = np.array([(0.0, 0.0, 0.0), (30.0, 0.0, 0.0), (0.0, 30.0, 0.0), (30.0, 30.0, 0.0)])
    points_mm, normals = cover_with_points(TriangleMesh(corners, [[0, 1, 2], [1, 3, 2]]))
    rng = np.random.default_rng(2)
    asked_mm = np.column_stack([rng.uniform(0.0, 30.0, (200, 2)), np.zeros(200)])
    assert cKDTree(points_mm).query(asked_mm)[0].max() < 0.8
    assert np.ptp(points_mm, axis=0) == pytest.approx((30.0, 30.0, 0.0))
    np.testing.assert_allclose(np.abs(normals), np.tile((0.0, 0.0, 1.0), (len(points_mm), 1)))


def test_surfaces_that_overlap_have_a_gap_below_zero_as_deep_as_they_do() -> None:
    meter = GapMeter(balls(20.0), balls(20.0), 0.0, "right")
    femur = camera_from_femur()
    for depth_mm in (0.2, 0.5, 3.0):
        into = RigidTransform.from_parts("femur", "tibia", np.eye(3), (0.0, 0.0, depth_mm - 20.0))
        gaps = meter.measure(estimate(femur), estimate(femur @ into), (np.zeros(3),) * 2)
        for gap in gaps.values():
            assert gap.mm == pytest.approx(-depth_mm, abs=0.1)


@pytest.mark.release
def test_bones_that_are_pushed_together_overlap_and_the_bound_is_that_of_two_points() -> None:
    bones = make_knee(KneeSpec(1, "right")).bones
    meter = GapMeter(bones["femur"], bones["tibia"], 0.0, "right")
    femur, covariance = camera_from_femur(), np.diag([0.01, 0.01, 0.01, 0.0, 0.0, 0.0])
    # Some points of the femur lie almost on the tibia, others deep in it.
    for height_mm in (9.0, 10.0, 11.0):
        into = RigidTransform.from_parts("femur", "tibia", np.eye(3), (0.0, 0.0, height_mm))
        poses = estimate(femur, covariance), estimate(femur @ into, covariance)
        gaps = meter.measure(*poses, (np.zeros(3),) * 2)
        assert gaps["lateral"].mm < -2.0
        # However the nearest point lies beside the one that is deepest.
        assert gaps["lateral"].bound_mm == pytest.approx(1.96 * 0.1 * 2**0.5)


def test_bones_far_apart_have_no_gap() -> None:
    meter = GapMeter(balls(20.0), balls(20.0), 0.0, "right")
    femur = camera_from_femur()
    away = RigidTransform.from_parts("femur", "tibia", np.eye(3), (0.0, 0.0, -90.0))
    assert meter.measure(estimate(femur), estimate(femur @ away), (np.zeros(3),) * 2) == {}


def plan(side="right", known=None) -> Plan:
    bones = make_knee(KneeSpec(1, side)).bones
    content = SurgicalContent(landmarks=landmarks(side or "right") if known is None else known)
    return Plan(
        {name: BoneModel(name, bones[name], side) for name in ("femur", "tibia")}, content=content
    )


def measure(one: Plan, **of_femur):
    femur = camera_from_femur()
    meshes = one.bones["femur"].mesh, one.bones["tibia"].mesh
    surfaces = BoneSurface(meshes[0], **of_femur), BoneSurface(meshes[1])
    return LimbMeter(one).measure(estimate(femur), estimate(femur @ APART), surfaces)


def test_a_limb_with_all_axes_has_angles_and_gaps() -> None:
    found = measure(plan())
    assert found.missing is None
    assert found.angles.flexion_deg == pytest.approx(0.0)
    assert set(found.gaps) == {"medial", "lateral"}


def test_without_a_hip_the_gaps_are_left() -> None:
    known = {name: one for name, one in landmarks().items() if name != "femur/hip_centre"}
    found = measure(plan(known=known))
    assert found.angles is None
    assert found.missing == "no hip centre in the plan"
    assert set(found.gaps) == {"medial", "lateral"}


def test_a_bone_that_is_not_known_has_no_gap() -> None:
    found = measure(plan(), unknown="cut femur_distal is not measured")
    assert found.gaps == {}
    assert found.angles is not None
    assert found.missing == "cut femur_distal is not measured"


def test_what_is_not_known_of_a_face_is_in_the_bound() -> None:
    exact, unsure = measure(plan()), measure(plan(), bound_mm=0.5)
    for name, gap in unsure.gaps.items():
        known = exact.gaps[name]
        assert gap.mm == known.mm
        assert gap.bound_mm == pytest.approx(np.hypot(known.bound_mm, 0.5))


def test_without_a_side_nothing_is_medial() -> None:
    one = plan()
    sideless = Plan(
        {name: BoneModel(name, bone.mesh) for name, bone in one.bones.items()}, content=one.content
    )
    found = measure(sideless)
    assert (found.angles, found.gaps, found.missing) == (None, {}, "no side in the plan")
