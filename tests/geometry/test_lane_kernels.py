"""Lanes do what their numbers would do one by one."""

import operator

import numpy as np
import pytest
from numba import njit
from numba.core.errors import TypingError

from navapp.geometry import lane_kernels
from navapp.geometry.lane_kernels import (
    FLOAT_LANES,
    WHOLE_LANES,
    all_positive,
    lanes_for,
    load,
    load_grey,
    ones,
    smallest,
    spread,
    store,
    store_grey,
    where_positive,
    whole,
    widened,
)

OF_FLOATS = {
    operator.add: np.add,
    operator.sub: np.subtract,
    operator.mul: np.multiply,
    operator.truediv: np.divide,
    lane_kernels.smaller: np.minimum,
    lane_kernels.larger: np.maximum,
}
OF_WHOLE = {
    operator.add: lambda a, b: (a + b) % 256,
    operator.sub: lambda a, b: (a - b) % 256,
    operator.mul: lambda a, b: (a * b) % 256,
    operator.or_: np.bitwise_or,
    operator.xor: np.bitwise_xor,
    lane_kernels.smaller: np.minimum,
    lane_kernels.larger: np.maximum,
    lane_kernels.capped_sum: lambda a, b: np.minimum(a + b, 255),
}


def floats(seed: int) -> np.ndarray:
    return np.random.default_rng(seed).normal(size=3 * FLOAT_LANES).astype(np.float32)


def whole_numbers(seed: int, dtype: type = np.uint8) -> np.ndarray:
    return np.random.default_rng(seed).integers(0, 256, 3 * WHOLE_LANES).astype(dtype)


def compile_two(operate):
    @njit
    def run(a, b, out):
        store(out, 5, operate(load(a, 3), load(b, 0)))

    return run


@pytest.mark.parametrize("operate", OF_FLOATS)
def test_two_floats_become_one(operate) -> None:
    a, b, out = floats(1), floats(2), np.zeros(3 * FLOAT_LANES, dtype=np.float32)
    compile_two(operate)(a, b, out)
    expected = OF_FLOATS[operate](a[3 : 3 + FLOAT_LANES], b[:FLOAT_LANES])
    np.testing.assert_array_equal(out[5 : 5 + FLOAT_LANES], expected)
    # Nothing else is written.
    assert not out[:5].any()
    assert not out[5 + FLOAT_LANES :].any()


@pytest.mark.parametrize("operate", OF_WHOLE)
def test_two_whole_numbers_become_one(operate) -> None:
    a, b, out = whole_numbers(1), whole_numbers(2), np.zeros(3 * WHOLE_LANES, dtype=np.uint8)
    compile_two(operate)(a, b, out)
    expected = OF_WHOLE[operate](a[3 : 3 + WHOLE_LANES].astype(int), b[:WHOLE_LANES].astype(int))
    assert out[5 : 5 + WHOLE_LANES].tolist() == expected.tolist()
    assert not out[:5].any()
    assert not out[5 + WHOLE_LANES :].any()


@pytest.mark.parametrize("operate", [operator.or_, operator.xor, lane_kernels.capped_sum])
def test_what_floats_do_not_understand_is_refused(operate) -> None:
    with pytest.raises(TypingError):
        compile_two(operate)(floats(1), floats(2), floats(3))


def test_lanes_of_other_types_do_not_go_together() -> None:
    @njit
    def choose(test, a, b, out):
        store(out, 0, where_positive(load(test, 0), load(a, 0), load(b, 0)))

    @njit
    def find_smallest(a):
        return smallest(load(a, 0))

    @njit
    def widen(a, out):
        store(out, 0, widened(load(a, 0), out))

    bytes_, shorts = whole_numbers(1), whole_numbers(2, np.uint16)
    for run, arrays in (
        (choose, (bytes_, bytes_, shorts, shorts)),
        (choose, (floats(1), bytes_, bytes_, bytes_)),
        (find_smallest, (floats(1),)),
        (widen, (shorts, bytes_)),
        (widen, (bytes_, floats(1))),
    ):
        with pytest.raises(TypingError):
            run(*arrays)


def test_all_lanes_have_to_be_above_zero() -> None:
    @njit
    def run(a):
        return all_positive(load(a, 0))

    assert run(np.full(FLOAT_LANES, 0.1, dtype=np.float32))
    for wrong in (0.0, -1.0, np.nan):
        for lane in range(FLOAT_LANES):
            values = np.ones(FLOAT_LANES, dtype=np.float32)
            values[lane] = wrong
            assert not run(values)


def test_lanes_are_chosen_where_the_test_is_above_zero() -> None:
    @njit
    def run(test, a, b, out):
        store(out, 0, where_positive(load(test, 0), load(a, 0), load(b, 0)))

    test, a, b, out = floats(3), floats(4), floats(5), np.empty(FLOAT_LANES, dtype=np.float32)
    test[:2] = 0.0, np.nan
    run(test, a, b, out)
    np.testing.assert_array_equal(out, np.where(test > 0, a, b)[:FLOAT_LANES])
    test, a, b = whole_numbers(5) % 3, whole_numbers(6), whole_numbers(7)
    out = np.zeros(WHOLE_LANES, dtype=np.uint8)
    run(test, a, b, out)
    assert out.tolist() == np.where(test != 0, a, b)[:WHOLE_LANES].tolist()


def test_grey_values_are_read_and_written_as_floats() -> None:
    @njit
    def run(greys, out, floors):
        here = load_grey(greys, 3) * spread(np.float32(0.7))
        store(floors, 0, whole(spread(np.float32(0.0)) - here))
        store_grey(out, 2, here)

    greys, out = whole_numbers(8), np.zeros(2 + FLOAT_LANES, dtype=np.uint8)
    floors = np.empty(FLOAT_LANES, dtype=np.float32)
    run(greys, out, floors)
    expected = greys[3 : 3 + FLOAT_LANES] * np.float32(0.7)
    assert out.tolist() == [0, 0, *expected.astype(int).tolist()]
    np.testing.assert_array_equal(floors, np.floor(-expected))


def test_bits_are_counted_and_numbers_widened() -> None:
    @njit
    def run(a, counted, wide, wider):
        here = load(a, 0)
        store(counted, 0, ones(here))
        store(wide, 0, widened(here, wide))
        store(wider, 0, widened(widened(here, counted), wider))

    a = whole_numbers(3)
    out = [np.zeros(WHOLE_LANES, dtype=dtype) for dtype in (np.uint8, np.uint16, np.uint32)]
    run(a, *out)
    assert out[0].tolist() == [int(number).bit_count() for number in a[:WHOLE_LANES]]
    assert out[1].tolist() == out[2].tolist() == a[:WHOLE_LANES].tolist()


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.uint32])
def test_the_smallest_is_found_and_one_number_fills_all(dtype) -> None:
    @njit
    def run(a, number, out):
        store(out, 0, spread(number))
        return smallest(load(a, 7))

    a, out = whole_numbers(4, dtype), np.zeros(WHOLE_LANES, dtype=dtype)
    assert run(a, dtype(201), out) == a[7 : 7 + WHOLE_LANES].min()
    assert (out == 201).all()


@pytest.mark.parametrize(
    "array",
    [np.zeros(64), np.zeros(64, dtype=np.int32), np.zeros(64, dtype=np.float32)[::2]],
)
def test_other_arrays_are_refused(array: np.ndarray) -> None:
    @njit
    def run(array):
        store(array, 0, load(array, 0))

    with pytest.raises(TypingError, match=r"contiguous|unsigned"):
        run(array)


def test_lanes_fit_only_into_an_array_of_their_type() -> None:
    @njit
    def run(a, out):
        store(out, 0, load(a, 0))

    with pytest.raises(TypingError, match="do not fit"):
        run(whole_numbers(1), np.zeros(WHOLE_LANES, dtype=np.uint16))


@pytest.mark.parametrize("lanes", [FLOAT_LANES, WHOLE_LANES])
def test_lanes_are_filled_up(lanes) -> None:
    assert [lanes_for(count, lanes) for count in (1, lanes, lanes + 1)] == [lanes, lanes, 2 * lanes]
