"""The least error: against an ideal estimator on drawn pictures, and step by step."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from navapp.evaluation.noise_limit.limit import (
    PixelInformation,
    PixelModel,
    estimate_ideally,
    find_least_error_mm,
    join_information,
    model_pixels,
    weigh_directions,
    weigh_pixels,
)
from navapp.geometry.box import Box
from navapp.geometry.rectification import RectifiedGeometry, RectifiedPair
from navapp.geometry.transform import RigidTransform, rotation_from_vector
from navapp.geometry.zbuffer import render_rectified
from tests.registration.shapes import grid_mesh

WIDTH, HEIGHT = 260, 180
LEFT = RigidTransform.identity("left_rect", "left")
GEOMETRY = RectifiedGeometry(500.0, 129.5, 89.5, 24.0, WIDTH, HEIGHT, LEFT)
POSE = RigidTransform.from_parts("left_rect", "femur", np.eye(3), (0.0, 0.0, 300.0))
# A sheet that fills both pictures, and fixes all six directions.
SHEET = grid_mesh(lambda x, y: 6.0 * np.sin(x / 14.0) + 5.0 * np.cos(y / 11.0), 260.0, 1.0)
BOX = Box(60, 20, 160, 140)
NOISE = 1.5
VARIANCE = NOISE**2 + 1.0 / 12.0  # with the rounding
TARGETS_MM = np.array([[20.0, 0.0, 10.0], [-20.0, 15.0, 5.0], [0.0, -25.0, 0.0]])


@dataclass(frozen=True)
class Scene:
    """A textured sheet without noise: grey values of both pictures."""

    left: np.ndarray
    right: np.ndarray
    support_px: np.ndarray
    pixels: PixelModel

    def pair(self, rng: np.random.Generator) -> RectifiedPair:
        """Both pictures with noise of their own."""
        noisy = [one + NOISE * rng.standard_normal(one.shape) for one in (self.left, self.right)]
        grey = [np.clip(np.rint(one), 0, 255).astype(np.uint8) for one in noisy]
        return RectifiedPair(*grey, GEOMETRY, BOX)

    def weigh(self, pair: RectifiedPair) -> PixelInformation:
        """With the noise that it has."""
        variance = np.full((HEIGHT, WIDTH), VARIANCE, dtype=np.float32)
        return weigh_pixels(pair, self.support_px, self.pixels, (variance, variance))


@pytest.fixture(scope="module")
def scene() -> Scene:
    whole = render_rectified(SHEET, POSE, GEOMETRY, Box(0, 0, WIDTH, HEIGHT))
    disparity = GEOMETRY.disparity_map_px(whole.depth_mm).astype(np.float64)
    assert np.isfinite(disparity).all()
    waves = np.random.default_rng(3).uniform((-1.0, -1.0, 0.0), (1.0, 1.0, 6.3), (40, 3))

    def texture(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        parts = [np.sin(a * x + b * y + c) for a, b, c in waves]
        return 128.0 + 4.0 * np.sum(parts, axis=0)

    columns, rows = np.meshgrid(np.arange(WIDTH, dtype=float), np.arange(HEIGHT, dtype=float))
    seen_at = [
        np.interp(np.arange(WIDTH), x - d, x) for x, d in zip(columns, disparity, strict=True)
    ]
    view = render_rectified(SHEET, POSE, GEOMETRY, BOX)
    pixels = model_pixels(view, SHEET, POSE, GEOMETRY, SHEET.centroid_mm)
    inner = (pixels.rows > 6) & (pixels.rows < 133) & (pixels.columns > 6) & (pixels.columns < 153)
    return Scene(
        texture(columns, rows),
        texture(np.array(seen_at), rows),
        GEOMETRY.disparity_map_px(view.depth_mm),
        pixels.select(inner),
    )


def mean_square() -> np.ndarray:
    return weigh_directions(POSE, SHEET.centroid_mm, TARGETS_MM)


@pytest.mark.parametrize("axis", range(6))
def test_disparities_move_with_the_pose_as_the_slopes_say(scene, axis) -> None:
    twist = np.zeros(6)
    twist[axis] = 1e-2 if axis < 3 else 1e-4
    shown = [
        GEOMETRY.disparity_map_px(render_rectified(SHEET, pose, GEOMETRY, BOX).depth_mm)
        for pose in (POSE.move(sign * twist, POSE.apply(SHEET.centroid_mm)) for sign in (1, -1))
    ]
    at = (scene.pixels.rows, scene.pixels.columns)
    moved = 0.5 * (shown[0] - shown[1])[at] / twist[axis]
    told = scene.pixels.slopes[:, axis]
    # A pixel that changes from one triangle to the next moves by a little more or less.
    assert np.median(np.abs(moved - told)) < 0.02 * np.sqrt(np.mean(told**2))


@pytest.mark.release
def test_an_ideal_estimator_reaches_the_bound(scene) -> None:
    """Of 120 draws of the noise the errors have the covariance that the bound says."""
    rng, normed, squares, limits = np.random.default_rng(7), [], [], []
    for _ in range(120):
        told = scene.weigh(scene.pair(rng))
        information = join_information(scene.pixels, told)
        error = estimate_ideally(scene.pixels, told)
        normed.append(error @ information @ error)
        squares.append(error @ mean_square() @ error)
        limits.append(find_least_error_mm(information, mean_square()))
    # Six directions, each of variance 1; the mean of 120 has a standard deviation of 0.32.
    assert 5.0 < np.mean(normed) < 7.5
    assert np.sqrt(np.mean(squares)) == pytest.approx(np.mean(limits), rel=0.2)
    # One draw tells the bound as well as another.
    assert np.std(limits) < 0.05 * np.mean(limits)


def test_noise_tells_nothing(scene) -> None:
    """Without texture the slopes of both pictures have nothing in common."""
    flat = replace(scene, left=np.full_like(scene.left, 128), right=np.full_like(scene.right, 128))
    bare = scene.weigh(scene.pair(np.random.default_rng(1)))
    told = flat.weigh(flat.pair(np.random.default_rng(1)))
    assert abs(told.information.sum()) < 0.01 * bare.information.sum()
    assert np.std(told.deviation) == pytest.approx(1.0, abs=0.1)


def test_brightness_and_contrast_of_one_eye_change_nothing(scene) -> None:
    # Without noise and rounding: a camera with more gain amplifies its noise as well.
    waves = scene.left, scene.right
    pairs = [
        RectifiedPair(waves[0], right, GEOMETRY, BOX) for right in (waves[1], 20.0 + 0.8 * waves[1])
    ]
    one, other = (scene.weigh(pair) for pair in pairs)
    np.testing.assert_allclose(
        estimate_ideally(scene.pixels, one), estimate_ideally(scene.pixels, other), atol=1e-4
    )


def test_directions_weigh_as_much_as_they_move_the_targets() -> None:
    turned = RigidTransform.from_parts(
        "left_rect", "femur", rotation_from_vector([0.3, -0.5, 0.2]), (5.0, 0.0, 300.0)
    )
    centre_mm, twist = np.array([3.0, 1.0, -2.0]), 1e-4 * np.array([1, -2, 3, 0.1, 0.2, -0.3])
    moved = turned.move(twist, turned.apply(centre_mm)).apply(TARGETS_MM)
    square = np.mean(np.sum((moved - turned.apply(TARGETS_MM)) ** 2, axis=1))
    told = twist @ weigh_directions(turned, centre_mm, TARGETS_MM) @ twist
    assert told == pytest.approx(square, rel=1e-3)


def test_more_pixels_and_less_noise_tell_more() -> None:
    rng = np.random.default_rng(0)
    slopes = rng.normal(size=(400, 6))
    rows = np.zeros(400, dtype=np.intp)
    pixels = PixelModel(rows, rows, np.ones(400), slopes)
    told = PixelInformation(np.ones(400), np.zeros(400), np.zeros(400))
    whole = find_least_error_mm(join_information(pixels, told), np.eye(6))
    half = np.arange(400) < 200
    some = find_least_error_mm(join_information(pixels.select(half), told.select(half)), np.eye(6))
    assert some > 1.2 * whole
    four = PixelInformation(np.full(400, 4.0), told.score, told.deviation)
    assert find_least_error_mm(join_information(pixels, four), np.eye(6)) == pytest.approx(
        0.5 * whole
    )
    # A known variance: one direction, one pixel of information 25 / px^2.
    known = np.eye(6) * 25.0
    assert find_least_error_mm(known, np.diag([1.0, 0, 0, 0, 0, 0])) == pytest.approx(0.2)
    mixed = known + np.diag([5.0] * 5, 1) + np.diag([5.0] * 5, -1)
    weights = np.diag([1.0, 2.0, 3.0, 4.0, 5.0, 6.0])
    assert find_least_error_mm(mixed, weights) == pytest.approx(
        np.sqrt(np.trace(weights @ np.linalg.inv(mixed)))
    )


@pytest.mark.parametrize("least", [0.0, -1.0])
def test_a_direction_that_nothing_fixes_has_no_bound(least) -> None:
    information = np.diag([1.0, 1.0, 1.0, 1.0, 1.0, least])
    with pytest.raises(np.linalg.LinAlgError):
        find_least_error_mm(information, np.eye(6))
