"""Where the corners of a board are, by one pair."""

import numpy as np
import pytest

from calibration.rig.corner_locator import CornerLocator
from tests.calibration.marks import BOARD, drawn_pairs, drawn_rig

PICTURE = np.zeros((8, 8), np.uint8)


def find(monkeypatch: pytest.MonkeyPatch, *seen):
    answers = iter(seen)
    monkeypatch.setattr(
        "calibration.rig.corner_locator.find_board", lambda picture, board: next(answers)
    )


def test_corners_lie_as_far_apart_as_on_the_board(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(8)
    rig = drawn_rig(rng)
    (pair,) = drawn_pairs(rig, rng, 1, noise_px=0.0)
    find(monkeypatch, pair.left, pair.right)
    located = CornerLocator(BOARD, rig)(PICTURE, PICTURE)
    assert located is not None
    ids, points = located
    np.testing.assert_array_equal(ids, pair.common()[0])
    true = BOARD.points_mm[ids]
    found_mm = np.linalg.norm(points[:, None] - points, axis=2)
    expected_mm = np.linalg.norm(true[:, None] - true, axis=2)
    np.testing.assert_allclose(found_mm, expected_mm, atol=1e-3)
    # Before the left camera, where its picture shows them.
    np.testing.assert_allclose(rig.left.project(points), pair.common()[1], atol=1e-4)


def test_a_board_that_one_camera_does_not_see_is_nowhere(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(8)
    rig = drawn_rig(rng)
    (pair,) = drawn_pairs(rig, rng, 1, noise_px=0.0)
    for seen in ((None,), (pair.left, None)):
        find(monkeypatch, *seen)
        assert CornerLocator(BOARD, rig)(PICTURE, PICTURE) is None
