"""Measured points as another camera sees them, beside the same computed one by one."""

import numpy as np
import pytest

from navapp.overlay.see_kernels import Measured
from navapp.overlay.splat_kernels import IN_FRONT, KNOWN, splat_points
from navapp.values import Origin

PAIR = (200.0, 31.5, 23.5, 60.0)
EYE = (150.0, 152.0, 40.0, 30.0)
SHAPE = (60, 80)


def draw(disparity: np.ndarray, pose: np.ndarray, *, is_matched=None, is_in_front=None):
    """A disparity for every second pixel each way; what is matched of it is matched finer, too."""
    depth_mm = np.full(SHAPE, np.nan, np.float32)
    mark = np.zeros(SHAPE, np.uint8)
    yes = np.ones(disparity.shape, bool)
    is_matched = yes if is_matched is None else is_matched
    whole = np.ones((2, 2))
    origin = np.where(is_matched, Origin.MATCHED, Origin.UNKNOWN).astype(np.uint8)
    half = Measured((0.5 * disparity).astype(np.float32), origin, 2, 3, 1)
    doubled = np.kron(disparity, whole).astype(np.float32)
    finer = Measured(doubled, np.repeat(np.repeat(origin, 2, 0), 2, 1), 4, 6, 0)
    in_front = np.kron(~yes if is_in_front is None else is_in_front, whole) > 0
    splat_points(half, finer, in_front, (4, 6, 2), PAIR, pose, EYE, depth_mm, mark)
    return depth_mm, mark


def pose(x_mm: float = 10.0) -> np.ndarray:
    turn = np.array([[0.995, 0.0, 0.0998], [0.0, 1.0, 0.0], [-0.0998, 0.0, 0.995]])
    return np.column_stack([turn, [x_mm, -4.0, 20.0]])


@pytest.mark.kernel
def test_each_point_lies_where_it_projects_and_leaves_no_gap() -> None:
    rng = np.random.default_rng(3)
    disparity = 40.0 + rng.uniform(0.0, 0.2, (20, 24))
    depth_mm, mark = draw(disparity, pose())
    for j, i in ((5, 5), (10, 20), (18, 2)):
        z = 200.0 * 60.0 / disparity[j, i]
        point = np.array([(4 + 2 * i - 31.5) / 200.0 * z, (6 + 2 * j - 23.5) / 200.0 * z, z, 1.0])
        x, y, z = pose() @ point
        u, v = round(150.0 * x / z + 40.0), round(152.0 * y / z + 30.0)
        assert abs(depth_mm[v, u] - z) < 3.0
        assert mark[v, u] == KNOWN
    rows, columns = np.nonzero(mark)
    inner = mark[rows.min() + 5 : rows.max() - 4, columns.min() + 5 : columns.max() - 4]
    assert (inner == KNOWN).all()
    assert np.array_equal(np.isnan(depth_mm), mark == 0)


@pytest.mark.kernel
def test_the_nearest_point_wins_with_its_marks() -> None:
    disparity = np.full((20, 24), 30.0)
    is_hand = np.zeros(disparity.shape, bool)
    is_hand[:, 8:14] = True
    disparity[is_hand] = 45.0
    depth_mm, mark = draw(disparity, pose(), is_in_front=is_hand, is_matched=~is_hand)
    hand = mark & IN_FRONT > 0
    assert hand.any()
    assert (mark[hand] & KNOWN == 0).all()
    assert np.nanmax(depth_mm[hand]) < np.nanmin(depth_mm[mark == KNOWN])


@pytest.mark.kernel
def test_what_lies_behind_the_eye_is_not_seen() -> None:
    behind = pose()
    behind[2] = (0.0, 0.0, -1.0, 0.0)
    depth_mm, mark = draw(np.full((5, 5), 40.0), behind)
    assert np.isnan(depth_mm).all()
    assert not mark.any()
