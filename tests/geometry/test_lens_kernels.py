"""The compiled lens against its plain form."""

import numpy as np
import pytest

from navapp.geometry.camera import distort
from tests.geometry.shapes import STRONG, camera

pytestmark = pytest.mark.kernel


@pytest.mark.parametrize("count", [0, 4, 5, 8, 12])
def test_projection_is_the_plain_one_to_the_last_bit(count: int) -> None:
    lens = camera(STRONG[:count])
    points = np.random.default_rng(count).uniform((-200, -150, -50), (200, 150, 700), (4000, 3))
    depth_mm = np.where(points[:, 2] > 1e-6, points[:, 2], np.nan)
    bent = distort(points[:, 0] / depth_mm, points[:, 1] / depth_mm, lens.distortion)
    expected = np.column_stack(bent) * lens.matrix[[0, 1], [0, 1]] + lens.matrix[:2, 2]
    np.testing.assert_array_equal(lens.project(points), expected)
    assert np.isnan(expected).any()
    assert np.isfinite(expected).any()
