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

    def clip(self, width: int, height: int) -> "PictureBox":
        """The part inside a picture; its sides may be 0."""
        x0, x1 = np.clip([self.x, self.x + self.width], 0.0, width - 1.0)
        y0, y1 = np.clip([self.y, self.y + self.height], 0.0, height - 1.0)
        return PictureBox(float(x0), float(y0), float(x1 - x0), float(y1 - y0))

    def overlap(self, other: "PictureBox") -> float:
        """Intersection over union, 0 to 1."""
        x0, y0 = max(self.x, other.x), max(self.y, other.y)
        x1 = min(self.x + self.width, other.x + other.width)
        y1 = min(self.y + self.height, other.y + other.height)
        shared = max(0.0, x1 - x0) * max(0.0, y1 - y0)
        union = self.width * self.height + other.width * other.height - shared
        return shared / union if union > 0.0 else 0.0
