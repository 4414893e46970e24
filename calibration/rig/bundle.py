"""Both cameras, their places and all poses of the board in one robust least squares.

Gauss-Newton with Levenberg's damping; the poses are eliminated view by view (Schur complement), so
that the cost grows with the number of views alone. Residuals count in units of their marks' own
standard errors.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from calibration.rig.equilibration import equilibrated, unit_sizes
from calibration.rig.parameters import RigModel, shape_mm
from calibration.rig.projection import projected
from calibration.targets.boards import Board
from calibration.targets.detection import SeenBoard
from calibration.targets.pairs import SeenPair
from navapp.geometry.transform import FloatArray

_MOST_STEPS, _SETTLED = 40, 1e-9
_FIRST_DAMPING, _MOST_DAMPING = 1e-4, 1e8
# Huber's limit, in robust standard deviations of what is left.
_HUBER = 3.0
_MAD_TO_SIGMA = 1.4826
# Directions that no view tells stay where they are.
_RIDGE = 1e-12
# A printed mark lies where it should to so much of the distance to the next one, along x, y and z
# (one standard deviation): paper shrinks, and a plate bends more than a print is off.
_EXPECTED_SHARE_OFF = (0.01, 0.01, 0.05)


@dataclass(frozen=True, slots=True, eq=False)
class Bundle:
    """A solved rig.

    Attributes:
        model: which numbers were solved for.
        shared: (n_shared,) `parameters` tells their order.
        left_from_board: (V, 6) rotation vector and translation of each view.
        normal: (n_shared, n_shared) information about the shared numbers, the poses eliminated.
        scale: robust standard deviation of what is left, in units of the marks' standard errors.
        residuals_px: per view (n, 2) and (m, 2): seen less predicted, left and right.
        is_settled: the steps came to rest.
    """

    model: RigModel
    shared: FloatArray
    left_from_board: FloatArray
    normal: FloatArray
    scale: float
    residuals_px: list[tuple[FloatArray, FloatArray]]
    is_settled: bool

    @property
    def covariance(self) -> FloatArray:
        """(n_shared, n_shared) of the shared numbers."""
        sizes = unit_sizes(self.normal)
        scaled = equilibrated(self.normal, sizes)
        inverse = np.linalg.pinv(scaled, rcond=1e-15, hermitian=True)
        return equilibrated(inverse, sizes) * self.scale**2

    @property
    def rig_covariance(self) -> FloatArray:
        """(n_rig, n_rig) of the rig's numbers, without the board's."""
        return self.covariance[: self.model.n_rig, : self.model.n_rig]

    @property
    def rms_px(self) -> float:
        """Of all distances between marks seen and predicted, both cameras."""
        squared = [np.sum(part**2, axis=1) for pair in self.residuals_px for part in pair]
        return float(np.sqrt(np.concatenate(squared).mean()))


def solve_bundle(
    board: Board,
    pairs: Sequence[SeenPair],
    model: RigModel,
    shared: FloatArray,
    left_from_board: FloatArray,
    *,
    is_fixed: bool = False,
) -> Bundle:
    """Solve from a start nearby.

    Args:
        board: that was seen.
        pairs: V views.
        model: which numbers are solved for.
        shared: (n_shared,) start.
        left_from_board: (V, 6) start.
        is_fixed: leave the shared numbers as they are and solve for the poses alone.
    """
    shared, left_from_board = shared.copy(), left_from_board.copy()
    damping, is_settled = _FIRST_DAMPING, False
    views = _Views(board, pairs, model)
    linear = _Linearised(views, shared, left_from_board)
    for _ in range(_MOST_STEPS):
        step_shared, step_poses = linear.step(damping, is_fixed)
        moved = left_from_board + step_poses
        trial = _Linearised(views, shared + step_shared, moved, linear.scale)
        if trial.cost <= linear.cost * (1.0 + 1e-12):
            gain = 1.0 - trial.cost / max(linear.cost, 1e-300)
            shared, left_from_board = shared + step_shared, moved
            # The next step weighs by what is left now.
            linear = _Linearised(views, shared, left_from_board)
            damping = max(damping * 0.1, 1e-9)
            if gain < _SETTLED:
                is_settled = True
                break
        elif damping > _MOST_DAMPING:
            is_settled = True
            break
        else:
            damping *= 10.0
    n = 2 * sum(len(pair.left.ids) + len(pair.right.ids) for pair in pairs)
    n_solved = (0 if is_fixed else model.n_shared) + left_from_board.size
    # What was solved for takes its part of the noise with it.
    scale = linear.scale * (n / max(n - n_solved, 1)) ** 0.5
    return Bundle(
        model, shared, left_from_board, linear.reduced(), scale, linear.residuals_px, is_settled
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Views:
    """What stays the same in all steps."""

    board: Board
    pairs: Sequence[SeenPair]
    model: RigModel


class _Linearised:
    """Residuals and normal equations at one place."""

    def __init__(
        self,
        views: _Views,
        shared: FloatArray,
        left_from_board: FloatArray,
        scale: float | None = None,
    ) -> None:
        self._model, self._shared = views.model, shared
        self._views = [
            [
                self._seen(views.board, seen, pose, number)
                for number, seen in enumerate((pair.left, pair.right))
            ]
            for pair, pose in zip(views.pairs, left_from_board, strict=True)
        ]
        self.residuals_px = [(view[0][0], view[1][0]) for view in self._views]
        lengths = np.concatenate(
            [
                np.abs(residual / sigma[:, None]).ravel()
                for view in self._views
                for residual, _, _, sigma in view
            ]
        )
        self.scale = max(_MAD_TO_SIGMA * float(np.median(lengths)), 1e-6)
        self._limit = _HUBER * (self.scale if scale is None else scale)
        self.cost = 0.0
        n = self._model.n_shared
        self._shared_normal, self._shared_right = np.zeros((n, n)), np.zeros(n)
        self._view_normals: list[tuple[FloatArray, FloatArray, FloatArray]] = []
        for view in self._views:
            self._add(view)
        self._expect_board(np.array(_EXPECTED_SHARE_OFF) * views.board.spacing_mm)

    def _seen(
        self, board: Board, seen: SeenBoard, left_from_board: FloatArray, number: int
    ) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Residuals (n, 2), slopes by the shared numbers and by the pose, standard errors (n,)."""
        model = self._model
        points_mm = board.points_mm[seen.ids]
        if model.n_marks:
            points_mm = points_mm + shape_mm(model, self._shared)[seen.ids]
        pixels, by_rig, by_pose, by_point = projected(
            points_mm, left_from_board, model, self._shared, number
        )
        by_shared = np.zeros((len(by_rig), model.n_shared))
        by_shared[:, : model.n_rig] = by_rig
        if model.n_marks:
            rows = np.arange(len(by_rig))[:, None]
            places = model.n_rig + 3 * np.repeat(seen.ids, 2)[:, None] + np.arange(3)
            by_shared[rows, places] = by_point
        # A mark that claims to be far better than the others is not believed.
        sigma = np.hypot(seen.sigma_px, np.median(seen.sigma_px))
        return seen.pixels - pixels, by_shared, by_pose, sigma

    def _add(self, view: list[tuple[FloatArray, FloatArray, FloatArray, FloatArray]]) -> None:
        """Add one view to the normal equations, weighed as Huber does."""
        n = self._model.n_shared
        mixed, own, right = np.zeros((n, 6)), np.zeros((6, 6)), np.zeros(6)
        for residual_px, by_shared, by_pose, sigma_px in view:
            length = np.linalg.norm(residual_px / sigma_px[:, None], axis=1)
            # Two coordinates: their length has a limit a little beyond that of one.
            limit = self._limit
            weight = np.minimum(1.0, limit / np.maximum(length, 1e-12))
            inside = length <= limit
            self.cost += float(np.where(inside, length**2, 2.0 * limit * length - limit**2).sum())
            root = np.repeat(np.sqrt(weight) / sigma_px, 2)
            a, b = by_shared * root[:, None], by_pose * root[:, None]
            r = residual_px.ravel() * root
            self._shared_normal += a.T @ a
            self._shared_right += a.T @ r
            mixed += a.T @ b
            own += b.T @ b
            right += b.T @ r
        self._view_normals.append((mixed, own, right))

    def _expect_board(self, off_mm: FloatArray) -> None:
        """What is known of the marks' places beforehand; it also fixes the board's frame."""
        model = self._model
        if not model.n_marks:
            return
        sigma_mm = np.tile(off_mm, model.n_marks)
        off = self._shared[model.n_rig :] / sigma_mm
        # In the same units as what the pictures say: their noise is `scale` of what they claim.
        trust = self.scale**2
        diagonal = np.arange(model.n_rig, model.n_shared)
        self._shared_normal[diagonal, diagonal] += trust / sigma_mm**2
        self._shared_right[model.n_rig :] -= trust * off / sigma_mm
        self.cost += trust * float(off @ off)

    def step(self, damping: float, is_fixed: bool) -> tuple[FloatArray, FloatArray]:
        """Steps of the shared numbers and of the poses (V, 6)."""
        n = self._model.n_shared
        reduced = self._shared_normal + damping * np.diag(np.diag(self._shared_normal))
        right = self._shared_right.copy()
        inverses = []
        for mixed, own, own_right in self._view_normals:
            inverse = np.linalg.inv(own + damping * np.diag(np.diag(own)))
            inverses.append(inverse)
            reduced -= mixed @ inverse @ mixed.T
            right -= mixed @ inverse @ own_right
        step = np.zeros(n) if is_fixed else _solved(reduced, right)
        poses = [
            inverse @ (own_right - mixed.T @ step)
            for inverse, (mixed, _, own_right) in zip(inverses, self._view_normals, strict=True)
        ]
        return step, np.array(poses)

    def reduced(self) -> FloatArray:
        """(n_shared, n_shared) information about the shared numbers alone."""
        reduced = self._shared_normal.copy()
        for mixed, own, _ in self._view_normals:
            reduced -= mixed @ np.linalg.solve(own, mixed.T)
        return 0.5 * (reduced + reduced.T)


def _solved(normal: FloatArray, right: FloatArray) -> FloatArray:
    """Solution of a symmetric system whose numbers have very different units."""
    sizes = unit_sizes(normal)
    scaled = equilibrated(normal, sizes)
    scaled[np.diag_indices_from(scaled)] += _RIDGE
    solution: FloatArray = sizes * np.linalg.solve(scaled, sizes * right)
    return solution
