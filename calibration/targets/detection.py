"""Finds a target in a picture and locates its marks with sub-pixel accuracy."""

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from calibration.targets.boards import Board
from calibration.targets.circle_kernels import fit_circles
from calibration.targets.corner_kernels import fit_corners
from calibration.targets.mark_kernels import N_TOLD
from navapp.geometry.transform import FloatArray

# Edges are straight over so much of a square, and lenses bend no line within so many pixels.
_RADIUS_PER_SQUARE, _MOST_RADIUS_PX, _LEAST_RADIUS_PX = 0.45, 16.0, 3.0
# A mark farther from where the detector put it is another one.
_MOST_SHIFT_PX = 3.0
_ROUGH_WINDOW_PX = 4
_LEAST_CONTRAST = 6.0
_NEIGHBOURS, _FEWEST_MARKS = 9, 6
# Blur of a mark reaches so many standard deviations.
_BLUR_REACH = 2.0

Image = NDArray[np.uint8]


@dataclass(frozen=True, slots=True, eq=False)
class SeenBoard:
    """Marks of a target found in one picture."""

    ids: NDArray[np.intp]  # (n,) rows of `Board.points_mm`, ascending
    pixels: FloatArray  # (n, 2) where they are seen; integer coordinates are centres of pixels
    sigma_px: FloatArray  # (n,) standard error of each coordinate, from what the fit leaves
    blur_px: float  # median standard deviation of the blur of the marks' edges


def find_board(picture: Image, board: Board) -> SeenBoard | None:
    """Find a target.

    Args:
        picture: (H, W) grey.
        board: what to look for; of a ChArUco board a part is enough.

    Returns:
        None when it is not seen, or fewer than six marks of it.
    """
    found = _FINDERS[board.kind](picture, board)
    if found is None or len(found[0]) < _FEWEST_MARKS:
        return None
    ids, rough = found
    order = np.argsort(ids)
    ids, rough = ids[order], rough[order]
    told = (_locate_corners if board.has_squares else _locate_circles)(picture, board, ids, rough)
    shift_px = np.linalg.norm(told[:, :2] - rough, axis=1)
    good = (shift_px < _MOST_SHIFT_PX) & (told[:, 4] > _LEAST_CONTRAST)
    if np.count_nonzero(good) < _FEWEST_MARKS:
        return None
    told = told[good]
    return SeenBoard(ids[good], told[:, :2].copy(), told[:, 2].copy(), float(np.median(told[:, 3])))


def _find_charuco(picture: Image, board: Board) -> tuple[NDArray[np.intp], FloatArray] | None:
    detector = cv2.aruco.CharucoDetector(board.charuco)
    corners, ids, _, _ = detector.detectBoard(picture)
    return None if corners is None else (_flat_ids(ids), _refine_corners(picture, corners))


def _find_chessboard(picture: Image, board: Board) -> tuple[NDArray[np.intp], FloatArray] | None:
    size = (board.columns - 1, board.rows - 1)
    flags = cv2.CALIB_CB_ADAPTIVE_THRESH | cv2.CALIB_CB_NORMALIZE_IMAGE
    # The quick look first: it says no soon when there is no board.
    is_found, corners = cv2.findChessboardCorners(picture, size, flags=flags)
    if not is_found:
        is_found, corners = cv2.findChessboardCornersSB(
            picture, size, flags=cv2.CALIB_CB_EXHAUSTIVE
        )
    if not is_found or not _are_inside(picture, corners):
        return None
    corners = _refine_corners(picture, corners)
    if _is_turned(picture, board, corners):
        corners = corners[::-1]
    return np.arange(len(corners)), corners


def _find_circles(picture: Image, board: Board) -> tuple[NDArray[np.intp], FloatArray] | None:
    is_symmetric = board.kind == "circles"
    flags = cv2.CALIB_CB_SYMMETRIC_GRID if is_symmetric else cv2.CALIB_CB_ASYMMETRIC_GRID
    is_found, centres = cv2.findCirclesGrid(picture, (board.columns, board.rows), flags=flags)
    if not is_found:
        return None
    centres = np.asarray(centres, dtype=np.float64).reshape(-1, 2)
    return np.arange(len(centres)), centres


_FINDERS: dict[str, Any] = {
    "charuco": _find_charuco,
    "chessboard": _find_chessboard,
    "circles": _find_circles,
    "circles_asymmetric": _find_circles,
}


def _are_inside(picture: Image, corners: Any) -> bool:
    """A board of another size than was asked for is continued beyond the picture's edges."""
    pixels = np.asarray(corners, dtype=np.float64).reshape(-1, 2)
    return bool((pixels >= 0.0).all() and (pixels < picture.shape[::-1]).all())


def _flat_ids(ids: Any) -> NDArray[np.intp]:
    return np.asarray(ids, dtype=np.intp).reshape(-1)


def _refine_corners(picture: Image, corners: Any) -> FloatArray:
    """OpenCV's refinement: near enough for ours."""
    criteria = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 40, 1e-3)
    corners = np.asarray(corners, dtype=np.float32).reshape(-1, 1, 2).copy()
    window = (_ROUGH_WINDOW_PX, _ROUGH_WINDOW_PX)
    refined = cv2.cornerSubPix(picture, corners, window, (-1, -1), criteria)
    return np.asarray(refined, dtype=np.float64).reshape(-1, 2)


def _is_turned(picture: Image, board: Board, corners: FloatArray) -> bool:
    """Whether the detector began at the other end of the board.

    The first square is black; after half a turn a white one is the first where the numbers of
    columns and rows are not both odd or both even. Where they are, both ends look alike.
    """
    if (board.columns + board.rows) % 2 == 0:
        return False
    grid = corners.reshape(board.rows - 1, board.columns - 1, 2)
    centres = 0.25 * (grid[:-1, :-1] + grid[1:, :-1] + grid[:-1, 1:] + grid[1:, 1:])
    x = np.clip(np.rint(centres[..., 0]).astype(int), 0, picture.shape[1] - 1)
    y = np.clip(np.rint(centres[..., 1]).astype(int), 0, picture.shape[0] - 1)
    is_even = np.add.outer(np.arange(len(centres)), np.arange(centres.shape[1])) % 2 == 0
    grey = picture[y, x].astype(np.float64)
    # The square between the first four inner corners has the first square's colour.
    return bool(grey[is_even].mean() > grey[~is_even].mean())


def _locate_corners(
    picture: Image, board: Board, ids: NDArray[np.intp], rough: FloatArray
) -> FloatArray:
    """(n, 5) as `fit_corner` tells."""
    maps = _local_maps(board.points_mm[ids, :2], rough)
    scale = np.sqrt(np.abs(np.linalg.det(maps)))
    square_px = scale * board.spacing_mm
    radius = np.clip(_RADIUS_PER_SQUARE * square_px, _LEAST_RADIUS_PX, _MOST_RADIUS_PX)
    along = np.full(len(ids), board.spacing_mm)
    # Blurred marks shine into the clear strip.
    aside = np.full(len(ids), board.clear_mm)
    if board.kind == "charuco":
        aside -= _BLUR_REACH / scale
    else:
        along *= 0.9
        aside = along.copy()
    limits = np.column_stack([radius, along, np.maximum(aside, 2.0 / scale)])
    told = np.empty((len(ids), N_TOLD))
    fit_corners(picture, rough, maps, limits, told)
    return told


def _locate_circles(
    picture: Image, board: Board, ids: NDArray[np.intp], rough: FloatArray
) -> FloatArray:
    """(n, 5) as `fit_circle` tells, with the centres where perspective has them."""
    points_mm = board.points_mm[ids, :2]
    maps = _local_maps(points_mm, rough)
    homography: Any = cv2.findHomography(points_mm, rough)[0]
    told = np.full((len(ids), N_TOLD), np.nan)
    if homography is None:
        return told
    horizon = np.linalg.inv(homography).T[:, 2]
    nearest_mm = board.spacing_mm * (1.0 if board.kind == "circles" else 2.0**0.5)
    fit_circles(
        picture, rough, maps * (0.5 * board.mark_mm), nearest_mm / board.mark_mm, horizon, told
    )
    return told


def _local_maps(points_mm: FloatArray, pixels: FloatArray) -> FloatArray:
    """(n, 2, 2) px from mm around each mark: the affine map of its neighbours."""
    squared = ((points_mm[:, None] - points_mm[None]) ** 2).sum(axis=2)
    nearest = np.argsort(squared, axis=1, kind="stable")[:, :_NEIGHBOURS]
    a = points_mm[nearest] - points_mm[nearest].mean(axis=1, keepdims=True)
    b = pixels[nearest] - pixels[nearest].mean(axis=1, keepdims=True)
    normal = np.einsum("nki,nkj->nij", a, a) + 1e-9 * np.eye(2)
    mixed = np.einsum("nki,nkj->nij", b, a)
    maps: FloatArray = mixed @ np.linalg.inv(normal)
    return maps
