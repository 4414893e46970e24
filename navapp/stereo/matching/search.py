"""What a matcher has to search: pixels, disparities and the right columns that they reach."""

from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.box import Box
from navapp.geometry.rectification import RectifiedPair

MAX_DISPARITIES = 1024

T = TypeVar("T", bound=np.generic)


@dataclass(frozen=True, slots=True)
class Search:
    """The search of one box over whole disparities."""

    box: Box  # as asked for; may reach beyond the picture
    inside: Box  # its part inside the picture
    lowest: int  # first disparity, px
    # number of disparities. One more than the band needs stands on either side: a best match at the
    # end of the search is no minimum.
    count: int
    # the columns of the right picture that are partners of some pixel; rows of `inside`.
    right: Box

    @classmethod
    def plan(cls, pair: RectifiedPair, band_px: tuple[float, float]) -> "Search":
        """The search of `pair.box` for disparities in a band (px).

        Raises:
            ValueError: pictures that are not grey or differ in size; a band that is none
                or too wide.
        """
        for picture in (pair.left, pair.right):
            if picture.ndim != 2 or picture.dtype != np.uint8:
                raise ValueError(f"grey pictures of 8 bits are needed, not {picture.shape}")
        if pair.left.shape != pair.right.shape:
            raise ValueError(f"pictures differ in size: {pair.left.shape} and {pair.right.shape}")
        low, high = band_px
        if not (np.isfinite(low) and np.isfinite(high) and low < high):
            raise ValueError(f"a disparity band needs two growing numbers, not {band_px}")
        lowest = int(np.floor(low)) - 1
        count = int(np.ceil(high)) + 2 - lowest
        if count > MAX_DISPARITIES:
            raise ValueError(
                f"the band {low:g} to {high:g} px needs {count} disparities; "
                f"at most {MAX_DISPARITIES} are searched: narrow the range of depths"
            )
        height, width = pair.left.shape
        box = Box(pair.box.x, pair.box.y, max(pair.box.width, 0), max(pair.box.height, 0))
        inside = box.clip(width, height)
        reached = Box(
            inside.x - (lowest + count - 1), inside.y, inside.width + count - 1, inside.height
        )
        right = Box(0, 0, 0, 0) if inside.is_empty else reached.clip(width, height)
        return cls(box, inside, lowest, count, right)

    @property
    def shift(self) -> int:
        """Column of `inside`'s first pixel, counted from `right`'s first; may be negative."""
        return self.inside.x - self.right.x

    @property
    def is_empty(self) -> bool:
        """No pixel has a partner."""
        return self.inside.is_empty or self.right.is_empty

    def over_box(self, values: NDArray[T], outside: T) -> NDArray[T]:
        """(h, w) values of `inside` laid into the whole box."""
        out = np.full((self.box.height, self.box.width), outside, dtype=values.dtype)
        x, y = self.inside.x - self.box.x, self.inside.y - self.box.y
        out[y : y + self.inside.height, x : x + self.inside.width] = values
        return out


def crop(image: NDArray[T], box: Box, margin_px: tuple[int, int]) -> NDArray[T]:
    """(h + 2 rows, w + 2 columns) a box of a picture, which it may leave, with a margin around it.

    Outside the picture its edge is repeated.

    Args:
        image: (H, W).
        box: (h, w) of it.
        margin_px: columns and rows of the margin.
    """
    import cv2

    (beside, over), (height, width) = margin_px, image.shape
    rows, above, below = _inside(box.y - over, box.height + 2 * over, height)
    columns, before, after = _inside(box.x - beside, box.width + 2 * beside, width)
    part: Any = image[rows, columns]
    grown: Any = cv2.copyMakeBorder(part, above, below, before, after, cv2.BORDER_REPLICATE)
    return np.asarray(grown, dtype=image.dtype)


def contrast_grey(cropped: NDArray[np.uint8], margin_px: tuple[int, int]) -> NDArray[np.uint8]:
    """(h, w) range of grey levels in the window of the margin's size around each pixel inside."""
    import cv2

    columns, rows = margin_px
    height, width = cropped.shape
    window = np.ones((2 * rows + 1, 2 * columns + 1), dtype=np.uint8)
    spread = cv2.subtract(cv2.dilate(cropped, window), cv2.erode(cropped, window))
    return np.asarray(spread[rows : height - rows, columns : width - columns]).astype(np.uint8)


def _inside(first: int, count: int, size: int) -> tuple[slice, int, int]:
    """What of a range lies inside, at least the edge, and how many are missing on either side."""
    begin, end = (min(max(place, 0), size - 1) for place in (first, first + count - 1))
    before = min(max(begin - first, 0), count - 1)
    return slice(begin, end + 1), before, count - before - (end + 1 - begin)
