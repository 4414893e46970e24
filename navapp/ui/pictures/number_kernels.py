"""Numbers as text, within compiled code."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

_ZERO = ord("0")


@njit(cache=True, nogil=True)
def write_number(value: int, text: NDArray[np.uint8], n: int) -> int:
    """Write the digits of a number, 0 or more, from place n on; the place behind them."""
    power = 1
    while power * 10 <= value:
        power *= 10
    while power:
        text[n] = _ZERO + value // power % 10
        n += 1
        power //= 10
    return n
