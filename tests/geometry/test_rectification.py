import dataclasses

import cv2
import numpy as np
import pytest

from navapp.errors import RigError
from navapp.geometry.box import Box
from navapp.geometry.rectification import Rectifier, luma, rectifier_of
from navapp.geometry.rig import StereoRig
from navapp.geometry.transform import RigidTransform
from tests.geometry.shapes import camera, toed_in_rig


@pytest.fixture(scope="module")
def rectifier():
    return Rectifier(toed_in_rig())


def seen_points(rig, n=300):
    """Points in the left camera's frame that both pictures show."""
    points = np.random.default_rng(6).uniform((-90, -70, 300), (120, 70, 700), (n, 3))
    left = rig.left.project(points)
    right = rig.right.project(rig.right_from_left.apply(points))
    inside = [((p > 0) & (p < (639, 479))).all(axis=1) for p in (left, right)]
    chosen = inside[0] & inside[1]
    assert chosen.sum() > 100
    return points[chosen], left[chosen], right[chosen]


def rectified(lens, pixels, rotation, geometry):
    return cv2.undistortPoints(
        pixels.reshape(-1, 1, 2).copy(),
        np.array(lens.matrix),
        np.array(lens.distortion),
        R=np.array(rotation),
        P=geometry.camera_matrix,
        criteria=(cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 60, 1e-13),
    ).reshape(-1, 2)


def test_raw_pixels_arrive_where_the_geometry_says(rectifier):
    rig, geometry = rectifier.rig, rectifier.geometry
    points, left, right = seen_points(rig)
    in_rectified = geometry.rectified_from_left.apply(points)
    expected = geometry.project(in_rectified)
    rotation_left = geometry.rectified_from_left.rotation
    # Both rectified cameras look the same way, so the right one is turned by R1 R^T.
    rotation_right = rotation_left @ rig.right_from_left.rotation.T
    in_left = rectified(rig.left, left, rotation_left, geometry)
    in_right = rectified(rig.right, right, rotation_right, geometry)
    np.testing.assert_allclose(in_left, expected, rtol=0, atol=1e-6)
    np.testing.assert_allclose(in_right[:, 1], in_left[:, 1], rtol=0, atol=1e-6)
    disparity = geometry.focal_px * geometry.baseline_mm / in_rectified[:, 2]
    np.testing.assert_allclose(in_left[:, 0] - in_right[:, 0], disparity, rtol=0, atol=1e-6)


def test_the_maps_lead_from_rectified_pixels_to_raw_ones(rectifier):
    rig, geometry = rectifier.rig, rectifier.geometry
    left_x, left_y, right_x, right_y = rectifier.maps
    v, u = (part.ravel() for part in np.mgrid[60:420:23, 60:580:29])
    rays = np.column_stack(
        [
            (u - geometry.centre_x_px) / geometry.focal_px,
            (v - geometry.centre_y_px) / geometry.focal_px,
            np.ones(u.size),
        ]
    )
    left_from_rectified = geometry.rectified_from_left.inverse()
    in_left = left_from_rectified.apply(rays)
    in_right = rig.right_from_left.rotate(in_left)
    for lens, directions, map_x, map_y in (
        (rig.left, in_left, left_x, left_y),
        (rig.right, in_right, right_x, right_y),
    ):
        raw = lens.project(directions)
        # The maps are single precision: 640 has steps of 6e-5.
        np.testing.assert_allclose(map_x[v, u], raw[:, 0], rtol=0, atol=1e-4)
        np.testing.assert_allclose(map_y[v, u], raw[:, 1], rtol=0, atol=1e-4)


def test_the_baseline_is_that_of_the_rig(rectifier):
    assert rectifier.geometry.baseline_mm == pytest.approx(rectifier.rig.baseline_mm, rel=1e-12)
    right_in_left = rectifier.rig.right_from_left.inverse().translation_mm
    np.testing.assert_allclose(
        rectifier.geometry.rectified_from_left.rotate(right_in_left),
        [rectifier.rig.baseline_mm, 0.0, 0.0],
        atol=1e-9,
    )


def test_a_distant_spot_is_found_in_the_same_row_of_both_pictures(rectifier):
    """End to end through the pixels: draw a spot in the raw pictures, find it in the rectified."""
    rig, geometry = rectifier.rig, rectifier.geometry
    point = np.array([[12.0, -18.0, 480.0]])
    pixels = rig.left.project(point)[0], rig.right.project(rig.right_from_left.apply(point))[0]
    v, u = np.mgrid[0:480, 0:640]
    pictures = [
        (250 * np.exp(-((u - px) ** 2 + (v - py) ** 2) / 18)).astype(np.uint8) for px, py in pixels
    ]
    pair = rectifier.rectify(*pictures)
    centres = []
    for picture in (pair.left, pair.right):
        weights = picture.astype(float)
        centres.append([(u * weights).sum() / weights.sum(), (v * weights).sum() / weights.sum()])
    in_rectified = geometry.rectified_from_left.apply(point)
    expected = geometry.project(in_rectified)[0]
    disparity = geometry.disparity_px(in_rectified[0, 2])
    np.testing.assert_allclose(centres[0], expected, atol=0.05)
    np.testing.assert_allclose(centres[1], expected - [disparity, 0.0], atol=0.05)


def test_depth_and_disparity_are_each_other_backwards(rectifier):
    assert rectifier.geometry.depth_mm(rectifier.geometry.disparity_px(432.1)) == pytest.approx(
        432.1
    )


def test_points_behind_the_camera_have_no_pixel(rectifier):
    points = np.array([[1.0, 2.0, -300.0], [0, 0, 0], [0, 0, 300]])
    pixels = rectifier.geometry.project(points)
    assert np.isnan(pixels[:2]).all()
    np.testing.assert_array_equal(
        pixels[2], [rectifier.geometry.centre_x_px, rectifier.geometry.centre_y_px]
    )
    assert rectifier.geometry.project(np.empty((0, 3))).shape == (0, 2)


@pytest.mark.parametrize("shape", [(480, 640), (480, 640, 3)])
def test_grey_and_colour_are_rectified_alike(rectifier, shape):
    rng = np.random.default_rng(2)
    grey = cv2.GaussianBlur(rng.integers(0, 256, (480, 640), dtype=np.uint8), (9, 9), 0)
    picture = grey if len(shape) == 2 else np.repeat(grey[:, :, None], 3, axis=2)
    pair = rectifier.rectify(picture, picture)
    assert pair.left.shape == pair.right.shape == shape
    assert pair.left.dtype == np.uint8
    reference = rectifier.rectify(grey, grey)
    np.testing.assert_array_equal(pair.left.reshape(480, 640, -1)[:, :, 0], reference.left)
    assert not np.array_equal(reference.left, reference.right)
    assert pair.box == Box(0, 0, 640, 480)
    assert pair.geometry is rectifier.geometry


def test_the_box_is_passed_on_clipped(rectifier):
    picture = np.zeros((480, 640), dtype=np.uint8)
    assert rectifier.rectify(picture, picture, Box(600, -10, 90, 40)).box == Box(600, 0, 40, 30)
    assert rectifier.rectify(picture, picture, Box(700, 500, 10, 10)).box.is_empty


@pytest.mark.parametrize("shape", [(480, 600), (481, 640), (240, 320, 3)])
def test_pictures_of_another_size_are_refused(rectifier, shape):
    right = np.zeros((480, 640), dtype=np.uint8)
    wrong = np.zeros(shape, dtype=np.uint8)
    for left, other in ((wrong, right), (right, wrong), (wrong, wrong)):
        with pytest.raises(ValueError, match=rf"{shape[1]}x{shape[0]}.*the rig 640x480"):
            rectifier.rectify(left, other)


def test_a_grey_and_a_coloured_picture_are_no_pair(rectifier):
    with pytest.raises(ValueError, match="grey"):
        rectifier.rectify(
            np.zeros((480, 640), dtype=np.uint8), np.zeros((480, 640, 3), dtype=np.uint8)
        )


def test_those_who_rectify_for_one_rig_share_its_maps(rectifier):
    assert rectifier_of(rectifier.rig) is rectifier_of(rectifier.rig)
    # A rig that was refined is another one, whatever it is called.
    refined = dataclasses.replace(rectifier.rig)
    assert rectifier_of(refined) is not rectifier_of(rectifier.rig)


def test_swapped_cameras_are_refused():
    rig = toed_in_rig()
    swapped = StereoRig(rig.right, rig.left, rig.right_from_left.inverse().rename("right", "left"))
    with pytest.raises(RigError, match="right of the left"):
        Rectifier(swapped)


def test_cameras_above_each_other_are_refused():
    pose = RigidTransform.from_parts("right", "left", np.eye(3), [0.0, -60.0, 0.0])
    with pytest.raises(RigError, match="right of the left"):
        Rectifier(dataclasses.replace(toed_in_rig(), right_from_left=pose))


def test_cameras_without_distortion_are_rectified():
    pose = RigidTransform.from_parts("right", "left", np.eye(3), [-60.0, 0.0, 0.0])
    geometry = Rectifier(StereoRig(camera(), camera(), pose)).geometry
    np.testing.assert_allclose(geometry.rectified_from_left.matrix, np.eye(4), atol=1e-12)
    assert geometry.baseline_mm == pytest.approx(60.0)


def test_with_a_band_only_what_the_box_reaches_is_rectified(rectifier):
    picture = np.random.default_rng(4).integers(1, 256, (480, 640), dtype=np.uint8)
    box, band = Box(300, 100, 120, 80), (40.0, 90.0)
    whole = rectifier.rectify(picture, picture, box)
    part = rectifier.rectify(picture, picture, box, band)
    rows = slice(100, 180)
    np.testing.assert_array_equal(part.left[rows, 300:420], whole.left[rows, 300:420])
    reached = slice(300 - 90, 420 - 40)
    np.testing.assert_array_equal(part.right[rows, reached], whole.right[rows, reached])
    assert part.box == whole.box
    assert (part.left[:100] == 0).all()
    assert (part.right[:, :190] == 0).all()


def test_the_geometry_of_reduced_pictures_sees_points_where_their_blocks_are(rectifier):
    whole = rectifier.geometry
    small = whole.reduced(4)
    points = np.array([[0.0, 0.0, 400.0], [31.0, -12.0, 500.0]])
    np.testing.assert_allclose(small.project(points), (whole.project(points) + 0.5) / 4 - 0.5)
    assert small.disparity_px(400.0) == pytest.approx(whole.disparity_px(400.0) / 4)
    assert (small.width, small.height) == (160, 120)


def test_only_the_luma_of_what_is_asked_for_is_made(rectifier):
    rng = np.random.default_rng(9)
    left, right = (rng.integers(0, 256, (480, 640, 3), dtype=np.uint8) for _ in range(2))
    for box, band in ((Box(300, 100, 120, 80), (40.0, 90.0)), (Box(0, 400, 640, 80), (0.0, 9.0))):
        part = rectifier.rectify(left, right, box, band, is_grey=True)
        whole = rectifier.rectify(luma(left), luma(right), box, band)
        np.testing.assert_array_equal(part.left, whole.left)
        np.testing.assert_array_equal(part.right, whole.right)
