"""A bone that is partly buried: poses are drawn, and scored on a map of measured depth.

Tissue that lies on a bone continues its surface. A fit pairs with it as gladly as with the bone and
slides away, even from the true pose. Two things tell the true one: more of the model lies on the
measured surface to within the noise, and nothing is seen through it. Neither is a distance that
could be followed downhill, so poses are drawn and scored: around a rough one, then ever closer
around the best (annealing), at last around each distinct one (cross-entropy).
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.bands import run_both
from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.registration.depth_map import DepthMap
from navapp.registration.model import RegistrationModel
from navapp.registration.multi_start import Candidate, distinct
from navapp.registration.pose_sampler_kernels import SurfacePoints, score_poses

# Always the same draws: the same pictures give the same pose.
_SEED = 20
# Spread of the best, so much wider, is where the next are drawn; never narrower than this.
_WIDENING = 1.2
_LEAST_MM, _LEAST_RAD = 0.02, 2e-4


@dataclass(frozen=True, slots=True)
class Draw:
    """One round of drawing and scoring.

    Attributes:
        n_points: of the model, that are asked.
        n_poses: drawn.
        n_kept: of them, the best.
        shift_mm, turn_deg: standard deviation along and about each axis.
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


# Width of the kernel, and what is drawn. A rough pose may be 20 mm and 15 degrees off. Each round
# is drawn about as wide as the kernel of the one before lets the best ones differ.
_ROUNDS = (
    (3.0, Draw(300, 20_000, 300, 14.0, 8.0)),
    (2.0, Draw(500, 6_000, 150, 4.0, 4.0)),
    (1.2, Draw(800, 4_000, 150, 2.0, 2.0)),
)
# Then so many that differ climb, each on its own, kernel by kernel: many a little, the best of them
# to the end.
_CLIMBS = (
    (60, Draw(500, 100, 15, 1.5, 2.0), (1.2, 1.2, 0.8, 0.8, 0.8)),
    (12, Draw(1000, 200, 25, 0.7, 1.0), (0.5, 0.5, 0.5, 0.5, 0.3, 0.3, 0.3, 0.3)),
)


class PoseSampler:
    """Draws poses of one bone and scores them on maps of depth; holds only what is constant."""

    def __init__(self, model: RegistrationModel) -> None:
        """Put the model's points in an order in which the first n are spread evenly."""
        usable = np.flatnonzero(model.is_usable)
        order = usable[spread_order(model.points_mm[usable])]
        self._centre_mm = model.centre_mm
        self._surface = SurfacePoints(
            np.ascontiguousarray(model.points_mm[order]),
            np.ascontiguousarray(model.normals[order]),
            np.ascontiguousarray(model.sigma_mm[order] ** 2),
        )

    def search(
        self,
        depth: DepthMap,
        rough: RigidTransform,
        n: int,
        on_progress: Callable[[float], None] = lambda share: None,
    ) -> list[Candidate]:
        """At most n distinct poses around a rough one, best first.

        Args:
            depth: measured freely around it.
            rough: camera from bone.
            n: how many.
            on_progress: told the share done; may raise to cancel.
        """
        random = np.random.default_rng(_SEED)
        poses = [rough]
        for k, (sigma_mm, draw) in enumerate(_ROUNDS):
            on_progress(k / (len(_ROUNDS) + 1))
            poses = self._draw(depth, poses, draw, sigma_mm, random)
        on_progress(len(_ROUNDS) / (len(_ROUNDS) + 1))
        found: list[Candidate] = []
        for n_climbing, draw, sigmas_mm in _CLIMBS:
            starts = distinct(poses, self._centre_mm, n_climbing)
            found = [self._climb(depth, pose, draw, sigmas_mm) for pose in starts]
            found.sort(key=lambda one: one.score, reverse=True)
            poses = [one.scene_from_bone for one in found]
        kept = distinct(poses, self._centre_mm, n)
        return [one for one in found if one.scene_from_bone in kept]

    def score(self, depth: DepthMap, pose: RigidTransform, sigma_mm: float, n_points: int) -> float:
        """Of one pose, as `scores`."""
        rotation, shift = pose.rotation[None], pose.translation_mm[None]
        return float(self.scores(depth, rotation, shift, sigma_mm, n_points)[0])

    def scores(
        self,
        depth: DepthMap,
        rotations: FloatArray,
        shifts_mm: FloatArray,
        sigma_mm: float,
        n_points: int,
    ) -> FloatArray:
        """(H,) of poses (H, 3, 3) and (H, 3): the seen area that agrees, less what is seen through.

        Args:
            depth: measured.
            rotations: of the poses, camera from bone.
            shifts_mm: of the poses.
            sigma_mm: width of the kernel.
            n_points: so many of the model are asked.
        """
        scores = np.empty(len(shifts_mm))
        rotations, shifts_mm = np.ascontiguousarray(rotations), np.ascontiguousarray(shifts_mm)

        def run(first: int, last: int) -> None:
            score_poses(
                self._surface, n_points, rotations, shifts_mm, depth.depth_mm, depth.optics,
                sigma_mm, (first, last), scores,
            )  # fmt: skip

        middle = len(scores) // 2
        run_both(lambda: run(0, middle), lambda: run(middle, len(scores)))
        return scores

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
        rotations, shifts = self._move_poses(poses, twists, parents)
        scores = self.scores(depth, rotations, shifts, sigma_mm, draw.n_points)
        names = poses[0].target, poses[0].source
        best = np.argsort(-scores, kind="stable")[: draw.n_kept]
        return [RigidTransform.from_parts(*names, rotations[k], shifts[k]) for k in best]

    def _climb(
        self, depth: DepthMap, start: RigidTransform, draw: Draw, sigmas_mm: tuple[float, ...]
    ) -> Candidate:
        """The best pose about a start by cross-entropy: draw, keep the best, draw as they spread.

        Source: Rubinstein 1999.
        """
        random = np.random.default_rng(_SEED)
        mean, covariance = np.zeros(6), np.diag(draw.deviations**2)
        floor = np.diag(np.repeat([_LEAST_MM, _LEAST_RAD], 3) ** 2)
        score = -1.0
        for sigma_mm in sigmas_mm:
            twists = random.multivariate_normal(mean, covariance, draw.n_poses, method="cholesky")
            twists[0] = mean
            scores = self.scores(depth, *self._move_poses([start], twists), sigma_mm, draw.n_points)
            best = np.argsort(-scores, kind="stable")[: draw.n_kept]
            mean, score = twists[best].mean(axis=0), float(scores[best[0]])
            covariance = _WIDENING**2 * np.cov(twists[best].T) + floor
        return Candidate(start.move(mean, start.apply(self._centre_mm)), score)

    def _move_poses(
        self,
        poses: list[RigidTransform],
        twists: FloatArray,
        parents: NDArray[np.int64] | None = None,
    ) -> tuple[FloatArray, FloatArray]:
        """Rotations (H, 3, 3) and translations (H, 3) of poses moved about the bone's centre."""
        parents = np.zeros(len(twists), dtype=np.int64) if parents is None else parents
        rotations = np.array([pose.rotation for pose in poses])[parents]
        centres_mm = np.array([pose.apply(self._centre_mm) for pose in poses])[parents]
        rotations = _rotations(twists[:, 3:]) @ rotations
        return rotations, centres_mm + twists[:, :3] - rotations @ self._centre_mm


def spread_order(points_mm: FloatArray) -> NDArray[np.int64]:
    """(N,) indices of points (N, 3), such that any first n are spread over all of them.

    Poses are the best of thousands: few points that are spread by chance would find a pose that
    suits them alone. Neighbours follow each other along a curve that fills space (Morton); halving
    it again and again (van der Corput) gives the order.
    """
    size_mm = np.ptp(points_mm, axis=0).max(initial=0.0)
    cells = (points_mm - points_mm.min(axis=0)) * (1023.0 / max(size_mm, 1e-9))
    bits = (cells.astype(np.int64)[:, :, None] >> np.arange(10)) & 1
    along = np.argsort((bits << (3 * np.arange(10) + np.arange(3)[:, None])).sum(axis=(1, 2)))
    n_bits = max(int(len(points_mm) - 1).bit_length(), 1)
    places = np.arange(1 << n_bits)
    halved = np.zeros_like(places)
    for k in range(n_bits):
        halved |= ((places >> k) & 1) << (n_bits - 1 - k)
    order: NDArray[np.int64] = along[halved[halved < len(points_mm)]]
    return order


def _rotations(vectors_rad: FloatArray) -> FloatArray:
    """(H, 3, 3) rotations about vectors (H, 3) by their lengths in rad."""
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.from_rotvec(vectors_rad).as_matrix())
