import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import expm

from navapp.geometry.transform import (
    RigidTransform,
    nearest_rotation,
    read_only,
    rotation_angle_deg,
    rotation_from_vector,
    skew,
    vector_from_rotation,
)

component = st.floats(-1.0, 1.0, allow_subnormal=False)
directions = st.tuples(component, component, component).filter(
    lambda v: float(np.linalg.norm(v)) > 0.1
)


def pose(target="camera", source="bone", vector=(0.3, -0.8, 1.1), translation=(10.0, -20.0, 450.0)):
    return RigidTransform.from_parts(target, source, rotation_from_vector(vector), translation)


def unit(direction):
    return np.asarray(direction) / np.linalg.norm(direction)


def test_composition_joins_the_outer_frames():
    product = pose("a", "b") @ pose("b", "c", (0.1, 0.2, 0.3), (1, 2, 3))
    assert product.name == "a_from_c"
    expected = pose("a", "b").apply(pose("b", "c", (0.1, 0.2, 0.3), (1, 2, 3)).apply([4, 5, 6]))
    np.testing.assert_allclose(product.apply([4.0, 5.0, 6.0]), expected, atol=1e-12)


def test_frames_that_do_not_meet_are_refused():
    with pytest.raises(ValueError, match=r"a_from_b with a_from_b: frames do not meet"):
        pose("a", "b") @ pose("a", "b")


def test_only_transforms_compose():
    with pytest.raises(TypeError):
        pose() @ 3


def test_the_inverse_undoes_and_swaps_the_frames():
    forward = pose()
    points = np.random.default_rng(1).normal(size=(50, 3)) * 300
    assert forward.inverse().name == "bone_from_camera"
    np.testing.assert_allclose(
        forward.inverse().apply(forward.apply(points)), points, rtol=0, atol=1e-10
    )
    np.testing.assert_allclose((forward.inverse() @ forward).matrix, np.eye(4), atol=1e-12)


def test_one_point_and_many_points_are_moved_alike():
    points = np.random.default_rng(2).normal(size=(5, 3))
    together = pose().apply(points)
    assert together.shape == (5, 3)
    for index, point in enumerate(points):
        np.testing.assert_allclose(pose().apply(point), together[index], rtol=1e-14)


def test_directions_are_turned_but_not_shifted():
    np.testing.assert_allclose(
        pose().rotate([1.0, 0.0, 0.0]),
        pose().apply([1, 0, 0]) - pose().apply([0, 0, 0]),
        atol=1e-12,
    )


@settings(max_examples=60, deadline=None)
@given(directions, st.floats(1e-9, 3.0), directions, directions)
def test_a_motion_about_the_origin_is_the_exponential_of_the_rotation(
    direction, angle, shift, centre
):
    vector, translation = unit(direction) * angle, np.array(shift) * 30
    start = pose()
    moved = start.move(np.r_[translation, vector], np.zeros(3))
    motion = np.eye(4)
    motion[:3, :3] = expm(skew(vector))
    motion[:3, 3] = translation
    np.testing.assert_allclose(moved.matrix, motion @ start.matrix, rtol=0, atol=1e-9)
    # About another centre: shift there, turn, shift back (similarity of the pure rotation).
    centre = np.array(centre) * 200
    there, back = np.eye(4), np.eye(4)
    there[:3, 3], back[:3, 3] = -centre, centre
    turn, shift_only = np.eye(4), np.eye(4)
    turn[:3, :3], shift_only[:3, 3] = motion[:3, :3], translation
    moved = start.move(np.r_[translation, vector], centre)
    expected = shift_only @ back @ turn @ there @ start.matrix
    np.testing.assert_allclose(moved.matrix, expected, rtol=0, atol=1e-9)


def test_the_centre_of_a_motion_only_shifts():
    start = pose()
    centre = start.apply([5.0, 6.0, 7.0])
    moved = start.move([1.0, 2.0, 3.0, 0.4, -0.2, 0.1], centre)
    np.testing.assert_allclose(moved.apply([5.0, 6.0, 7.0]), np.add(centre, [1, 2, 3]), atol=1e-10)


def test_a_small_motion_is_the_first_order_jacobian():
    twist = np.array([1e-6, -2e-6, 3e-6, 4e-6, -5e-6, 6e-6])
    start, centre, point = pose(), np.array([1.0, 2.0, 300.0]), np.array([20.0, -10.0, 5.0])
    offset = start.apply(point) - centre
    difference = start.move(twist, centre).apply(point) - start.apply(point)
    np.testing.assert_allclose(difference, twist[:3] - skew(offset) @ twist[3:], atol=5e-8)


angles = st.one_of(
    st.floats(0.0, np.pi - 1e-3),
    st.floats(0.0, 1e-5),
    st.floats(1e-9, 1e-4).map(lambda small: np.pi - small),
)


@settings(max_examples=300, deadline=None)
@given(directions, angles)
def test_rotation_vectors_come_back(direction, angle):
    vector = unit(direction) * angle
    returned = vector_from_rotation(rotation_from_vector(vector))
    np.testing.assert_allclose(returned, vector, rtol=0, atol=2e-8)


@settings(max_examples=100, deadline=None)
@given(directions)
def test_half_a_turn_comes_back_about_either_end_of_its_axis(direction):
    rotation = rotation_from_vector(unit(direction) * np.pi)
    vector = vector_from_rotation(rotation)
    assert np.linalg.norm(vector) == pytest.approx(np.pi, abs=1e-7)
    np.testing.assert_allclose(rotation_from_vector(vector), rotation, atol=1e-7)


@pytest.mark.parametrize("angle", [0.0, 1e-12, 1e-8, 9.9e-9, 1.1e-8, 1e-7, 1e-3, 1.0, 3.0, np.pi])
def test_the_rotation_is_the_matrix_exponential(angle):
    vector = unit([0.3, -0.5, 0.8]) * angle
    np.testing.assert_allclose(rotation_from_vector(vector), expm(skew(vector)), atol=1e-14)


@pytest.mark.parametrize("matrix", [np.diag([-1.0, 1, 1]), np.diag([1.0, -1, 1]), -np.eye(3)])
def test_a_reflection_is_refused(matrix):
    with pytest.raises(ValueError, match="camera_from_bone: the 3x3 part is a reflection"):
        RigidTransform.from_parts("camera", "bone", matrix, np.zeros(3))


@pytest.mark.parametrize(
    "matrix", [np.zeros((4, 4)), np.eye(3), np.diag([1.0, 1, 1, 2]), np.diag([1.1, 1.1, 1.1, 1])]
)
def test_what_is_no_rigid_transform_is_refused(matrix):
    with pytest.raises(ValueError, match="camera_from_bone"):
        RigidTransform("camera", "bone", matrix)


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_numbers_that_are_not_finite_are_refused(bad):
    with pytest.raises(ValueError, match="finite"):
        RigidTransform.from_parts("a", "b", np.eye(3), [0, bad, 0])


def test_a_drifted_rotation_is_made_orthonormal_again():
    rotation = rotation_from_vector([0.3, 0.4, -0.5])
    drifted = rotation + 3e-5 * np.random.default_rng(3).normal(size=(3, 3))
    mended = RigidTransform.from_parts("a", "b", drifted, [1, 2, 3]).rotation
    np.testing.assert_allclose(mended.T @ mended, np.eye(3), atol=1e-14)
    assert np.linalg.det(mended) > 0
    # No rotation is nearer: a small turn in any direction only moves away.
    distance = np.linalg.norm(mended - drifted)
    for turn in 1e-4 * np.vstack([np.eye(3), -np.eye(3)]):
        assert np.linalg.norm(rotation_from_vector(turn) @ mended - drifted) > distance


def test_a_rotation_too_far_from_one_is_refused():
    with pytest.raises(ValueError, match="not a rotation"):
        RigidTransform.from_parts("a", "b", np.eye(3) * 1.001, np.zeros(3))


def test_ten_thousand_products_do_not_drift():
    step = pose("a", "a", (1e-3, 2e-3, -3e-3), (0, 0, 0))
    product = step
    for _ in range(10_000):
        product = step @ product
    np.testing.assert_allclose(product.rotation.T @ product.rotation, np.eye(3), atol=1e-11)


@settings(max_examples=50, deadline=None)
@given(directions, st.floats(-3.0, 3.0))
def test_a_rotation_keeps_its_bits(direction, angle):
    first = RigidTransform.from_parts(
        "a", "b", rotation_from_vector(np.array(direction) * angle), [0.1, 0.2, 0.3]
    )
    again = RigidTransform("a", "b", np.array(first.to_list()))
    assert again.matrix.tobytes() == first.matrix.tobytes()


@settings(max_examples=50, deadline=None)
@given(directions, st.floats(-3.0, 3.0), directions, directions)
def test_metres_and_millimetres_give_the_same_place(direction, angle, shift, point):
    rotation = rotation_from_vector(np.array(direction) * angle)
    shift_m, point_m = np.array(shift), np.array(point)
    in_m = RigidTransform.from_parts("a", "b", rotation, shift_m)
    in_mm = RigidTransform.from_parts("a", "b", rotation, 1000.0 * shift_m)
    np.testing.assert_allclose(
        in_mm.apply(1000.0 * point_m), 1000.0 * in_m.apply(point_m), rtol=1e-12, atol=1e-9
    )
    np.testing.assert_allclose(
        in_mm.inverse().translation_mm, 1000.0 * in_m.inverse().translation_mm, atol=1e-9
    )


def test_a_transform_cannot_be_changed_from_outside():
    given_matrix = np.eye(4)
    transform = RigidTransform("a", "b", given_matrix)
    given_matrix[0, 3] = 5.0
    assert transform.translation_mm[0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        transform.matrix[0, 3] = 5.0
    with pytest.raises(ValueError, match="read-only"):
        transform.translation_mm[0] = 5.0


def test_renaming_keeps_the_motion():
    renamed = pose().rename("left", "femur")
    assert renamed.name == "left_from_femur"
    np.testing.assert_array_equal(renamed.matrix, pose().matrix)


def test_the_angle_between_poses_is_that_of_the_turn_between_them():
    start = pose()
    turned = start.move([0, 0, 0, *np.radians(unit([1.0, 2.0, 3.0]) * 37.0)], np.zeros(3))
    assert rotation_angle_deg(start, turned) == pytest.approx(37.0, abs=1e-9)
    assert rotation_angle_deg(start, start) == 0.0


def test_the_nearest_rotation_of_a_reflection_is_no_reflection():
    assert np.linalg.det(nearest_rotation(np.diag([1.0, 1.0, -1.0]))) == pytest.approx(1.0)


def test_read_only_copies_what_could_be_written_from_outside():
    source = np.arange(3.0)
    frozen = read_only(source)
    source[0] = 9.0
    assert frozen[0] == 0.0
    assert not frozen.flags.writeable
    assert read_only(frozen) is frozen


def test_a_fit_of_points_is_their_motion_and_the_nearest_one_where_they_are_noisy() -> None:
    random = np.random.default_rng(7)
    source_mm = random.normal(0.0, 30.0, (12, 3))
    true = RigidTransform.from_parts(
        "camera", "board", rotation_from_vector((0.3, -2.0, 0.7)), (4.0, -90.0, 350.0)
    )
    found = RigidTransform.fit("camera", "board", true.apply(source_mm), source_mm)
    np.testing.assert_allclose(found.matrix, true.matrix, atol=1e-10)
    noisy_mm = true.apply(source_mm) + random.normal(0.0, 1.0, source_mm.shape)
    fitted = RigidTransform.fit("camera", "board", noisy_mm, source_mm)

    def rms_mm(pose: RigidTransform) -> float:
        return float(np.sqrt(((pose.apply(source_mm) - noisy_mm) ** 2).sum(axis=1).mean()))

    for twist in 0.01 * np.vstack([np.eye(6), -np.eye(6)]):
        assert rms_mm(fitted) < rms_mm(fitted.move(twist, noisy_mm.mean(axis=0)))
