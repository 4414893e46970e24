"""Many starts, one answer: starts, coarse fits, distinct poses, their ranking."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Protocol, Self, TypeVar

import numpy as np

from navapp.geometry.bands import map_both
from navapp.geometry.directions import sphere_spiral
from navapp.geometry.transform import FloatArray, RigidTransform, rotation_angle_deg
from navapp.registration.bimcc import DEFAULT, fit_coarsely
from navapp.registration.bimcc_kernels import BimccSettings
from navapp.registration.model import RegistrationModel
from navapp.registration.pairing_kernels import (
    Pose,
    make_pairs,
    measure_pairs,
    pair_backward,
    pair_forward,
)
from navapp.registration.scene import Scene
from navapp.registration.step_kernels import weigh
from navapp.values import PoseEstimate, Reason
from navapp.values.progress import Progress

# All chosen; the starts for rough poses 15 deg and 20 mm off.
# Poses nearer than this are the same answer.
_SAME_MM, _SAME_DEG = 2.0, 2.0
_COARSE_POINTS = 400
# Tilts (deg, how many) of a rough pose, nearby; then also of what it becomes when shifted.
_NEAR_TILTS, _FAR_TILTS = (15.0, 12), ((15.0, 12), (28.0, 20))
_FAR_SHIFT_MM = 8.0
# So many poses are fitted to all points, of those that explain so much of what the best does.
_N_REFINED, _REFINED_FRACTION = 3, 0.5
# A different pose that explains as much as this of the best one makes that one ambiguous.
AMBIGUOUS_FRACTION = 0.9
# Near the outline little of a surface is seen, and its depth is uncertain.
_LEAST_COSINE = 0.45
# Of the coverage: about so many model points are asked, the scene's own may be so far apart, so
# many widths of the kernel are near.
_N_ASKED, _REACH_MM, _NEAR_SIGMAS = 3000, 10.0, 1.5
# For starts that are near, or may be anywhere.
NEAR_SETTINGS = BimccSettings(model_points=1000, max_iterations=35)
ANYWHERE_SETTINGS = BimccSettings(model_points=1000, max_iterations=60, widest_mm=30.0)


@dataclass(frozen=True, slots=True, eq=False)
class ScoredPose:
    """A pose that a search found, and how much it explains; scores compare within one search."""

    scene_from_bone: RigidTransform
    score: float


class _RankedFit(Protocol):
    """What `rank_fits` asks of a fit."""

    @property
    def estimate(self) -> PoseEstimate: ...

    def with_reason(self, reason: Reason) -> Self: ...


AnyFit = TypeVar("AnyFit", bound=_RankedFit)


def make_near_starts(rough: RigidTransform, place_mm: FloatArray) -> list[RigidTransform]:
    """A rough pose, and tilts of it about a place (3,) in the scene's frame: tried first."""
    return make_tilted_starts(rough, place_mm, _NEAR_TILTS)


def make_far_starts(rough: RigidTransform, place_mm: FloatArray) -> list[RigidTransform]:
    """Tilts of a rough pose, and of what it becomes when shifted: tried when the near ones fail."""
    return make_scattered_starts(rough, place_mm, _FAR_SHIFT_MM, _FAR_TILTS)


def make_tilted_starts(
    pose: RigidTransform, place_mm: FloatArray, *tilts: tuple[float, int]
) -> list[RigidTransform]:
    """A pose and tilts of it about a place (3,) in the scene's frame, axes all around.

    `tilts` are (angle in degrees, how many) of each kind.
    """
    starts = [pose]
    for tilt_deg, n_tilts in tilts:
        for axis in sphere_spiral(n_tilts):
            twist = np.concatenate([np.zeros(3), np.radians(tilt_deg) * axis])
            starts.append(pose.move(twist, place_mm))
    return starts


def make_scattered_starts(
    pose: RigidTransform,
    place_mm: FloatArray,
    step_mm: float,
    tilts: Sequence[tuple[float, int]],
    *,
    has_middle: bool = True,
) -> list[RigidTransform]:
    """A pose shifted along each axis of the scene and back, and tilts of each.

    Args:
        pose: `scene_from_bone`.
        place_mm: (3,) what it is tilted about, in the scene's frame.
        step_mm: length of the shifts.
        tilts: (angle in degrees, how many) of each kind.
        has_middle: the pose itself, not shifted, is the first.
    """
    axes = np.vstack([np.zeros((1, 3)) if has_middle else np.empty((0, 3)), np.eye(3), -np.eye(3)])
    starts = []
    for shift in step_mm * axes:
        moved = pose.move(np.concatenate([shift, np.zeros(3)]), place_mm)
        starts += make_tilted_starts(moved, place_mm + shift, *tilts)
    return starts


def find_poses(
    scene: Scene,
    model: RegistrationModel,
    starts: Sequence[RigidTransform],
    score: Callable[[RigidTransform], float] | None = None,
    on_progress: Progress = lambda fraction: None,
    settings: BimccSettings = NEAR_SETTINGS,
) -> list[ScoredPose]:
    """Fit coarsely from every start (`scene_from_bone`); distinct answers, best score first.

    The score is `compute_explained_fraction` by default. Progress is a fraction; what it raises
    stops the search.
    """
    thinned = replace(scene, thinned_to=_COARSE_POINTS)
    _ = thinned.grid, model.arrays  # made here once, not in both threads
    found = map_both(
        lambda start: fit_coarsely(thinned, model, start, settings), starts, on_progress
    )
    poses = distinct([pose for pose in found if pose is not None], model.centre_mm)
    judged = score or (lambda pose: compute_explained_fraction(thinned, model, pose))
    scored = [ScoredPose(pose, judged(pose)) for pose in poses]
    return sorted(scored, key=lambda one: one.score, reverse=True)


def compute_explained_fraction(
    scene: Scene,
    model: RegistrationModel,
    scene_from_bone: RigidTransform,
) -> float:
    """Fraction of the scene that lies on the model, times the model's coverage.

    Both under a kernel as wide as the largest noise, so that poses compare. Without a camera there
    is no coverage.
    """
    settings = DEFAULT
    sigma_mm = 0.5 * settings.widest_at_rest_mm
    pose = Pose(*scene_from_bone.inverse_parts())
    arrays = scene.arrays
    n_asked = len(range(0, len(scene), scene.every))
    pairs = make_pairs(n_asked)
    n = pair_forward(arrays, model.arrays, pose, scene.every, pairs)
    measure_pairs(arrays, model.arrays, pose, pairs, n)
    kernels: float = weigh(pairs, n, sigma_mm, settings.n_sigmas, 0.0).kernels
    fraction = kernels / max(n_asked, 1)
    coverage = compute_coverage(scene, model, scene_from_bone, sigma_mm)
    return fraction if coverage is None else fraction * coverage


def compute_coverage(
    scene: Scene, model: RegistrationModel, scene_from_bone: RigidTransform, sigma_mm: float
) -> float | None:
    """Fraction of the model points facing the camera that have the scene's surface beneath them.

    A pose can lay the model on most points and still be wrong: then much of the model that the
    camera should see has no point near it.

    Near is said by the width of a kernel. 0 when no part of the model faces the camera; None for a
    scene without a camera.
    """
    if scene.camera_mm is None:
        return None
    pose, arrays = Pose(*scene_from_bone.inverse_parts()), scene.arrays
    every = max(1, len(model.points_mm) // _N_ASKED)
    pairs = make_pairs(len(model.points_mm) // every + 1)
    n, n_visible = pair_backward(
        arrays, scene.grid, model.arrays, pose, every, _REACH_MM, _LEAST_COSINE, pairs, 0
    )
    if n_visible == 0:
        return 0.0
    measure_pairs(arrays, model.arrays, pose, pairs, n)
    is_near = np.abs(pairs.residual[:n]) < _NEAR_SIGMAS * sigma_mm
    return float(is_near.sum() / n_visible)


def select_poses(scored: Sequence[ScoredPose], most: int = _N_REFINED) -> list[RigidTransform]:
    """Of poses, best first, those that are worth a fit to all points."""
    least = _REFINED_FRACTION * max((one.score for one in scored), default=0.0)
    return [one.scene_from_bone for one in scored[:most] if one.score >= least]


def rank_fits(
    fits: Sequence[AnyFit], scores: Sequence[float], centre_mm: FloatArray
) -> list[AnyFit]:
    """Fits, best score first; the best is AMBIGUOUS if a different one scores nearly as much.

    Along a free direction every pose does, and the fit says so already. `centre_mm` (3,) is the
    model's, in the bone's frame.
    """
    order = sorted(range(len(fits)), key=lambda k: -scores[k])
    ranked = [fits[k] for k in order]
    if not ranked or scores[order[0]] <= 0.0:
        return ranked
    best = ranked[0].estimate
    is_ambiguous = Reason.DEGENERATE not in best.reasons and any(
        scores[k] >= AMBIGUOUS_FRACTION * scores[order[0]]
        and not is_same_pose(best.camera_from_bone, fits[k].estimate.camera_from_bone, centre_mm)
        for k in order[1:]
    )
    return [ranked[0].with_reason(Reason.AMBIGUOUS), *ranked[1:]] if is_ambiguous else ranked


def distinct(
    poses: Sequence[RigidTransform], centre_mm: FloatArray, n: int | None = None
) -> list[RigidTransform]:
    """The first n that repeat no earlier one; `centre_mm` (3,) in the bone's frame."""
    rotations = np.array([pose.rotation for pose in poses])
    centres_mm = np.array([pose.apply(centre_mm) for pose in poses])
    return [poses[k] for k in find_distinct(rotations, centres_mm, _SAME_MM, _SAME_DEG, n)]


def find_distinct(
    rotations: FloatArray,
    centres_mm: FloatArray,
    same_mm: float,
    same_deg: float,
    n: int | None = None,
) -> list[int]:
    """Indices of the first n poses that repeat none before them, in their order; of all for None.

    Two poses are the same when they differ by no more than `same_deg` in their rotations (H, 3, 3)
    and `same_mm` in where they put the bone's centre, (H, 3).
    """
    least_trace = 1.0 + 2.0 * np.cos(np.radians(same_deg))
    left = np.arange(len(rotations))
    kept: list[int] = []
    while len(left) and len(kept) != n:
        first = int(left[0])
        kept.append(first)
        trace = np.einsum("hij,ij->h", rotations[left], rotations[first])
        distance_mm = np.linalg.norm(centres_mm[left] - centres_mm[first], axis=1)
        left = left[(trace < least_trace) | (distance_mm > same_mm)]
    return kept


def is_same_pose(a: RigidTransform, b: RigidTransform, centre_mm: FloatArray) -> bool:
    """Whether two answers differ by less than a fit's basin."""
    shift_mm = float(np.linalg.norm(a.apply(centre_mm) - b.apply(centre_mm)))
    return shift_mm < _SAME_MM and rotation_angle_deg(a, b) < _SAME_DEG
