"""A target as black shapes in mm, and as a grey picture of these."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibration.targets.boards import Board
from navapp.geometry.transform import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Drawing:
    """Black shapes on white paper; x right, y down, from the board's own origin."""

    rectangles_mm: FloatArray  # (n, 4) left, top, right, bottom
    discs_mm: FloatArray  # (n, 3) centre and radius
    # low_mm, high_mm: (2,) corners of what is printed.
    low_mm: FloatArray
    high_mm: FloatArray


def make_drawing(board: Board) -> Drawing:
    """The shapes of a target."""
    if board.has_squares:
        rectangles = _black_squares(board)
        if board.kind == "charuco":
            rectangles += _marker_cells(board)
        return Drawing(np.array(rectangles), np.empty((0, 3)), np.zeros(2), np.array(board.size_mm))
    centres, radius_mm = board.points_mm[:, :2], 0.5 * board.mark_mm
    discs = np.column_stack([centres, np.full(len(centres), radius_mm)])
    low, high = centres.min(axis=0) - radius_mm, centres.max(axis=0) + radius_mm
    return Drawing(np.empty((0, 4)), discs, low, high)


def rasterise(drawing: Drawing, px_per_mm: float, margin_mm: float) -> NDArray[np.uint8]:
    """(H, W) grey picture of the paper with a white margin; pixels tell how white they are.

    The paper's left edge is that of the first pixel, whose centre lies half a pixel inside.
    """
    low = drawing.low_mm - margin_mm
    width, height = np.ceil((drawing.high_mm + margin_mm - low) * px_per_mm).astype(int)
    black = np.zeros((height, width))
    for left, top, right, bottom in (drawing.rectangles_mm - np.tile(low, 2)) * px_per_mm:
        rows, down = _cover_pixels(top, bottom)
        columns, across = _cover_pixels(left, right)
        black[rows, columns] += down[:, None] * across
    for x, y, radius in drawing.discs_mm * px_per_mm - (*(low * px_per_mm), 0.0):
        rows, columns = _around(y, radius), _around(x, radius)
        v, u = np.mgrid[rows, columns]
        distance = np.hypot(u + 0.5 - x, v + 0.5 - y)
        black[rows, columns] += np.clip(radius - distance + 0.5, 0.0, 1.0)
    return np.rint(255.0 * (1.0 - np.minimum(black, 1.0))).astype(np.uint8)


def _cover_pixels(first: float, last: float) -> tuple[slice, FloatArray]:
    """Pixels that an interval touches, and how much of each it covers."""
    pixels = np.arange(int(np.floor(first)), int(np.ceil(last)))
    share: FloatArray = np.minimum(last, pixels + 1.0) - np.maximum(first, pixels)
    return slice(int(pixels[0]), int(pixels[-1]) + 1), share


def _around(middle: float, radius: float) -> slice:
    return slice(int(np.floor(middle - radius - 1.0)), int(np.ceil(middle + radius + 1.0)))


def _black_squares(board: Board) -> list[FloatArray]:
    """Squares without a marker; on a chessboard the first is black."""
    side = board.spacing_mm
    if board.kind == "charuco":
        middles = np.array([np.mean(quad, axis=0)[:2] for quad in board.charuco.getObjPoints()])
        white = {(int(x), int(y)) for x, y in np.floor(middles / side)}
    else:
        white = {(x, y) for x in range(board.columns) for y in range(board.rows) if (x + y) % 2}
    return [
        np.array([x, y, x + 1, y + 1]) * side
        for y in range(board.rows)
        for x in range(board.columns)
        if (x, y) not in white
    ]


def _marker_cells(board: Board) -> list[FloatArray]:
    """Black cells of all markers, those of a row joined."""
    dictionary = board.charuco.getDictionary()
    n_bits = dictionary.markerSize + 2
    side = board.mark_mm / n_bits
    cells = []
    quads, markers = board.charuco.getObjPoints(), np.ravel(board.charuco.getIds())
    for quad, marker in zip(quads, markers, strict=True):
        bits = dictionary.generateImageMarker(int(marker), n_bits, borderBits=1)
        corner = np.asarray(quad, dtype=np.float64)[0, :2]
        for row, line in enumerate(np.asarray(bits) == 0):
            edges = np.flatnonzero(np.diff(np.r_[0, line.astype(int), 0]))
            for first, last in edges.reshape(-1, 2):
                place = np.tile(corner, 2)
                cells.append(place + np.array([first, row, last, row + 1]) * side)
    return cells
