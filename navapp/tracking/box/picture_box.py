"""A box in a picture with real-valued sides, which may reach beyond the picture."""

from dataclasses import dataclass

import numpy as np

from navapp.geometry.transform import FloatArray


@dataclass(frozen=True, slots=True)
class PictureBox:
    """Columns x to x + width and rows y to y + height, px; pixel centres lie at integers."""

    x: float
    y: float
    width: float
    height: float

    @classmethod
    def around(cls, pixels: FloatArray) -> "PictureBox | None":
        """The smallest box around pixel positions (N, 2); None without area, or one not finite."""
        if not np.isfinite(pixels).all():
            return None
        (x, y), (right, bottom) = pixels.min(axis=0).tolist(), pixels.max(axis=0).tolist()
        width, height = right - x, bottom - y
        return cls(x, y, width, height) if width > 0.0 and height > 0.0 else None

    @property
    def centre(self) -> FloatArray:
        """(2,) column and row of its middle."""
        return np.array([self.x + 0.5 * self.width, self.y + 0.5 * self.height])

    def resize(self, factor: float) -> "PictureBox":
        """The same box after its picture was resized: u' = s (u + 0.5) - 0.5."""
        x, y = (factor * (corner + 0.5) - 0.5 for corner in (self.x, self.y))
        return PictureBox(x, y, factor * self.width, factor * self.height)

    def move(self, shift: FloatArray, scale: float = 1.0) -> "PictureBox":
        """Its middle shifted (2,), its sides scaled about the middle."""
        x, y = self.centre + shift
        width, height = scale * self.width, scale * self.height
        return PictureBox(float(x) - 0.5 * width, float(y) - 0.5 * height, width, height)
