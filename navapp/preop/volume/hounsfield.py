"""Arrays of Hounsfield units: padding becomes air, and the smallest type that fits is used."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

HuArray = NDArray[np.int16] | NDArray[np.float32]

# The bottom of the 12-bit scale. Lower values are padding around the picture: nothing absorbs
# less than air, at -1000 HU.
PADDING_HU = -1024


def replace_padding(values: NDArray[Any]) -> NDArray[Any]:
    """A copy in which everything below air, and everything that is no number, is air."""
    if np.issubdtype(values.dtype, np.floating):
        values = np.nan_to_num(values, nan=PADDING_HU, posinf=PADDING_HU, neginf=PADDING_HU)
    elif values.dtype != np.int16:
        # A type that cannot hold the bound is widened first.
        values = values.astype(np.int64)
    floored: NDArray[Any] = np.maximum(values, PADDING_HU)
    return floored


def convert_compactly(values: NDArray[Any]) -> HuArray:
    """Whole numbers that fit as int16, everything else as float32."""
    if np.issubdtype(values.dtype, np.integer):
        limits = np.iinfo(np.int16)
        if values.min() >= limits.min and values.max() <= limits.max:
            return values.astype(np.int16, copy=False)
    return values.astype(np.float32, copy=False)
