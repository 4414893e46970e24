"""Boxes in pictures compared with true ones."""

import numpy as np

from navapp.tracking.box.picture_box import PictureBox


def clip(box: PictureBox, width: int, height: int) -> PictureBox:
    """The part of a box inside a picture; its sides may be 0."""
    x0, x1 = np.clip([box.x, box.x + box.width], 0.0, width - 1.0)
    y0, y1 = np.clip([box.y, box.y + box.height], 0.0, height - 1.0)
    return PictureBox(float(x0), float(y0), float(x1 - x0), float(y1 - y0))


def overlap(one: PictureBox, other: PictureBox) -> float:
    """Intersection over union, 0 to 1."""
    x0, y0 = max(one.x, other.x), max(one.y, other.y)
    x1 = min(one.x + one.width, other.x + other.width)
    y1 = min(one.y + one.height, other.y + other.height)
    shared = max(0.0, x1 - x0) * max(0.0, y1 - y0)
    union = one.width * one.height + other.width * other.height - shared
    return shared / union if union > 0.0 else 0.0
