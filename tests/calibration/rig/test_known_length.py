"""How long one pair makes a board of known size."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from calibration.rig.known_length import LengthMeter, measure_length
from navapp.geometry.transform import RigidTransform
from tests.calibration.marks import BOARD, drawn_pairs, drawn_rig
from tests.calibration.rig.test_rig_check import shifted


@pytest.fixture(scope="module")
def world():
    rng = np.random.default_rng(31)
    rig = drawn_rig(rng)
    return rig, drawn_pairs(rig, rng, 30, noise_px=0.05)


def lengths(rig, pairs) -> tuple[np.ndarray, np.ndarray]:
    found = [measure_length(BOARD, rig, pair) for pair in pairs]
    return np.array([one.ratio for one in found]), np.array([one.sigma for one in found])


def test_a_rig_that_has_not_moved_measures_right_and_knows_how_well(world) -> None:
    ratios, sigmas = lengths(*world)
    pulls = (ratios - 1.0) / sigmas
    assert np.sqrt((pulls**2).mean()) == pytest.approx(1.0, abs=0.35)
    assert sigmas.max() < 2e-4


@pytest.mark.parametrize("x_px", [-0.3, 0.3])
def test_a_picture_that_moved_sideways_by_a_third_of_a_pixel_shows(world, x_px: float) -> None:
    """As much as the depth: z v / (f B)."""
    rig, pairs = world
    ratios, sigmas = lengths(rig, shifted(pairs, x_px, 0.0))
    depth_mm, focal_px = 450.0, rig.left.focal_px
    expected = depth_mm * x_px / (focal_px * rig.baseline_mm)
    assert np.median(ratios) - 1.0 == pytest.approx(expected, rel=0.15)
    assert (np.abs(ratios - 1.0) > 5.0 * sigmas).all()


def test_marks_that_fit_badly_make_the_length_less_sure(world) -> None:
    rig, pairs = world
    rng = np.random.default_rng(3)
    bent = []
    for pair in pairs:
        off_px = rng.normal(0.0, 0.5, pair.right.pixels.shape)
        bent.append(replace(pair, right=replace(pair.right, pixels=pair.right.pixels + off_px)))
    _, sigmas = lengths(rig, pairs)
    _, wide = lengths(rig, bent)
    assert np.median(wide / sigmas) > 4.0


def test_too_few_common_marks_tell_nothing(world) -> None:
    rig, pairs = world
    seen = pairs[0].right
    few = replace(
        seen, ids=seen.ids[:11], pixels=seen.pixels[:11], sigma_px=seen.sigma_px[:11]
    )  # fmt: skip
    assert measure_length(BOARD, rig, replace(pairs[0], right=few)) is None


def test_a_board_that_would_be_behind_a_camera_tells_nothing(world) -> None:
    """A rig that is not that of the pictures: its right camera is beyond the board."""
    rig, pairs = world
    turned = RigidTransform.from_parts("right", "left", np.eye(3), (-80.0, 0.0, -600.0))
    assert measure_length(BOARD, replace(rig, right_from_left=turned), pairs[0]) is None


def test_a_detector_that_stumbles_has_seen_nothing(world, monkeypatch) -> None:
    def stumble(picture, board):
        raise cv2.error("assertion failed")

    monkeypatch.setattr("calibration.rig.corner_locator.find_board", stumble)
    grey = np.full((720, 1280), 90, np.uint8)
    assert LengthMeter(BOARD, world[0])(grey, grey) is None


def test_pictures_without_the_board_tell_nothing(world) -> None:
    grey = np.full((720, 1280, 3), 90, np.uint8)
    assert LengthMeter(BOARD, world[0])(grey, grey) is None
