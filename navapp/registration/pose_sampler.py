"""A bone that is partly buried: poses are drawn, and scored on a map of measured depth.

Tissue that lies on a bone continues its surface: a fit pairs with both and slides away, even from
the true pose. At that pose more of the model lies on the measured surface to within the noise, and
nothing is seen through it. Neither can be followed downhill, so poses are drawn and scored: around
a rough one, then ever closer around the best (annealing), at last around each distinct one
(cross-entropy).
"""

from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.bands import in_row_bands
from navapp.geometry.even_order import order_evenly
from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.registration.model import RegistrationModel
from navapp.registration.multi_start import ScoredPose, distinct
from navapp.registration.score_kernels import DepthMap, SurfacePoints, score_poses
from navapp.values.progress import Progress

# All settings below are chosen. Always the same draws: the same pictures give the same pose.
_SEED = 20
# The next poses are drawn so much wider than the best ones spread, and at least so wide.
_WIDENING = 1.2
_LEAST_MM, _LEAST_RAD = 0.02, 2e-4


@dataclass(frozen=True, slots=True)
class Draw:
    """One round: n poses are drawn, scored by n points of the model, and the n best kept.

    `shift_mm` and `turn_deg` are the standard deviation along and about each axis.
    """

    n_points: int
    n_poses: int
    n_kept: int
    shift_mm: float
    turn_deg: float

    @property
    def deviations(self) -> FloatArray:
        """(6,) of a twist."""
        return np.repeat([self.shift_mm, np.radians(self.turn_deg)], 3)


# Width of the kernel (mm), and what is drawn. A rough pose may be 20 mm and 15 degrees off; each
# later round is about as wide as the kernel of the one before lets the best poses differ.
_ROUNDS = (
    (3.0, Draw(300, 20_000, 300, 14.0, 8.0)),
    (2.0, Draw(500, 6_000, 150, 4.0, 4.0)),
    (1.2, Draw(800, 4_000, 150, 2.0, 2.0)),
)
# Then so many distinct poses climb, each on its own, kernel by kernel: many a little, the best of
# them to the end.
_CLIMBS = (
    (60, Draw(500, 100, 15, 1.5, 2.0), (1.2, 1.2, 0.8, 0.8, 0.8)),
    (12, Draw(1000, 200, 25, 0.7, 1.0), (0.5, 0.5, 0.5, 0.5, 0.3, 0.3, 0.3, 0.3)),
)


class PoseSampler:
    """Draws poses of one bone and scores them on maps of depth; holds only what is constant."""

    def __init__(self, model: RegistrationModel) -> None:
        # Poses are the best of thousands: few points that are spread by chance would find a pose
        # that suits them alone.
        usable = np.flatnonzero(model.is_usable)
        order = usable[order_evenly(model.points_mm[usable])]
        self._centre_mm = model.centre_mm
        self._surface = SurfacePoints(
            model.points_mm[order], model.normals[order], model.sigma_mm[order] ** 2
        )

    def search(
        self,
        depth: DepthMap,
        rough: RigidTransform,
        n: int,
        on_progress: Progress = lambda fraction: None,
    ) -> list[ScoredPose]:
        """At most n distinct poses around a rough one (camera from bone), best first.

        `on_progress` is told the fraction done; it may raise to cancel.
        """
        random = np.random.default_rng(_SEED)
        poses = [rough]
        for k, (sigma_mm, draw) in enumerate(_ROUNDS):
            on_progress(k / (len(_ROUNDS) + 1))
            poses = self._draw(depth, poses, draw, sigma_mm, random)
        on_progress(len(_ROUNDS) / (len(_ROUNDS) + 1))
        found: list[ScoredPose] = []
        for n_climbing, draw, sigmas_mm in _CLIMBS:
            starts = distinct(poses, self._centre_mm, n_climbing)
            found = [self._climb(depth, pose, draw, sigmas_mm) for pose in starts]
            found.sort(key=lambda one: one.score, reverse=True)
            poses = [one.scene_from_bone for one in found]
        kept = distinct(poses, self._centre_mm, n)
        return [one for one in found if one.scene_from_bone in kept]

    def score(self, depth: DepthMap, pose: RigidTransform, sigma_mm: float, n_points: int) -> float:
        """The seen area that agrees, less what is seen through, as a fraction of the seen area.

        Under a kernel of width `sigma_mm`, by the first `n_points` of the model.
        """
        rotation, shift_mm = np.array(pose.rotation[None]), np.array(pose.translation_mm[None])
        found = np.empty(1)
        score_poses(self._surface, n_points, rotation, shift_mm, depth, sigma_mm, found, (0, 1))
        return float(found[0])

    def _draw(
        self,
        depth: DepthMap,
        poses: list[RigidTransform],
        draw: Draw,
        sigma_mm: float,
        random: np.random.Generator,
    ) -> list[RigidTransform]:
        """The best of many poses around some, and of those themselves."""
        parents = random.integers(0, len(poses), draw.n_poses)
        twists = random.standard_normal((draw.n_poses, 6)) * draw.deviations
        parents[: len(poses)], twists[: len(poses)] = np.arange(len(poses)), 0.0
        rotations = np.array([pose.rotation for pose in poses])[parents]
        centres_mm = np.array([pose.apply(self._centre_mm) for pose in poses])[parents]
        rotations, shifts_mm = self._move(rotations, centres_mm, twists)
        best, _ = self._find_best(depth, (rotations, shifts_mm), draw, sigma_mm)
        frames = poses[0].target, poses[0].source
        return [RigidTransform.from_parts(*frames, rotations[k], shifts_mm[k]) for k in best]

    def _climb(
        self, depth: DepthMap, start: RigidTransform, draw: Draw, sigmas_mm: tuple[float, ...]
    ) -> ScoredPose:
        """The best pose about a start by cross-entropy: draw, keep the best, draw as they spread.

        Source: Rubinstein 1999.
        """
        random = np.random.default_rng(_SEED)
        mean, covariance = np.zeros(6), np.diag(draw.deviations**2)
        floor = np.diag(np.repeat([_LEAST_MM, _LEAST_RAD], 3) ** 2)
        rotation, centre_mm = np.array(start.rotation), start.apply(self._centre_mm)
        scores = np.full(1, -1.0)
        for sigma_mm in sigmas_mm:
            twists = random.multivariate_normal(mean, covariance, draw.n_poses, method="cholesky")
            twists[0] = mean
            moved = self._move(rotation, centre_mm, twists)
            best, scores = self._find_best(depth, moved, draw, sigma_mm)
            mean = twists[best].mean(axis=0)
            covariance = _WIDENING**2 * np.cov(twists[best].T) + floor
        return ScoredPose(start.move(mean, centre_mm), float(scores[0]))

    def _move(
        self, rotations: FloatArray, centres_mm: FloatArray, twists: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """(H, 3, 3) and (H, 3) of poses moved by twists (H, 6) about where the bone's centre is."""
        from scipy.spatial.transform import Rotation

        rotations = np.asarray(Rotation.from_rotvec(twists[:, 3:]).as_matrix()) @ rotations
        return rotations, centres_mm + twists[:, :3] - rotations @ self._centre_mm

    def _find_best(
        self, depth: DepthMap, poses: tuple[FloatArray, FloatArray], draw: Draw, sigma_mm: float
    ) -> tuple[NDArray[np.intp], FloatArray]:
        """Indices and scores of the poses to keep, best first."""
        scores = np.empty(len(poses[0]))
        fixed = self._surface, draw.n_points, *poses, depth, sigma_mm, scores
        in_row_bands(len(scores), partial(score_poses, *fixed))
        best = np.argsort(-scores, kind="stable")[: draw.n_kept]
        return best, scores[best]
