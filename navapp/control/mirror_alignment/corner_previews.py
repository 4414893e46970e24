"""Small pictures of the cameras: the board from near, with the corner that is to be aligned."""

import numpy as np
from numpy.typing import NDArray

from calibration.targets.detection import SeenBoard
from drivers.frames import Image
from navapp.control.capture.board_view import BoardView

_WIDTH_PX, _HEIGHT_PX = 192, 128
_MARGIN = 0.15
_MARK_BGR, _FIRST_BGR, _CORNER_BGR = (90, 235, 90), (60, 60, 255), (40, 220, 255)


def preview_board(picture: Image, seen: SeenBoard | None, corner: int | None) -> NDArray[np.uint8]:
    """(128, 192, 3) BGR of the board in a picture, or of the whole picture without one.

    Args:
        picture: of a camera.
        seen: the board in it; its marks are drawn, the first one red.
        corner: id of the mark that is ringed.
    """
    import cv2

    left, top, scale = _window(picture.shape[1], picture.shape[0], seen)
    place = np.array([[scale, 0.0, -scale * left], [0.0, scale, -scale * top]])
    # The mean over the pixels that become one.
    coarse = max(1, int(1.0 / scale))
    blurred = cv2.blur(picture, (coarse, coarse)) if coarse > 1 else picture
    small = np.asarray(cv2.warpAffine(blurred, place, (_WIDTH_PX, _HEIGHT_PX)), dtype=np.uint8)
    if small.ndim == 2:
        small = np.asarray(cv2.cvtColor(small, cv2.COLOR_GRAY2BGR), dtype=np.uint8)
    if seen is None:
        return small
    for id_, pixel in zip(seen.ids, seen.pixels, strict=True):
        x, y = np.rint(place[:, :2] @ pixel + place[:, 2]).astype(int).tolist()
        if id_ == corner:
            cv2.circle(small, (x, y), 11, _CORNER_BGR, 3)
        else:
            is_first = id_ == 0
            cv2.circle(
                small, (x, y), 5 if is_first else 2, _FIRST_BGR if is_first else _MARK_BGR, -1
            )
    return small


def _window(width: int, height: int, seen: SeenBoard | None) -> tuple[float, float, float]:
    """Left, top (px of the picture) and scale of the part that is shown."""
    low, high = np.zeros(2), np.array([width - 1.0, height - 1.0])
    if seen is not None:
        low, high = seen.pixels.min(axis=0), seen.pixels.max(axis=0)
        low, high = low - _MARGIN * (high - low), high + _MARGIN * (high - low)
    scale = float(min(np.array([_WIDTH_PX, _HEIGHT_PX]) / np.maximum(high - low, 1.0)))
    middle = 0.5 * (low + high)
    return (
        float(middle[0] - 0.5 * _WIDTH_PX / scale),
        float(middle[1] - 0.5 * _HEIGHT_PX / scale),
        scale,
    )


def preview_seen(
    view: BoardView | None, frame_pictures: tuple[Image, Image] | None, corner: int | None
) -> tuple[NDArray[np.uint8], NDArray[np.uint8]] | None:
    """Of the left and right camera; None before the first frame.

    Args:
        view: the newest look for the board.
        frame_pictures: the newest ones, where there was no look yet.
        corner: id of the mark that is ringed.
    """
    if view is not None:
        frame = view.frame
        return (
            preview_board(frame.left, view.left, corner),
            preview_board(frame.right, view.right, corner),
        )
    if frame_pictures is None:
        return None
    return preview_board(frame_pictures[0], None, None), preview_board(
        frame_pictures[1], None, None
    )
