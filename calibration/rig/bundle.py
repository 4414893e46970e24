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
    views = _Views(board, pairs, model, [_believed_px(pair) for pair in pairs])
    here = _Place(views, shared.copy(), left_from_board.copy())
    cost, normal = here.cost(here.scale), _NormalEquations(here)
    damping, is_settled = _FIRST_DAMPING, False
    for _ in range(_MOST_STEPS):
        step_shared, step_poses = normal.step(damping, is_fixed)
        there = _Place(views, here.shared + step_shared, here.left_from_board + step_poses)
        there_cost = there.cost(here.scale)
        if there_cost <= cost * (1.0 + 1e-12):
            gain = 1.0 - there_cost / max(cost, 1e-300)
            # The next step weighs by what is left now.
            here = there
            cost, normal = here.cost(here.scale), _NormalEquations(here)
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
    scale = here.scale * (n / max(n - n_solved, 1)) ** 0.5
    return Bundle(
        model, here.shared, here.left_from_board, normal.reduced(), scale, here.residuals_px,
        is_settled,
    )  # fmt: skip


@dataclass(frozen=True, slots=True, eq=False)
class _Views:
    """What stays the same in all steps.

    Attributes:
        board: that was seen.
        pairs: views.
        model: which numbers are solved for.
        sigma_px: of each view, of the left and the right marks (n,).
    """

    board: Board
    pairs: Sequence[SeenPair]
    model: RigModel
    sigma_px: Sequence[tuple[FloatArray, FloatArray]]


@dataclass(frozen=True, slots=True, eq=False)
class _Residuals:
    """Of one picture.

    Attributes:
        residual_px: (n, 2) seen less predicted.
        by_shared: (2 n, n_shared) slopes.
        by_pose: (2 n, 6) slopes.
        sigma_px: (n,) standard errors.
        length: (n,) of the residuals, in standard errors.
    """

    residual_px: FloatArray
    by_shared: FloatArray
    by_pose: FloatArray
    sigma_px: FloatArray
    length: FloatArray


class _Place:
    """What the views leave, and how it changes, at one place."""

    def __init__(self, views: _Views, shared: FloatArray, left_from_board: FloatArray) -> None:
        self.views, self.shared, self.left_from_board = views, shared, left_from_board
        self.residuals = [
            [
                self._seen(seen, sigma_px, pose, number)
                for number, (seen, sigma_px) in enumerate(
                    zip((pair.left, pair.right), sigmas_px, strict=True)
                )
            ]
            for pair, sigmas_px, pose in zip(
                views.pairs, views.sigma_px, left_from_board, strict=True
            )
        ]
        each = [
            np.abs(one.residual_px / one.sigma_px[:, None]).ravel()
            for view in self.residuals
            for one in view
        ]
        self.scale = max(_MAD_TO_SIGMA * float(np.median(np.concatenate(each))), 1e-6)

    @property
    def residuals_px(self) -> list[tuple[FloatArray, FloatArray]]:
        """As a bundle has them."""
        return [(left.residual_px, right.residual_px) for left, right in self.residuals]

    def cost(self, scale: float) -> float:
        """What is left, weighed as Huber does, and how far the marks are from their places.

        Args:
            scale: robust standard deviation that is taken for the noise.
        """
        # Two coordinates: their length has a limit a little beyond that of one.
        limit, total = _HUBER * scale, 0.0
        for view in self.residuals:
            for one in view:
                length = one.length
                beyond = 2.0 * limit * length - limit**2
                total += float(np.where(length <= limit, length**2, beyond).sum())
        _, off = self.marks_off()
        # In the same units as what the pictures say: their noise is `scale` of what they claim.
        return total + self.scale**2 * float(off @ off)

    def marks_off(self) -> tuple[FloatArray, FloatArray]:
        """(k,) standard deviations mm of the marks' coordinates, and (k,) how many of them off."""
        model = self.views.model
        expected_mm = np.array(_EXPECTED_SHARE_OFF) * self.views.board.spacing_mm
        sigma_mm = np.tile(expected_mm, model.n_marks)
        return sigma_mm, self.shared[model.n_rig :] / sigma_mm

    def _seen(
        self, seen: SeenBoard, sigma_px: FloatArray, left_from_board: FloatArray, number: int
    ) -> _Residuals:
        model = self.views.model
        points_mm = self.views.board.points_mm[seen.ids]
        if model.n_marks:
            points_mm = points_mm + shape_mm(model, self.shared)[seen.ids]
        pixels, by_rig, by_pose, by_point = projected(
            points_mm, left_from_board, model, self.shared, number
        )
        by_shared = np.zeros((len(by_rig), model.n_shared))
        by_shared[:, : model.n_rig] = by_rig
        if model.n_marks:
            rows = np.arange(len(by_rig))[:, None]
            places = model.n_rig + 3 * np.repeat(seen.ids, 2)[:, None] + np.arange(3)
            by_shared[rows, places] = by_point
        residual_px = seen.pixels - pixels
        length = np.linalg.norm(residual_px / sigma_px[:, None], axis=1)
        return _Residuals(residual_px, by_shared, by_pose, sigma_px, length)


class _NormalEquations:
    """What a step at one place is solved from, weighed by what is left there."""

    def __init__(self, place: _Place) -> None:
        n = place.views.model.n_shared
        self._limit = _HUBER * place.scale
        self._shared_normal, self._shared_right = np.zeros((n, n)), np.zeros(n)
        self._view_normals: list[tuple[FloatArray, FloatArray, FloatArray]] = []
        for view in place.residuals:
            self._add(view)
        self._expect_board(place)

    def _add(self, view: list[_Residuals]) -> None:
        """Add one view, weighed as Huber does."""
        n = len(self._shared_right)
        mixed, own, right = np.zeros((n, 6)), np.zeros((6, 6)), np.zeros(6)
        for one in view:
            weight = np.minimum(1.0, self._limit / np.maximum(one.length, 1e-12))
            root = np.repeat(np.sqrt(weight) / one.sigma_px, 2)
            a, b = one.by_shared * root[:, None], one.by_pose * root[:, None]
            r = one.residual_px.ravel() * root
            self._shared_normal += a.T @ a
            self._shared_right += a.T @ r
            mixed += a.T @ b
            own += b.T @ b
            right += b.T @ r
        self._view_normals.append((mixed, own, right))

    def _expect_board(self, place: _Place) -> None:
        """What is known of the marks' places beforehand; it also fixes the board's frame."""
        model, trust = place.views.model, place.scale**2
        sigma_mm, off = place.marks_off()
        diagonal = np.arange(model.n_rig, model.n_shared)
        self._shared_normal[diagonal, diagonal] += trust / sigma_mm**2
        self._shared_right[model.n_rig :] -= trust * off / sigma_mm

    def step(self, damping: float, is_fixed: bool) -> tuple[FloatArray, FloatArray]:
        """Steps of the shared numbers and of the poses (V, 6)."""
        n = len(self._shared_right)
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


def _believed_px(pair: SeenPair) -> tuple[FloatArray, FloatArray]:
    """Standard errors (n,) and (m,) of the marks in both pictures.

    A mark that claims to be far better than the others is not believed.
    """
    left, right = (
        np.hypot(seen.sigma_px, np.median(seen.sigma_px)) for seen in (pair.left, pair.right)
    )
    return left, right


def _solved(normal: FloatArray, right: FloatArray) -> FloatArray:
    """Solution of a symmetric system whose numbers have very different units."""
    sizes = unit_sizes(normal)
    scaled = equilibrated(normal, sizes)
    scaled[np.diag_indices_from(scaled)] += _RIDGE
    solution: FloatArray = sizes * np.linalg.solve(scaled, sizes * right)
    return solution
