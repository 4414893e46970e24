"""Rectangles of pixels: where in a picture something is."""

import math
from dataclasses import dataclass

import numpy as np

from navapp.geometry.transform import FloatArray


@dataclass(frozen=True, slots=True)
class Box:
    """A rectangle of pixels: columns x .. x + width - 1, rows y .. y + height - 1."""

    x: int
    y: int
    width: int
    height: int

    def grow(self, margin_px: int) -> "Box":
        """Larger by a margin on every side."""
        return Box(
            self.x - margin_px,
            self.y - margin_px,
            self.width + 2 * margin_px,
            self.height + 2 * margin_px,
        )

    def clip(self, width: int, height: int) -> "Box":
        """The part inside a picture; its width or height may be 0."""
        x0, y0 = min(max(self.x, 0), width), min(max(self.y, 0), height)
        x1 = min(max(self.x + self.width, x0), width)
        y1 = min(max(self.y + self.height, y0), height)
        return Box(x0, y0, x1 - x0, y1 - y0)

    @property
    def is_empty(self) -> bool:
        """No pixel is inside."""
        return self.width <= 0 or self.height <= 0

    @property
    def slices(self) -> tuple[slice, slice]:
        """Its rows and columns, to index a picture with; it must be clipped."""
        return slice(self.y, self.y + self.height), slice(self.x, self.x + self.width)

    def intersect(self, other: "Box") -> "Box":
        """The pixels of both; its width or height is 0 when there are none."""
        inside = self.relative_to(other).clip(other.width, other.height)
        return Box(inside.x + other.x, inside.y + other.y, inside.width, inside.height)

    def relative_to(self, other: "Box") -> "Box":
        """The same rectangle, its place counted from the first pixel of another box."""
        return Box(self.x - other.x, self.y - other.y, self.width, self.height)

    def shared_slices(self, other: "Box") -> tuple[tuple[slice, slice], tuple[slice, slice]]:
        """Rows and columns of the pixels of both, in an array over this box and over the other."""
        both = self.intersect(other)
        return both.relative_to(self).slices, both.relative_to(other).slices

    @classmethod
    def around(cls, pixels: FloatArray) -> "Box | None":
        """The smallest box around pixel positions (N, 2); None when none is finite."""
        is_finite = np.isfinite(pixels[:, 0]) & np.isfinite(pixels[:, 1])
        finite = pixels if is_finite.all() else pixels[is_finite]
        if len(finite) == 0:
            return None
        columns, rows = finite[:, 0], finite[:, 1]
        x, y = math.floor(columns.min()), math.floor(rows.min())
        last_x, last_y = math.ceil(columns.max()), math.ceil(rows.max())
        return cls(x, y, last_x - x + 1, last_y - y + 1)
