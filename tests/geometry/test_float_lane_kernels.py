"""Float lanes do what their numbers would do one by one."""

import operator

import numpy as np
import pytest
from numba import njit
from numba.core.errors import TypingError

from navapp.geometry import float_lane_kernels
from navapp.geometry.float_lane_kernels import (
    LANES,
    all_positive,
    lanes_for,
    load,
    spread,
    store,
    where_positive,
)

TWO = {
    operator.add: np.add,
    operator.sub: np.subtract,
    operator.mul: np.multiply,
    operator.truediv: np.divide,
    float_lane_kernels.smaller: np.minimum,
    float_lane_kernels.larger: np.maximum,
}


def numbers(seed: int) -> np.ndarray:
    return np.random.default_rng(seed).normal(size=3 * LANES).astype(np.float32)


@pytest.mark.parametrize("operate", TWO)
def test_two_become_one(operate) -> None:
    @njit
    def run(a, b, out):
        store(out, 5, operate(load(a, 3), load(b, 0)))

    a, b, out = numbers(1), numbers(2), np.zeros(3 * LANES, dtype=np.float32)
    run(a, b, out)
    np.testing.assert_array_equal(out[5 : 5 + LANES], TWO[operate](a[3 : 3 + LANES], b[:LANES]))
    # Nothing else is written.
    assert not out[:5].any()
    assert not out[5 + LANES :].any()


def test_all_lanes_have_to_be_above_zero() -> None:
    @njit
    def run(a):
        return all_positive(load(a, 0))

    assert run(np.full(LANES, 0.1, dtype=np.float32))
    for wrong in (0.0, -1.0, np.nan):
        for lane in range(LANES):
            values = np.ones(LANES, dtype=np.float32)
            values[lane] = wrong
            assert not run(values)


def test_lanes_are_chosen_where_the_test_is_above_zero() -> None:
    @njit
    def run(a, out):
        here = load(a, 0)
        store(out, 0, where_positive(here, here * here, spread(np.float32(-1.0))))

    a, out = numbers(3), np.empty(LANES, dtype=np.float32)
    a[:2] = 0.0, np.nan
    run(a, out)
    np.testing.assert_array_equal(out, [x * x if x > 0 else np.float32(-1.0) for x in a[:LANES]])


@pytest.mark.parametrize(
    "array",
    [np.zeros(64), np.zeros((2, 64), dtype=np.float32), np.zeros(64, dtype=np.float32)[::2]],
)
def test_other_arrays_are_refused(array: np.ndarray) -> None:
    @njit
    def run(array):
        store(array, 0, load(array, 0))

    with pytest.raises(TypingError):
        run(array)


@pytest.mark.parametrize(
    ("count", "expected"), [(1, LANES), (LANES, LANES), (LANES + 1, 2 * LANES)]
)
def test_whole_lanes(count: int, expected: int) -> None:
    assert lanes_for(count) == expected
