"""Lanes do what their numbers would do one by one."""

import numpy as np
import pytest
from numba import njit
from numba.core.errors import TypingError

from navapp.stereo.matching import byte_lane_kernels as lanes
from navapp.stereo.matching.byte_lane_kernels import (
    LANES,
    lanes_for,
    load,
    smallest,
    spread,
    store,
    widened,
)

TWO = {
    lanes.added: lambda a, b: (a + b) % 256,
    lanes.less: lambda a, b: (a - b) % 256,
    lanes.capped_sum: lambda a, b: np.minimum(a + b, 255),
    lanes.what_exceeds: lambda a, b: np.maximum(a - b, 0),
    lanes.differing: np.bitwise_xor,
    lanes.both_bits: np.bitwise_or,
    lanes.smaller: np.minimum,
    lanes.larger: np.maximum,
}


def numbers(seed: int, dtype: type = np.uint8) -> np.ndarray:
    return np.random.default_rng(seed).integers(0, 256, 3 * LANES).astype(dtype)


@pytest.mark.parametrize("operate", TWO)
def test_two_become_one(operate) -> None:
    @njit
    def run(a, b, out):
        store(out, 5, operate(load(a, 3), load(b, 0)))

    a, b, out = numbers(1), numbers(2), np.zeros(3 * LANES, dtype=np.uint8)
    run(a, b, out)
    expected = TWO[operate](a[3 : 3 + LANES].astype(int), b[:LANES].astype(int))
    assert out[5 : 5 + LANES].tolist() == expected.tolist()
    # Nothing else is written.
    assert not out[:5].any()
    assert not out[5 + LANES :].any()


def test_bits_are_counted_numbers_shifted_and_widened() -> None:
    eightfold, ones, upper = lanes.eightfold, lanes.ones, lanes.in_upper_half

    @njit
    def run(a, counted, shifted, raised):
        here = load(a, 0)
        store(counted, 0, ones(here))
        store(shifted, 0, eightfold(widened(here, shifted)))
        store(raised, 0, upper(widened(widened(here, counted), raised)))

    a = numbers(3)
    out = [np.zeros(LANES, dtype=dtype) for dtype in (np.uint8, np.uint16, np.uint32)]
    run(a, *out)
    here = a[:LANES].astype(int)
    assert out[0].tolist() == [int(number).bit_count() for number in here]
    assert out[1].tolist() == (8 * here).tolist()
    assert out[2].tolist() == (65536 * here).tolist()


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.uint32])
def test_the_smallest_is_found_and_one_number_fills_all(dtype) -> None:
    @njit
    def run(a, number, out):
        store(out, 0, spread(number))
        return smallest(load(a, 7))

    a, out = numbers(4, dtype), np.zeros(LANES, dtype=dtype)
    assert run(a, dtype(201), out) == a[7 : 7 + LANES].min()
    assert (out == 201).all()


def test_a_mask_chooses() -> None:
    chosen = lanes.chosen

    @njit
    def run(mask, a, b, out):
        store(out, 0, chosen(load(mask, 0), load(a, 0), load(b, 0)))

    mask, a, b = numbers(5) % 3, numbers(6), numbers(7)
    out = np.zeros(LANES, dtype=np.uint8)
    run(mask, a, b, out)
    assert out.tolist() == np.where(mask != 0, a, b)[:LANES].tolist()


def test_an_array_with_gaps_is_refused() -> None:
    @njit
    def run(a):
        return smallest(load(a, 0))

    with pytest.raises(TypingError, match="contiguous"):
        run(np.zeros(4 * LANES, dtype=np.uint8)[::2])


@pytest.mark.parametrize(("count", "filled"), [(1, LANES), (LANES, LANES), (LANES + 1, 2 * LANES)])
def test_lanes_are_filled_up(count, filled) -> None:
    assert lanes_for(count) == filled
