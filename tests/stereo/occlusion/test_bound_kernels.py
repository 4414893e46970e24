"""The bound that an occlusion sets to filled disparities."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from navapp.stereo.occlusion.bound_kernels import drop_beyond_bound
from navapp.values import Origin
from tests.reference.bound_reference import find_beyond_bound_slowly

EDGE, LAYER = np.float32(2.0), np.float32(8.0)
MATCHED, INTERIOR = Origin.MATCHED, Origin.FILLED_INTERIOR


def dropped(disparity, origin) -> np.ndarray:
    disparity = np.atleast_2d(np.array(disparity, dtype=np.float32))
    origin = np.atleast_2d(np.array(origin, dtype=np.uint8))
    left_px, left = disparity.copy(), origin.copy()
    drop_beyond_bound(left_px, left, EDGE, LAYER)
    is_dropped = (left == Origin.UNKNOWN) & (origin != Origin.UNKNOWN)
    assert np.isnan(left_px[is_dropped]).all()
    np.testing.assert_array_equal(left_px[~is_dropped], disparity[~is_dropped])
    np.testing.assert_array_equal(left[~is_dropped], origin[~is_dropped])
    return is_dropped


@pytest.mark.kernel
@given(st.integers(0, 2**32 - 1))
@settings(max_examples=60, deadline=None)
def test_it_is_the_rule(seed: int) -> None:
    rng = np.random.default_rng(seed)
    shape = int(rng.integers(0, 5)), int(rng.integers(0, 40))
    origin = rng.integers(0, 5, shape).astype(np.uint8)
    # Quarters: no sum is rounded.
    disparity = (rng.integers(0, 160, shape) / 4.0).astype(np.float32)
    disparity[origin == Origin.UNKNOWN] = np.nan
    expected = find_beyond_bound_slowly(disparity, origin, EDGE, LAYER)
    np.testing.assert_array_equal(dropped(disparity, origin), expected)


def test_what_hides_a_pixel_bounds_how_near_it_is() -> None:
    """Left of a hand at 60 px an instrument at 48 px may go on for 12 - 2 px less, no further."""
    width = 40
    disparity, origin = np.full(width, 48.0), np.full(width, INTERIOR)
    origin[0], origin[-1], disparity[-1] = MATCHED, MATCHED, 60.0
    room_px = np.arange(width)[::-1]
    expected = (60.0 - room_px + EDGE < 48.0) & (origin == INTERIOR)
    np.testing.assert_array_equal(dropped(disparity, origin)[0], expected)
    assert expected.sum() == 24


def test_a_hole_in_one_surface_stays_closed() -> None:
    disparity, origin = np.full(30, 60.0), np.full(30, INTERIOR)
    origin[[0, -1]] = MATCHED
    assert not dropped(disparity, origin).any()
    disparity[0] = 51.0  # another surface on the left
    assert dropped(disparity, origin).any()


@pytest.mark.parametrize("kind", [MATCHED, Origin.FILLED_BORDER, Origin.UNKNOWN])
def test_only_what_may_be_hidden_is_asked(kind: Origin) -> None:
    disparity, origin = np.full(30, 60.0), np.full(30, kind)
    origin[-1], disparity[-1] = MATCHED, 10.0
    assert not dropped(disparity, origin).any()


def test_background_is_always_possible() -> None:
    disparity, origin = np.full(30, 20.0), np.full(30, INTERIOR)
    origin[[0, -1]], disparity[-1] = MATCHED, 60.0
    assert not dropped(disparity, origin).any()
