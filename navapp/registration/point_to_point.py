"""The paper's two loops, for comparison: plain ICP, and BiMCC-ICP as it is printed (corrected).

Pair points, weigh the pairs, solve for the pose by SVD, stop when it stands still.
"""

from collections.abc import Sized
from functools import partial
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from navapp.geometry.bands import run_both
from navapp.geometry.transform import FloatArray, RigidTransform, nearest_rotation
from navapp.registration.bimcc import MIN_POINTS, Solution, solution_at
from navapp.registration.lookup_kernels import VoxelGrid, fill_scene_grid
from navapp.registration.model import RegistrationModel
from navapp.registration.pairing_kernels import Pose
from navapp.registration.point_to_point_kernels import PointSet, sum_pairs
from navapp.registration.scene import NO_GRID, Scene

# All chosen: the print has no rule for the kernel's width. It begins at so many median distances
# of the pairs and shrinks by a factor with each iteration, within bounds.
_FIRST_MEDIANS, _DECAY = 1.5, 0.9
_WIDEST_MM, _NARROWEST_MM = 12.0, 1.2
_MAX_ITERATIONS, _MAX_COARSE_ITERATIONS = 45, 35
# About so many points are paired at first: where the kernel is wide they tell as much.
_N_COARSE = 800
# Every step is prolonged by this factor: the loop ends where it would, in half of the steps
# (over-relaxation; Besl and McKay accelerate theirs in a like way).
_RELAXATION = 1.7
# A model that moves less (mean of the corners of its hull) stands still.
_STEP_MM = 2e-3
# Of the look-up among the scene's points.
_N_NEIGHBOURS, _FINEST_VOXEL_MM, _MOST_VOXELS, _GRID_MARGIN_MM = 6, 3.0, 60_000, 9.0


def solve_icp(
    scene: Scene, model: RegistrationModel, start: RigidTransform, n_points: int | None = None
) -> Solution:
    """Plain ICP: every point pairs with its nearest model point, all weigh the same.

    Arguments and result as those of `solve_bimcc`; about `n_points` of the scene pair, evenly, None
    is all. Without a robust weight whatever is not bone pulls the pose.

    Source: the paper, state of the art, equation (1); Besl and McKay 1992.
    """
    return _iterate(scene, model, start, _step(scene, n_points), is_both=False)


def solve_bimcc_literal(
    scene: Scene, model: RegistrationModel, start: RigidTransform, n_points: int | None = None
) -> Solution:
    """BiMCC-ICP as printed, with the print's slips mended (docs/how/registration.md).

    About `n_points` of the scene pair forward (None: all), evenly, and as large a part of the model
    backward, its far side too: on a one-sided view that pulls the model towards the camera.
    Partners are looked up among all.

    Source: the paper, proposed equations (4) to (9) and Algorithm 2.
    """
    return _iterate(scene, model, start, _step(scene, n_points), is_both=True)


def solve_sums(sums: FloatArray, frames: RigidTransform) -> RigidTransform:
    """The pose that moves points b to points a with the least weighted squared distance.

    Never a reflection. Its frames are those of another pose, scene from bone; `sums` (4, 4) are
    those of w [a; 1] [b; 1]^T over the pairs.

    Source: Kabsch 1976.
    """
    weight = sums[3, 3]
    a0, b0 = sums[:3, 3] / weight, sums[3, :3] / weight
    rotation = nearest_rotation(sums[:3, :3] / weight - np.outer(a0, b0))
    return RigidTransform.from_parts(frames.target, frames.source, rotation, a0 - rotation @ b0)


def prolong_step(
    pose: RigidTransform, solved: RigidTransform, centre_mm: FloatArray
) -> RigidTransform:
    """A little beyond the solved pose, seen from the pose before, about a point of the bone."""
    twist = pose.twist_to(solved, centre_mm)
    return pose.move(_RELAXATION * twist, pose.apply(centre_mm))


class _Pairing(NamedTuple):
    """What pairs, and which part of it."""

    seen: PointSet  # the scene, in its frame
    bone: PointSet  # the model, in its frame
    every: int  # n-th scene point pairs forward, and model point backward
    is_both: bool  # not only forward


def _iterate(
    scene: Scene, model: RegistrationModel, pose: RigidTransform, every: int, *, is_both: bool
) -> Solution:
    """Pairs, weights and least squares, until the model stands still under the narrowest kernel.

    Of every n-th scene point forward, and of model points backward if `is_both`; at first of a part
    of them.
    """
    if len(scene) < MIN_POINTS:
        return solution_at(scene, model, pose)
    bone = PointSet(model.points_mm, model.arrays.neighbours, model.arrays.grid)
    whole = _Pairing(_prepare_scene(scene.points_mm, is_both), bone, every, is_both)
    thinning = _step(scene.points_mm[::every], _N_COARSE)
    pairing = whole._replace(every=thinning * every)
    sigma_mm, iterations, is_converged = np.inf, 0, False
    if is_both:
        _, distance_mm = _pair(pairing, pose, sigma_mm)
        sigma_mm = _limit_mm(_FIRST_MEDIANS * float(np.median(distance_mm)))
    for iterations in range(1, _MAX_ITERATIONS + 1):
        sums, _ = _pair(pairing, pose, sigma_mm)
        if not sums[3, 3] > 0.0:
            break
        stepped = prolong_step(pose, solve_sums(sums, pose), model.centre_mm)
        moved_mm, pose = pose.mean_motion_mm(stepped, model.hull_mm), stepped
        is_still = moved_mm < _STEP_MM and not _NARROWEST_MM < sigma_mm < np.inf
        if is_still and pairing is whole:
            is_converged = True
            break
        if is_still or thinning == 1 or iterations >= _MAX_COARSE_ITERATIONS:
            pairing = whole
        sigma_mm = _limit_mm(_DECAY * sigma_mm) if is_both else sigma_mm
    return solution_at(scene, model, pose, iterations=iterations, is_converged=is_converged)


def _step(points: Sized, n: int | None) -> int:
    """Every so many-th of the points makes about n of them; 1 for None."""
    return 1 if n is None else max(1, len(points) // n)


def _limit_mm(sigma_mm: float) -> float:
    return min(max(sigma_mm, _NARROWEST_MM), _WIDEST_MM)


def _pair(
    pairing: _Pairing, pose: RigidTransform, sigma_mm: float
) -> tuple[FloatArray, FloatArray]:
    """Sums (4, 4) over pairs of scene points a and model points b, and the pairs' distances.

    Equation (4): the stacked sets a and b, forward then backward; plain ICP pairs forward only.
    Equations (7) to (9) in half-quadratic form: the kernel's value is the pair's weight. Half of
    the pairs are found on either thread.
    """
    seen, bone, every, is_both = pairing
    forward = Pose(*pose.inverse_parts())
    backward = Pose(np.array(pose.rotation), np.array(pose.translation_mm))
    ahead_mm, back_mm = np.empty(len(seen.points)), np.empty(len(bone.points))

    def sum_share(share: int) -> FloatArray:
        sums, span = np.zeros((2, 4, 4)), (share * every, 2 * every)
        sum_pairs(seen, bone, forward, sigma_mm, *span, ahead_mm, sums[0])
        if is_both:
            sum_pairs(bone, seen, backward, sigma_mm, *span, back_mm, sums[1])
        return sums

    shares = run_both(partial(sum_share, 0), partial(sum_share, 1))
    ahead, back = np.add(*shares)
    paired_back_mm = back_mm[::every] if is_both else back_mm[:0]
    return ahead + back.T, np.concatenate([ahead_mm[::every], paired_back_mm])


def _prepare_scene(points_mm: FloatArray, is_looked_up: bool) -> PointSet:
    """The scene's points with a look-up: a coarse grid, then from neighbour to neighbour."""
    points_mm = np.ascontiguousarray(points_mm, dtype=np.float64)
    if not is_looked_up:
        return PointSet(points_mm, np.empty((0, 0), dtype=np.int32), NO_GRID)
    n = min(_N_NEIGHBOURS + 1, len(points_mm))
    around = np.asarray(cKDTree(points_mm).query(points_mm, k=n, workers=2)[1])
    low = points_mm.min(axis=0) - _GRID_MARGIN_MM
    size = np.ptp(points_mm, axis=0) + 2.0 * _GRID_MARGIN_MM
    voxel_mm = max(_FINEST_VOXEL_MM, float((size.prod() / _MOST_VOXELS) ** (1.0 / 3.0)))
    shape = tuple(np.ceil(size / voxel_mm).astype(int) + 1)
    grid = VoxelGrid(np.full(shape, -1, dtype=np.int32), low, voxel_mm)
    fill_scene_grid(points_mm, 1, grid)
    return PointSet(points_mm, np.ascontiguousarray(around[:, 1:], dtype=np.int32), grid)
