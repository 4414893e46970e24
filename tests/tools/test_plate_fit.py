"""The pose of a plate from edges at known places: recovered, robust, and with an honest spread."""

import numpy as np
import pytest

from navapp.geometry.transform import FloatArray, RigidTransform, rotation_from_vector
from navapp.tools.paper import MARKER_MM, STRETCH, Paper, as_designed
from navapp.tools.plate import Plate
from navapp.tools.plate_fit import compute_picture_slopes, fit_plate, view
from tests.geometry.shapes import camera, toed_in_rig
from tests.tools.plate_lines import SeenPlate

RIG = toed_in_rig()
PLATE = Plate(columns=2, rows=1)
FOLDED = Plate(columns=1, rows=1, faces=2, fold_deg=50.0)
TRUE = RigidTransform.from_parts(
    "left", "plate", rotation_from_vector((0.25, -0.35, 0.6)), (-12.0, 8.0, 300.0)
)
START = TRUE.move((1.5, -1.0, 4.0, 0.04, -0.03, 0.05), TRUE.translation_mm)


def twist_of(found: RigidTransform) -> FloatArray:
    return found.twist_to(TRUE, np.zeros(3))


@pytest.mark.parametrize("plate", [PLATE, FOLDED], ids=["flat", "folded"])
def test_a_pose_is_recovered_from_its_lines(plate: Plate) -> None:
    fit = SeenPlate(plate, RIG, TRUE).fit(START, as_designed(plate))
    np.testing.assert_allclose(twist_of(fit.left_from_plate), np.zeros(6), atol=5e-4)
    np.testing.assert_allclose(fit.spread_px, 0.0, atol=1e-4)
    assert fit.sigma_px < 0.03
    assert fit.weights.min() > 0.9


def test_the_spread_of_white_is_told_for_each_eye_and_moves_nothing() -> None:
    seen = SeenPlate(PLATE, RIG, TRUE)
    # White that spreads moves every edge towards black: against the normal.
    seen.noise_px += np.array([[-0.30], [0.15]])
    fit = seen.fit(START, as_designed(PLATE))
    np.testing.assert_allclose(fit.spread_px, [-0.30, 0.15], atol=0.01)
    np.testing.assert_allclose(twist_of(fit.left_from_plate)[:2], 0.0, atol=0.005)


def test_places_that_do_not_agree_lose_their_weight() -> None:
    rng = np.random.default_rng(5)
    seen = SeenPlate(PLATE, RIG, TRUE)
    n = seen.noise_px.shape[1]
    seen.noise_px += rng.normal(0.0, 0.04, (2, n))
    wrong = rng.choice(n, n // 5, replace=False)
    clean = seen.fit(START, as_designed(PLATE)).left_from_plate
    # All to one side: least squares would follow them.
    seen.noise_px[:, wrong] += rng.uniform(0.8, 2.0, (2, len(wrong)))
    fit = seen.fit(START, as_designed(PLATE))
    is_wrong = np.isin(np.arange(n), wrong)
    weights = fit.weights.reshape(2, n)
    assert weights[:, is_wrong].max() < 0.05
    assert np.median(weights[:, ~is_wrong]) > 0.8
    off = clean.twist_to(fit.left_from_plate, np.zeros(3))
    assert np.linalg.norm(off[:3]) < 0.05
    assert np.linalg.norm(off[3:]) < 0.002


def noisy(plate: Plate, rng: np.random.Generator) -> SeenPlate:
    """A plate of which everything errs as it is thought to err."""
    paper = as_designed(plate)
    seen = SeenPlate(plate, RIG, TRUE, rng.multivariate_normal(paper.mean, paper.covariance))
    edges = seen.edges
    seen.noise_px += rng.normal(0.0, 0.15, (2, 1))
    seen.noise_px += rng.normal(0.0, 0.06, (2, edges.edge.max() + 1))[:, edges.edge]
    seen.noise_px += rng.normal(0.0, 0.03, (2, edges.side.max() + 1))[:, edges.side]
    seen.noise_px += rng.normal(0.0, 0.04, seen.noise_px.shape)
    return seen


def test_the_covariance_is_that_of_the_scatter() -> None:
    rng = np.random.default_rng(6)
    squares = []
    for _ in range(60):
        fit = noisy(PLATE, rng).fit(TRUE, as_designed(PLATE))
        off = twist_of(fit.left_from_plate)
        squares.append(off @ np.linalg.solve(fit.covariance, off))
    assert 4.0 < np.mean(squares) < 8.5


def test_known_paper_is_followed() -> None:
    """What is known of the paper moves the pose, as much as the paper differs."""
    paper = np.zeros(len(as_designed(PLATE).mean))
    paper[:3] = 2.0 * STRETCH
    paper[3:] = 2.0 * MARKER_MM * np.array([1.0, -1.0, -1.0, 1.0])
    seen = SeenPlate(PLATE, RIG, TRUE, paper)
    sure = 1e-8 * as_designed(PLATE).covariance
    blind = twist_of(seen.fit(TRUE, Paper(np.zeros(len(paper)), sure)).left_from_plate)
    told = twist_of(seen.fit(TRUE, Paper(paper, sure)).left_from_plate)
    assert np.linalg.norm(told[:3]) < 0.01
    assert np.linalg.norm(told[3:]) < 5e-4
    assert np.linalg.norm(blind[:3]) > 0.03
    # A stretched plate looks like one that is less slanted.
    assert np.linalg.norm(blind[3:]) > 0.005


def test_the_pose_follows_the_paper_as_it_says() -> None:
    seen = SeenPlate(PLATE, RIG, TRUE)
    fit = seen.fit(TRUE, as_designed(PLATE))
    # Every paper is held fast in turn: the pose goes along.
    other = as_designed(PLATE)
    lines = seen.lines(TRUE)
    for number in range(len(other.mean)):
        change = np.zeros(len(other.mean))
        change[number] = 0.1 * np.sqrt(other.covariance[number, number])
        held = Paper(change, 1e-8 * other.covariance)
        moved = fit_plate(RIG, lines, TRUE, held).left_from_plate
        expected = fit.pose_by_paper @ change
        np.testing.assert_allclose(TRUE.twist_to(moved, np.zeros(3)), expected, atol=2e-4)


def test_picture_slopes_are_those_of_the_projection() -> None:
    plain = camera()
    points = np.array([[20.0, -35.0, 300.0], [-60.0, 12.0, 450.0]])
    slopes = compute_picture_slopes(plain, points)
    for axis in range(3):
        step = 1e-4 * np.eye(3)[axis]
        moved = (plain.project(points + step) - plain.project(points - step)) / 2e-4
        np.testing.assert_allclose(slopes[:, :, axis], moved, atol=1e-6)


def test_each_eye_has_its_camera_and_place() -> None:
    assert view(RIG, 0)[0] is RIG.left
    np.testing.assert_array_equal(view(RIG, 0)[1].matrix, np.eye(4))
    assert view(RIG, 1) == (RIG.right, RIG.right_from_left)
