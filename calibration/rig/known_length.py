"""Measures the length of a board that is seen once with a rig, and its standard error."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibration.rig.corner_locator import find_pair
from calibration.rig.initial_rig import matrix_of, pose_of
from calibration.targets.boards import Board
from calibration.targets.detection import SeenBoard
from calibration.targets.seen_pairs import SeenPair
from navapp.geometry.rectification import Image
from navapp.geometry.rig import StereoRig
from navapp.geometry.transform import FloatArray

_FEWEST_MARKS = 12
_N_UNKNOWN = 7


@dataclass(frozen=True, slots=True)
class MeasuredLength:
    """A board's measured size relative to its true one, from one pair."""

    ratio: float  # measured over true
    sigma: float  # its standard error, from what the marks leave


@dataclass(frozen=True, slots=True, eq=False)
class LengthMeter:
    """Finds a board in pairs of pictures and measures it with a rig."""

    board: Board  # of known size
    rig: StereoRig  # that is trusted or not

    def __call__(self, left: Image, right: Image) -> MeasuredLength | None:
        """Measure; None where not both pictures show enough of the board."""
        pair = find_pair(self.board, left, right)
        return None if pair is None else measure_length(self.board, self.rig, pair)


def measure_length(board: Board, rig: StereoRig, pair: SeenPair) -> MeasuredLength | None:
    """The size at which a board fits a pair best, its pose and its size solved for.

    One camera cannot tell a large board from a near one; two can, as far as their places are known.

    Args:
        board: that is seen.
        rig: taken as it is.
        pair: in pixels.

    Returns:
        None when both share too few marks, or the size cannot be told.

    Source: weighted least squares of both pictures' residuals (Gauss-Newton), covariance scaled by
        their chi-square where that is larger than it should be.
    """
    from scipy.optimize import least_squares

    ids, left_px, right_px = pair.common()
    start = pose_of(board, pair.left, rig.left)
    if len(ids) < _FEWEST_MARKS or start is None:
        return None
    points_mm = board.points_mm[ids]
    sigma_px = np.concatenate([_sigma_px(seen, ids) for seen in (pair.left, pair.right)])

    def residuals(numbers: FloatArray) -> FloatArray:
        pose = matrix_of(numbers[:6])
        seen_mm = numbers[6] * points_mm @ pose[:3, :3].T + pose[:3, 3]
        off_px = np.vstack(
            [
                rig.left.project(seen_mm) - left_px,
                rig.right.project(rig.right_from_left.apply(seen_mm)) - right_px,
            ]
        )
        return np.ravel(off_px / sigma_px[:, None])

    begin = np.append(start, 1.0)
    # Of points behind a camera nothing is known, nor can it be stepped back from there.
    if not np.isfinite(residuals(begin)).all():
        return None
    solved = least_squares(residuals, begin, method="lm", x_scale="jac")
    slopes = np.asarray(solved.jac, dtype=np.float64)
    information = slopes.T @ slopes
    if not (solved.success and np.isfinite(information).all()):
        return None
    if np.linalg.matrix_rank(information) < _N_UNKNOWN:
        return None
    n_spare = len(solved.fun) - _N_UNKNOWN
    excess = max(1.0, 2.0 * float(solved.cost) / n_spare)
    sigma = float(np.sqrt(excess * np.linalg.inv(information)[6, 6]))
    return MeasuredLength(float(solved.x[6]), sigma)


def _sigma_px(seen: SeenBoard, ids: NDArray[np.intp]) -> FloatArray:
    """Of these marks, all of which are seen."""
    sigma_px: FloatArray = seen.sigma_px[np.searchsorted(seen.ids, ids)]
    return sigma_px
