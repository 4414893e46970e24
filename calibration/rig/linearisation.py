"""Residuals and Jacobian of a rig at one estimate, and the normal equations of its next step.

The poses are eliminated view by view (Schur complement), so that the cost grows with the number of
views alone. Residuals count in units of their marks' own standard errors.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibration.rig.equilibration import compute_unit_sizes, equilibrate
from calibration.rig.parameters import RigModel, unpack_shape_mm
from calibration.rig.projection import project
from calibration.targets.boards import Board
from calibration.targets.detection import SeenBoard
from calibration.targets.seen_pairs import SeenPair
from navapp.geometry.transform import FloatArray

# Huber's limit, in robust standard deviations of what is left.
_HUBER = 3.0
_MAD_TO_SIGMA = 1.4826
# Directions that no view tells stay where they are.
_RIDGE = 1e-12
# A printed mark lies where it should to so much of the distance to the next one, along x, y and z
# (one standard deviation): paper shrinks, and a plate bends more than a print is off.
_EXPECTED_FRACTION_OFF = (0.01, 0.01, 0.05)


@dataclass(frozen=True, slots=True, eq=False)
class Views:
    """Observations and model of a bundle adjustment, the same in all steps."""

    board: Board  # that was seen
    model: RigModel  # which numbers are solved for
    # V left and right ones: the marks, and their standard errors (n,) px.
    pictures: Sequence[tuple[tuple[SeenBoard, FloatArray], ...]]

    @classmethod
    def of(cls, board: Board, pairs: Sequence[SeenPair], model: RigModel) -> "Views":
        """A mark that claims to be far better than the others of its picture is not believed."""
        pictures = [
            tuple(
                (seen, np.hypot(seen.sigma_px, np.median(seen.sigma_px)))
                for seen in (pair.left, pair.right)
            )
            for pair in pairs
        ]
        return cls(board, model, pictures)


@dataclass(frozen=True, slots=True, eq=False)
class _PictureLinearisation:
    """Residuals of one picture and their derivatives."""

    ids: NDArray[np.intp]  # (n,) of the marks
    residual_px: FloatArray  # (n, 2) seen less predicted
    by_rig: FloatArray  # (n, 2, n_rig) slopes
    by_pose: FloatArray  # (n, 2, 6) slopes
    by_place: FloatArray  # (n, 2, 3) slopes by the mark's own place; no other pixel depends on it
    sigma_px: FloatArray  # (n,) standard errors
    length: FloatArray  # (n,) of the residuals, in standard errors


class Linearisation:
    """Residuals of all views and their derivatives, at one estimate.

    Args:
        views: V.
        shared: (n_shared,) numbers of the rig, and of the board's marks.
        left_from_board: (V, 6) poses.
    """

    def __init__(self, views: Views, shared: FloatArray, left_from_board: FloatArray) -> None:
        self.views, self.shared, self.left_from_board = views, shared, left_from_board
        self.pictures = [
            [
                self._linearise_picture(seen, sigma_px, pose, number)
                for number, (seen, sigma_px) in enumerate(view)
            ]
            for view, pose in zip(views.pictures, left_from_board, strict=True)
        ]
        each = [
            np.abs(one.residual_px / one.sigma_px[:, None]).ravel()
            for view in self.pictures
            for one in view
        ]
        self.scale = max(_MAD_TO_SIGMA * float(np.median(np.concatenate(each))), 1e-6)

    @property
    def residuals_px(self) -> list[tuple[FloatArray, FloatArray]]:
        """As a bundle has them."""
        return [(left.residual_px, right.residual_px) for left, right in self.pictures]

    def cost(self, scale: float) -> float:
        """What is left, weighed as Huber does, and how far the marks are from their places.

        Args:
            scale: robust standard deviation that is taken for the noise.
        """
        # Two coordinates: their length has a limit a little beyond that of one.
        limit, total = _HUBER * scale, 0.0
        for view in self.pictures:
            for one in view:
                length = one.length
                beyond = 2.0 * limit * length - limit**2
                total += float(np.where(length <= limit, length**2, beyond).sum())
        _, off = self.marks_off()
        # In the same units as what the pictures say: their noise is `scale` of what they claim.
        return total + scale**2 * float(off @ off)

    def marks_off(self) -> tuple[FloatArray, FloatArray]:
        """Of 3 `n_marks` coordinates: standard deviation mm, and how many of them each is off."""
        model = self.views.model
        expected_mm = np.array(_EXPECTED_FRACTION_OFF) * self.views.board.spacing_mm
        sigma_mm = np.tile(expected_mm, model.n_marks)
        return sigma_mm, self.shared[model.n_rig :] / sigma_mm

    def _linearise_picture(
        self, seen: SeenBoard, sigma_px: FloatArray, left_from_board: FloatArray, number: int
    ) -> _PictureLinearisation:
        """One picture: of the left camera (0) or the right one (1)."""
        model = self.views.model
        points_mm = self.views.board.points_mm[seen.ids]
        if model.n_marks:
            points_mm = points_mm + unpack_shape_mm(model, self.shared)[seen.ids]
        pixels, by_rig, by_pose, by_place = project(
            points_mm, left_from_board, model, self.shared, number
        )
        residual_px = seen.pixels - pixels
        length = np.linalg.norm(residual_px / sigma_px[:, None], axis=1)
        rows = (len(pixels), 2, -1)
        return _PictureLinearisation(
            seen.ids, residual_px, by_rig.reshape(rows), by_pose.reshape(rows),
            by_place.reshape(rows), sigma_px, length,
        )  # fmt: skip


class NormalEquations:
    """Normal equations of a step from one linearisation, with robust weights."""

    def __init__(self, linear: Linearisation) -> None:
        model = linear.views.model
        self._limit, self._n_rig, self._n_marks = _HUBER * linear.scale, model.n_rig, model.n_marks
        self._shared_normal = np.zeros((model.n_shared, model.n_shared))
        self._shared_right = np.zeros(model.n_shared)
        self._view_normals: list[tuple[FloatArray, FloatArray, FloatArray]] = []
        # What the pictures say of a mark's place alone, and of it together with the rig.
        self._of_marks = np.zeros((model.n_marks, 3, 3))
        self._with_rig = np.zeros((model.n_marks, 3, model.n_rig))
        for view in linear.pictures:
            self._add(view)
        self._place_marks()
        self._expect_board(linear)

    def _add(self, view: list[_PictureLinearisation]) -> None:
        """Add one view, weighed as Huber does."""
        n_rig = self._n_rig
        mixed, own, right = np.zeros((len(self._shared_right), 6)), np.zeros((6, 6)), np.zeros(6)
        for one in view:
            weight = np.minimum(1.0, self._limit / np.maximum(one.length, 1e-12))
            root = (np.sqrt(weight) / one.sigma_px)[:, None, None]
            by_rig, by_pose = one.by_rig * root, one.by_pose * root
            r = one.residual_px[..., None] * root
            a, b = by_rig.reshape(-1, n_rig), by_pose.reshape(-1, 6)
            self._shared_normal[:n_rig, :n_rig] += a.T @ a
            self._shared_right[:n_rig] += a.T @ r.ravel()
            mixed[:n_rig] += a.T @ b
            own += b.T @ b
            right += b.T @ r.ravel()
            if self._n_marks:
                by_place = np.swapaxes(one.by_place * root, 1, 2)
                self._of_marks[one.ids] += by_place @ np.swapaxes(by_place, 1, 2)
                self._with_rig[one.ids] += by_place @ by_rig
                mixed[n_rig:].reshape(-1, 3, 6)[one.ids] += by_place @ by_pose
                self._shared_right[n_rig:].reshape(-1, 3, 1)[one.ids] += by_place @ r
        self._view_normals.append((mixed, own, right))

    def _place_marks(self) -> None:
        """Put what was added by mark where it belongs in the shared normal equations."""
        n_rig = self._n_rig
        with_rig = self._with_rig.reshape(-1, n_rig)
        self._shared_normal[n_rig:, :n_rig] = with_rig
        self._shared_normal[:n_rig, n_rig:] = with_rig.T
        places = n_rig + np.arange(3 * self._n_marks).reshape(-1, 3)
        self._shared_normal[places[:, :, None], places[:, None, :]] = self._of_marks

    def _expect_board(self, linear: Linearisation) -> None:
        """What is known of the marks' places beforehand; it also fixes the board's frame."""
        model, trust = linear.views.model, linear.scale**2
        sigma_mm, off = linear.marks_off()
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
        step = np.zeros(n) if is_fixed else _solve_symmetric(reduced, right)
        poses = [
            inverse @ (own_right - mixed.T @ step)
            for inverse, (mixed, _, own_right) in zip(inverses, self._view_normals, strict=True)
        ]
        return step, np.array(poses)

    def compute_reduced_normal(self) -> FloatArray:
        """(n_shared, n_shared) information about the shared numbers alone."""
        reduced = self._shared_normal.copy()
        for mixed, own, _ in self._view_normals:
            reduced -= mixed @ np.linalg.solve(own, mixed.T)
        return 0.5 * (reduced + reduced.T)


def _solve_symmetric(normal: FloatArray, right: FloatArray) -> FloatArray:
    """Solution of a symmetric system whose numbers have very different units."""
    sizes = compute_unit_sizes(normal)
    scaled = equilibrate(normal, sizes)
    scaled[np.diag_indices_from(scaled)] += _RIDGE
    solution: FloatArray = sizes * np.linalg.solve(scaled, sizes * right)
    return solution
