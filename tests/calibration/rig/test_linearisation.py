"""The normal equations' right side is the slope of the cost that they lower."""

import numpy as np
import pytest

from calibration.rig.initial_rig import vector_of
from calibration.rig.linearisation import Linearisation, NormalEquations, Views
from calibration.rig.parameters import RigModel, pack
from tests.calibration.marks import BOARD, HEIGHT, WIDTH, drawn_pose, drawn_rig, seen_pair


@pytest.mark.parametrize("n_marks", [0, len(BOARD.points_mm)])
def test_a_step_goes_down_the_slope_of_the_cost(n_marks) -> None:
    rng = np.random.default_rng(3)
    true, model = drawn_rig(rng), RigModel(5, n_marks, WIDTH, HEIGHT)
    poses = [drawn_pose(rng) for _ in range(3)]
    pairs = [seen_pair(i, true, pose, rng) for i, pose in enumerate(poses)]
    # Beyond Huber's limit, and marks that are not where they should be.
    pairs[0].left.pixels[:2] += 4.0
    views = Views.of(BOARD, pairs, model)
    shared = np.concatenate([pack(RigModel(5, 0, WIDTH, HEIGHT), true), np.zeros(3 * n_marks)])
    shared[model.n_rig :] = rng.normal(0.0, 0.05, 3 * n_marks)
    start = np.array([vector_of(pose.matrix) for pose in poses])
    linear = Linearisation(views, shared, start)
    normal = NormalEquations(linear)
    for _ in range(8):
        by_shared = 1e-7 * rng.normal(size=shared.size) * np.maximum(np.abs(shared), 1e-2)
        by_pose = 1e-7 * rng.normal(size=start.shape)
        ahead, behind = (
            Linearisation(views, shared + k * by_shared, start + k * by_pose).cost(linear.scale)
            for k in (1.0, -1.0)
        )
        right = np.array([one[2] for one in normal._view_normals])
        expected = -2.0 * (normal._shared_right @ by_shared + (right * by_pose).sum())
        assert 0.5 * (ahead - behind) == pytest.approx(expected, rel=1e-3)


def test_the_shared_normal_is_the_plain_product_of_all_slopes() -> None:
    """Reference: one row per coordinate, one column per number, most of them zero."""
    rng = np.random.default_rng(5)
    n_marks = len(BOARD.points_mm)
    true, model = drawn_rig(rng), RigModel(5, n_marks, WIDTH, HEIGHT)
    poses = [drawn_pose(rng) for _ in range(3)]
    pairs = [seen_pair(i, true, pose, rng) for i, pose in enumerate(poses)]
    views = Views.of(BOARD, pairs, model)
    shared = np.concatenate([pack(RigModel(5, 0, WIDTH, HEIGHT), true), np.zeros(3 * n_marks)])
    linear = Linearisation(views, shared, np.array([vector_of(pose.matrix) for pose in poses]))
    expected = np.zeros((model.n_shared, model.n_shared))
    for one in (one for view in linear.pictures for one in view):
        rows = np.zeros((len(one.ids), 2, model.n_shared))
        rows[..., : model.n_rig] = one.by_rig
        for row, mark, by_place in zip(rows, one.ids, one.by_place, strict=True):
            first = model.n_rig + 3 * mark
            row[:, first : first + 3] = by_place
        weight = np.minimum(1.0, 3.0 * linear.scale / np.maximum(one.length, 1e-12))
        rows *= (np.sqrt(weight) / one.sigma_px)[:, None, None]
        rows = rows.reshape(-1, model.n_shared)
        expected += rows.T @ rows
    sigma_mm, _ = linear.marks_off()
    marks = np.arange(model.n_rig, model.n_shared)
    expected[marks, marks] += (linear.scale / sigma_mm) ** 2
    np.testing.assert_allclose(
        NormalEquations(linear)._shared_normal, expected, rtol=1e-9, atol=1e-9 * expected.max()
    )


def test_the_first_step_lowers_the_cost_and_a_rig_at_rest_stays() -> None:
    rng = np.random.default_rng(4)
    true, model = drawn_rig(rng), RigModel(5, 0, WIDTH, HEIGHT)
    poses = [drawn_pose(rng) for _ in range(8)]
    views = Views.of(BOARD, [seen_pair(i, true, p, rng) for i, p in enumerate(poses)], model)
    shared, start = pack(model, true), np.array([vector_of(pose.matrix) for pose in poses])
    costs = []
    for _ in range(4):
        linear = Linearisation(views, shared, start)
        costs.append(linear.cost(1.0))
        by_shared, by_pose = NormalEquations(linear).step(1e-9, False)
        shared, start = shared + by_shared, start + by_pose
    assert costs[1] < costs[0]
    assert costs[3] == pytest.approx(costs[2], rel=1e-6)
