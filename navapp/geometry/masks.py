"""Pictures under masks."""

from typing import Any

import numpy as np
from numpy.typing import NDArray


def where(mask: NDArray[np.bool_], values: NDArray[Any], elsewhere: Any) -> NDArray[Any]:
    """As `np.where`, of the values' own type: numpy asks pixel by pixel, OpenCV copies vectors.

    Args:
        mask: (h, w).
        values: (h, w).
        elsewhere: (h, w), or a number.
    """
    import cv2

    answer = np.empty(values.shape, dtype=values.dtype)
    answer[...] = elsewhere
    if values.size:
        cv2.copyTo(values, mask.view(np.uint8), answer)
    return answer
