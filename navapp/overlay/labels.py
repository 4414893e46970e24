"""Words beside what they name, placed so that none lies over another."""

import math
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.box import Box
from navapp.overlay.colours import Colour
from navapp.overlay.label_kernels import blend_text, find_free_place

Image = NDArray[np.uint8]

# Places of a label around its point, nearest first: directions, and how far away.
_DIRECTIONS = ((1, 0), (-1, 0), (0, -1), (0, 1), (1, -1), (-1, -1), (1, 1), (-1, 1))
_DISTANCES_PX = (14, 34, 60, 92)
# (32, 2) of the box from its point, in px, and shares of its own size.
_OFFSETS_PX = np.array([np.multiply(one, d) for d in _DISTANCES_PX for one in _DIRECTIONS])
_SHARES = np.array([np.subtract(one, 1) / 2.0 for _ in _DISTANCES_PX for one in _DIRECTIONS])
_PADDING_PX, _ROUND_PX = 3, 9
_TEXT_RIM_PX = 2


@dataclass
class LabelBoard:
    """Keeps words until all guides are drawn, then places them."""

    size: float  # of the letters, OpenCV's scale
    # boxes that no label may lie over; those of placed labels come in.
    taken: list[Box] = field(default_factory=list)
    _asked: list[tuple[str, tuple[float, float], Colour]] = field(default_factory=list)

    def add(self, text: str, at_px: NDArray[np.float64], colour: Colour) -> None:
        """Ask for a label beside a point; one that is not in any picture is left out."""
        x, y = at_px.tolist()
        if math.isfinite(x) and math.isfinite(y):
            self._asked.append((text, (x, y), colour))

    def draw(self, image: Image) -> list[Box]:
        """Place and draw what was asked for; where nothing is free, a label is left out."""
        import cv2

        height, width = image.shape[:2]
        # Not over what the words name.
        size = 2 * _ROUND_PX
        named = [
            (round(u) - _ROUND_PX, round(v) - _ROUND_PX, size, size) for _, (u, v), _ in self._asked
        ]
        taken = [(one.x, one.y, one.width, one.height) for one in self.taken] + named
        placed = []
        for text, at, colour in self._asked:
            if not (0 <= at[0] < width and 0 <= at[1] < height):
                continue
            box = self._find_place(text, at, (width, height), taken)
            if box is None:
                continue
            self.taken.append(box)
            taken.append((box.x, box.y, box.width, box.height))
            placed.append(box)
            nearest = (
                int(min(max(at[0], box.x), box.x + box.width)),
                int(min(max(at[1], box.y), box.y + box.height)),
            )
            if math.hypot(nearest[0] - at[0], nearest[1] - at[1]) > 1.5 * _DISTANCES_PX[0]:
                start = round(at[0]), round(at[1])
                cv2.line(image, start, nearest, colour, 1, cv2.LINE_AA)
            baseline = box.y + box.height - _PADDING_PX - round(8 * self.size)
            put_text(image, text, (box.x + _PADDING_PX, baseline), self.size, colour)
        self._asked.clear()
        return placed

    def _find_place(
        self,
        text: str,
        at: tuple[float, float],
        picture_px: tuple[int, int],
        taken: list[tuple[int, int, int, int]],
    ) -> Box | None:
        w, h = text_size(text, self.size)
        w, h = w + 2 * _PADDING_PX, h + 2 * _PADDING_PX
        others = np.array(taken, dtype=np.int64).reshape(-1, 4)
        x, y, is_free = find_free_place(at, _OFFSETS_PX, _SHARES, (w, h), picture_px, others)
        return Box(x, y, w, h) if is_free else None


@lru_cache(maxsize=256)
def text_size(text: str, size: float) -> tuple[int, int]:
    """Width and height of a line in px, with what hangs below it."""
    import cv2

    (width, height), below = cv2.getTextSize(text, cv2.FONT_HERSHEY_SIMPLEX, size, 1)
    return width, height + below


def put_text(image: Image, text: str, at: tuple[int, int], size: float, colour: Colour) -> None:
    """Text with a dark rim, readable on any picture; its baseline begins at a place."""
    letters, rim, above = _text_shares(text, size)
    blend_text(image, letters, rim, (at[0] - _TEXT_RIM_PX, at[1] - above), colour)


@lru_cache(maxsize=64)
def _text_shares(text: str, size: float) -> tuple[NDArray[np.uint8], NDArray[np.uint8], int]:
    """Shares (h, w), 0 to 255, of a line's letters and of their rim; rows above its baseline."""
    import cv2

    font = cv2.FONT_HERSHEY_SIMPLEX
    (width, height), below = cv2.getTextSize(text, font, size, 1)
    above = height + 2 * _TEXT_RIM_PX
    shape = above + below + 2 * _TEXT_RIM_PX, width + 2 * _TEXT_RIM_PX + 2
    drawn = np.zeros(shape, dtype=np.uint8)
    cv2.putText(drawn, text, (_TEXT_RIM_PX, above), font, size, 255, 1, cv2.LINE_AA)
    rim = np.asarray(cv2.dilate(drawn, np.ones((3, 3), np.uint8)), dtype=np.uint8)
    return drawn, rim, above
