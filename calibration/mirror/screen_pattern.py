"""The pattern that fills a display while its mirror is calibrated."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from calibration.targets.boards import Board, parse_board
from calibration.targets.detection import Image, SeenBoard, find_board
from calibration.targets.drawing import make_drawing, rasterise
from navapp.geometry.transform import FloatArray

_SQUARES_DOWN, _MARKER_SHARE = 12, 0.75
# Other markers than those of printed boards (docs/calibration.md), so that none is mistaken.
_DICTIONARY, _OTHER_DICTIONARY = "DICT_5X5_1000", "DICT_6X6_1000"


@dataclass(frozen=True, slots=True, eq=False)
class ScreenPattern:
    """A ChArUco board whose unit of length is one pixel of the display."""

    board: Board  # lengths in px
    # width_px, height_px: of the display's picture.
    width_px: int
    height_px: int

    @property
    def margin_px(self) -> tuple[int, int]:
        """White columns left of the board, rows above it."""
        width, height = self.board.size_mm
        return (self.width_px - round(width)) // 2, (self.height_px - round(height)) // 2

    @property
    def pixels(self) -> FloatArray:
        """(N, 2) places of all corners in the picture as the display is handed it."""
        # A corner lies between pixels, whose centres are whole numbers.
        corners: FloatArray = self.board.points_mm[:, :2] + self.margin_px - 0.5
        return corners

    def draw(self) -> NDArray[np.uint8]:
        """(H, W) grey picture for the display."""
        picture = np.full((self.height_px, self.width_px), 255, np.uint8)
        board = rasterise(make_drawing(self.board), 1.0, 0.0)
        left, top = self.margin_px
        picture[top : top + board.shape[0], left : left + board.shape[1]] = board
        return picture


def make_pattern(width_px: int, height_px: int, other: Board | None = None) -> ScreenPattern:
    """The pattern of a display of that size.

    Args:
        width_px: of the display.
        height_px: of the display.
        other: the printed board beside it, whose markers it does not use.
    """
    side = max(8, min(width_px, height_px) // _SQUARES_DOWN // 4 * 4)
    used = "" if other is None else other.dictionary
    content = {
        "type": "charuco",
        "squares_x": width_px // side,
        "squares_y": height_px // side,
        "square_mm": float(side),
        "marker_mm": _MARKER_SHARE * side,
        "dictionary": _OTHER_DICTIONARY if used == _DICTIONARY else _DICTIONARY,
    }
    return ScreenPattern(parse_board(content), width_px, height_px)


def find_pattern(picture: Image, pattern: ScreenPattern) -> tuple[SeenBoard, bool] | None:
    """The pattern in a picture (H, W) grey, and whether it is seen mirrored; None: not seen.

    Markers that are mirrored are none: the picture is looked at as it is, and mirrored.
    """
    as_it_is = find_board(picture, pattern.board)
    turned = find_board(np.ascontiguousarray(picture[:, ::-1]), pattern.board)
    n_plain = 0 if as_it_is is None else len(as_it_is.ids)
    if turned is None or n_plain >= len(turned.ids):
        return None if as_it_is is None else (as_it_is, False)
    pixels = turned.pixels.copy()
    pixels[:, 0] = picture.shape[1] - 1.0 - pixels[:, 0]
    return replace(turned, pixels=pixels), True
