import dataclasses

import numpy as np
import pytest

from navapp.geometry.box import Box
from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.transform import RigidTransform, rotation_from_vector
from navapp.values import (
    BoneModel,
    DisparityMap,
    FrameTimings,
    Origin,
    Plan,
    PoseEstimate,
    Reason,
    SizedPose,
    Status,
    SurfaceCloud,
    TrackedFrame,
    Verdict,
)
from navapp.values import Status as PoseStatus
from tests.geometry.shapes import cube, sphere

POSE = RigidTransform.from_parts(
    "left", "femur", rotation_from_vector([0.4, -0.9, 0.3]), [20.0, -10.0, 420.0]
)


def estimate(covariance):
    return PoseEstimate(POSE, covariance, 1000, 0.9, 0.4, 0.4, 5, True)


def random_covariance(rng):
    root = rng.normal(size=(6, 6)) * np.array([0.3, 0.3, 0.3, 5e-3, 5e-3, 5e-3])[:, None]
    return root @ root.T


@pytest.mark.parametrize("seed", range(6))
def test_the_predicted_error_bounds_the_sampled_one(seed):
    """Twists drawn from the covariance move the targets by less than the bound, 19 times of 20."""
    rng = np.random.default_rng(seed)
    covariance = random_covariance(rng)
    if seed >= 4:
        # One direction alone: the bound must not profit from the others.
        direction = rng.normal(size=6) * [0.5, 0.5, 0.5, 0.01, 0.01, 0.01]
        covariance = np.outer(direction, direction)
    centre, targets = rng.normal(size=3) * 10, rng.normal(size=(5, 3)) * 40
    bound = estimate(covariance).predict_tre_mm(centre, targets)
    twists = rng.multivariate_normal(np.zeros(6), covariance, 2000, method="eigh")
    true = POSE.apply(targets)
    errors = [
        np.linalg.norm(POSE.move(twist, POSE.apply(centre)).apply(targets) - true, axis=1).mean()
        for twist in twists
    ]
    assert np.mean(np.array(errors) <= bound) >= 0.95
    # A bound that is never approached says nothing.
    assert bound < 3.0 * np.quantile(errors, 0.95)


def test_the_predicted_error_of_a_shift_is_its_chi_square_quantile():
    covariance = np.diag([0.01, 0.01, 0.01, 0, 0, 0])
    bound = estimate(covariance).predict_tre_mm(np.zeros(3), np.eye(3) * 70)
    assert bound == pytest.approx(0.1 * np.sqrt(7.815), rel=1e-4)


@pytest.mark.parametrize(("level", "quantile"), [(0.5, 2.366), (0.8, 4.642), (0.99, 11.345)])
def test_the_predicted_error_has_a_level(level, quantile):
    covariance = np.diag([0.01, 0.01, 0.01, 0, 0, 0])
    bound = estimate(covariance).predict_tre_mm(np.zeros(3), np.eye(3) * 70, level)
    assert bound == pytest.approx(0.1 * np.sqrt(quantile), rel=1e-4)


def test_the_predicted_error_grows_with_the_distance_from_the_centre():
    covariance = np.diag([0, 0, 0, 1e-4, 1e-4, 1e-4])
    centre = np.array([5.0, 6.0, 7.0])
    bounds = [
        estimate(covariance).predict_tre_mm(centre, np.add(centre, [[d, 0.0, 0.0]]))
        for d in (0.0, 10.0, 20.0)
    ]
    np.testing.assert_allclose(bounds, np.array([0, 0.1, 0.2]) * np.sqrt(5.991), rtol=1e-4)


def test_a_turn_that_a_shift_undoes_leaves_its_point_without_error():
    """Shift and turn are correlated: the target that they leave in place is certain."""
    target, centre = np.array([[30.0, -5.0, 12.0]]), np.array([5.0, 6.0, 7.0])
    turn = np.array([0.01, -0.02, 0.005])
    offset = POSE.rotate(target[0] - centre)
    twist = np.r_[-np.cross(turn, offset), turn]
    covariance = np.outer(twist, twist)
    assert estimate(covariance).predict_tre_mm(centre, target) < 1e-6
    # On the other side of the centre both add up.
    opposite = estimate(covariance).predict_tre_mm(centre, 2 * centre - target)
    expected = 2 * np.linalg.norm(np.cross(turn, offset)) * np.sqrt(3.841)
    assert opposite == pytest.approx(expected, rel=1e-4)


def sized_estimate():
    """A bone that seems 3 % larger, and would lie elsewhere then."""
    step = np.array([0.2, -0.1, 0.05, 0.004, 0.0, -0.003, 0.6])
    sized = SizedPose(step, np.eye(7), np.array([3.0, -2.0, 8.0]), lever_mm=20.0)
    return dataclasses.replace(estimate(np.diag([1e-4] * 3 + [1e-6] * 3)), sized=sized)


def test_a_seen_size_shifts_each_point_by_itself():
    """As a model that grows about the middle of what is seen, then moves by the twist."""
    found = sized_estimate()
    centre, points = np.array([5.0, 6.0, 7.0]), np.random.default_rng(3).normal(size=(6, 3)) * 30
    middle = POSE.apply(centre) - found.sized.arm_mm
    placed = POSE.apply(points)
    grown = middle + 1.03 * (placed - middle)
    twist = found.sized.step[:6]
    moved = POSE.move(twist, POSE.apply(centre)).apply(POSE.inverse().apply(placed))
    expected = (grown - placed) + (moved - placed)
    offsets = placed - POSE.apply(centre)
    np.testing.assert_allclose(found.sized.shifts_mm(offsets), expected, atol=2e-3)
    covariances = found.predict_covariances(centre, points)
    alone = estimate(found.covariance).predict_covariances(centre, points)
    outer = np.einsum("ni,nj->nij", expected, expected)
    np.testing.assert_allclose(covariances - alone, outer, atol=5e-3)
    at_point = found.covariance_at(offsets[0]) - found.covariance
    shift = found.sized.shifts_mm(offsets[:1])[0] - np.cross(twist[3:], offsets[0])
    np.testing.assert_allclose(at_point, np.outer(*[np.r_[shift, twist[3:]]] * 2), atol=1e-9)


def test_the_predicted_error_of_a_seen_size_is_that_of_one_direction():
    found = dataclasses.replace(sized_estimate(), covariance=np.zeros((6, 6)))
    centre, target = np.zeros(3), np.array([[30.0, -5.0, 12.0]])
    shift = found.sized.shifts_mm(POSE.rotate(target))
    expected = np.linalg.norm(shift) * np.sqrt(3.841)
    assert found.predict_tre_mm(centre, target) == pytest.approx(expected, rel=1e-4)


def test_a_turned_camera_sees_the_same_errors():
    found = sized_estimate()
    centre, points = np.array([5.0, 6.0, 7.0]), np.random.default_rng(3).normal(size=(6, 3)) * 30
    rotation = rotation_from_vector([0.2, 0.5, -0.4])
    turned = found.turn_camera(RigidTransform.from_parts("other", "left", rotation, np.zeros(3)))
    np.testing.assert_allclose(
        turned.predict_covariances(centre, points),
        rotation @ found.predict_covariances(centre, points) @ rotation.T,
        atol=1e-12,
    )
    assert turned.predict_tre_mm(centre, points) == pytest.approx(
        found.predict_tre_mm(centre, points)
    )
    loose = dataclasses.replace(found, covariance=np.diag([np.inf] * 6))
    assert np.isposinf(np.diag(loose.turn_camera(RigidTransform.from_parts(
        "other", "left", rotation, np.zeros(3))).covariance)).all()  # fmt: skip


def test_no_targets_have_no_predicted_error():
    with pytest.raises(ValueError, match="no targets"):
        estimate(np.eye(6)).predict_tre_mm(np.zeros(3), np.empty((0, 3)))


@pytest.mark.kernel
def test_vertices_that_face_the_camera_are_visible():
    ball = sphere(30.0, 24)
    visible = ball.visible_vertices(POSE)
    positions = POSE.apply(ball.vertices_mm)
    normals = (positions - POSE.translation_mm) / 30.0
    cosine = np.einsum("ij,ij->i", normals, -positions) / np.linalg.norm(positions, axis=1)
    assert visible[cosine > 0.21].all()
    assert not visible[cosine < 0.19].any()
    assert not ball.flip().visible_vertices(POSE)[cosine > 0].any()


@pytest.mark.kernel
@pytest.mark.parametrize(
    "mesh",
    [sphere(30.0, 24, (400.0, -150.0, 80.0)), cube(40.0, (-5.0, 20.0, 9.0)), sphere(9.0, 12)],
)
def test_what_is_visible_follows_the_definition(mesh) -> None:
    beyond = RigidTransform.from_parts(
        "left", "femur", POSE.rotation, POSE.translation_mm - POSE.rotate(mesh.centroid_mm[None])[0]
    )
    view, normals = beyond.apply(mesh.vertices_mm), beyond.rotate(mesh.normals)
    expected = np.einsum("ij,ij->i", normals, view) < -0.2 * np.linalg.norm(view, axis=1)
    np.testing.assert_array_equal(mesh.visible_vertices(beyond), expected)
    assert 0.1 < expected.mean() < 0.9


def test_a_bone_fills_in_what_is_not_given():
    bone = BoneModel("femur", cube())
    for values, kind in ((bone.cartilage_mm, float), (bone.is_removed, bool)):
        assert values.shape == (8,)
        assert values.dtype == kind
        assert not values.any()
    assert bone.cartilage_sd_mm.shape == (8,)
    assert (bone.side, bone.version) == (None, 0)


@pytest.mark.parametrize("name", ["cartilage_mm", "cartilage_sd_mm", "is_removed"])
@pytest.mark.parametrize("count", [1, 7, 9])
def test_a_bone_needs_one_value_per_vertex(name, count):
    with pytest.raises(ValueError, match=rf"femur: {name} needs one value per vertex"):
        BoneModel("femur", cube(), **{name: np.ones(count)})


@pytest.mark.parametrize("name", ["cartilage_mm", "cartilage_sd_mm"])
@pytest.mark.parametrize("value", [-0.1, np.nan, np.inf])
def test_cartilage_that_cannot_be_is_refused(name, value):
    values = np.ones(8)
    values[3] = value
    with pytest.raises(ValueError, match=rf"femur: {name} must be finite and not negative"):
        BoneModel("femur", cube(), **{name: values})


@pytest.mark.parametrize("value", [-0.1, np.nan, np.inf])
def test_a_surface_whose_error_cannot_be_is_refused(value):
    with pytest.raises(ValueError, match="surface_sd_mm must be finite and not negative"):
        BoneModel("femur", cube(), surface_sd_mm=value)


def test_a_bone_cannot_be_changed_from_outside():
    thickness = np.ones(8)
    bone = BoneModel("femur", cube(), cartilage_mm=thickness)
    thickness[0] = 5.0
    assert bone.cartilage_mm[0] == 1.0
    with pytest.raises(ValueError, match="read-only"):
        bone.is_removed[0] = True


def make_plan(**changes):
    bone_changes = {
        key: changes.pop(key)
        for key in (
            "mesh",
            "side",
            "cartilage_mm",
            "cartilage_sd_mm",
            "is_removed",
            "surface_sd_mm",
            "version",
        )
        if key in changes
    }
    bone = BoneModel(**{"name": "femur", "mesh": cube(40.0), "side": "left", **bone_changes})
    content = {
        "bones": {"femur": bone},
        "targets": {
            "femur/a": np.array([[1.0, 2, 3]]),
            "femur/b": np.array([[4.0, 5, 6], [7, 8, 9]]),
        },
        "curves": {"nerve": np.array([[0.5, 0.5, 0.5], [1, 1, 1]])},
    }
    return Plan(**{**content, **changes})


def one(n=8, place=3):
    values = np.zeros(n)
    values[place] = 1e-9
    return values


CHANGES = [
    {"mesh": cube(40.000000001)},
    {"mesh": TriangleMesh(cube(40.0).vertices_mm, np.roll(cube().faces, 1, axis=0))},
    {"side": "right"},
    {"side": None},
    {"version": 1},
    {"cartilage_mm": one()},
    {"cartilage_sd_mm": one()},
    {"surface_sd_mm": 0.03},
    {"is_removed": one() > 0},
    {"bones": {"tibia": BoneModel("tibia", cube(40.0), "left")}},
    {"targets": {}},
    {"curves": {}},
    {"targets": {"femur/a": np.array([[1.0, 2, 3.0000001]]), "femur/b": np.ones((2, 3))}},
    {"curves": {"nerve": np.array([[0.5, 0.5, 0.5], [1, 1, 2]])}},
    {"curves": {"artery": np.array([[0.5, 0.5, 0.5], [1, 1, 1]])}},
    # The same points under the other heading, and cut elsewhere.
    {"targets": {}, "curves": {"nerve": np.ones((1, 3))}},
    {"curves": {}, "targets": {"nerve": np.ones((1, 3))}},
    {"targets": {"a": np.frombuffer(b"b" * 24).reshape(1, 3), "b": np.ones((1, 3))}},
    {"targets": {"a": np.frombuffer(b"b" * 24).reshape(1, 3), "bb": np.ones((1, 3))}},
]


def test_the_digest_changes_with_the_content():
    digests = [make_plan().digest, *(make_plan(**change).digest for change in CHANGES)]
    assert len(set(digests)) == len(digests)
    assert all(len(digest) == 12 for digest in digests)


def test_the_digest_is_of_the_content_only():
    plan = make_plan()
    assert make_plan(name="another name").digest == plan.digest
    reversed_targets = dict(reversed(plan.targets.items()))
    assert make_plan(targets=reversed_targets).digest == plan.digest


def test_a_plan_cannot_be_changed_from_outside():
    targets = {"femur/a": np.ones((1, 3))}
    plan = make_plan(targets=targets)
    targets["femur/b"] = np.zeros((1, 3))
    assert set(plan.targets) == {"femur/a"}
    with pytest.raises(TypeError):
        plan.bones["tibia"] = plan.bones["femur"]


def test_targets_are_gathered_in_the_order_asked_for():
    plan = make_plan()
    np.testing.assert_array_equal(
        plan.targets_of(("femur/b", "femur/none", "femur/a")), [[4, 5, 6], [7, 8, 9], [1, 2, 3]]
    )
    assert plan.targets_of(("femur/none",)).shape == (0, 3)
    assert plan.targets_of(()).shape == (0, 3)


@pytest.mark.parametrize("reason", Reason)
def test_every_reason_is_a_phrase_with_a_remedy(reason):
    assert len(reason.remedy) > 10
    for text in (reason.value, reason.remedy):
        assert not text.endswith(".")
        assert text[0].islower()


def test_no_two_reasons_say_the_same():
    assert len({reason.value for reason in Reason}) == len(Reason.__members__)


def test_the_matched_share_counts_measured_pixels_only():
    origin = np.array([[Origin.MATCHED, Origin.FILLED_BORDER], [Origin.UNKNOWN, Origin.MATCHED]])
    empty = np.zeros((2, 2), dtype=np.float32)
    disparity = DisparityMap(empty, empty, origin.astype(np.uint8), 3, 4)
    assert disparity.matched_fraction == 0.5
    nothing = np.empty((0, 0))
    assert dataclasses.replace(disparity, origin=nothing.astype(np.uint8)).matched_fraction == 0.0


def test_a_map_knows_its_place_in_the_picture():
    wide = np.zeros((2, 5), dtype=np.float32)
    assert DisparityMap(wide, wide, wide.astype(np.uint8), 3, 4).box == Box(3, 4, 5, 2)


def test_a_part_of_a_cloud_keeps_its_columns_together():
    cloud = SurfaceCloud(
        np.arange(12.0).reshape(4, 3),
        np.arange(4.0),
        np.arange(8, dtype=np.int32).reshape(4, 2),
        np.arange(4, dtype=np.uint8),
    )
    assert len(cloud) == 4
    for part in (
        cloud.select(np.array([0, 1, 0, 1], dtype=bool)),
        cloud.select(np.array([1, 3])),
    ):
        assert len(part) == 2
        np.testing.assert_array_equal(part.points_mm, [[3, 4, 5], [9, 10, 11]])
        np.testing.assert_array_equal(part.sigma_ray_mm, [1, 3])
        np.testing.assert_array_equal(part.pixels, [[2, 3], [6, 7]])
        np.testing.assert_array_equal(part.origin, [1, 3])


def test_the_total_is_the_sum_of_all_timings():
    in_turn = [one.name for one in dataclasses.fields(FrameTimings) if "beside" not in one.name]
    timings = FrameTimings(**{name: 2.0**i for i, name in enumerate(in_turn)}, fill_beside_ms=0.1)
    assert timings.total_ms == 2.0 ** len(in_turn) - 1.0


def test_a_frame_without_an_estimate_has_no_pose():
    lost = TrackedFrame("femur", None, Verdict(PoseStatus.LOST), FrameTimings())
    assert lost.left_from_bone is None
    found = dataclasses.replace(lost, estimate=estimate(np.eye(6)))
    assert found.left_from_bone is POSE


def test_verdicts_have_an_order() -> None:
    """By status; of equals no guess comes first, then what explains more of the model."""
    degraded = Verdict(Status.DEGRADED, 0.5, (Reason.COVERAGE_LOW,), coverage=0.4)
    more = dataclasses.replace(degraded, coverage=0.5)
    guess = dataclasses.replace(degraded, reasons=(Reason.AMBIGUOUS,), coverage=0.9)
    good, lost = Verdict(Status.OK, 0.3, coverage=0.3), Verdict(Status.LOST, None)
    found = sorted([lost, guess, degraded, more, good], key=lambda one: one.rank)
    assert found == [good, more, degraded, guess, lost]
