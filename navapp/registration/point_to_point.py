"""The paper's two loops, for comparison: plain ICP, and BiMCC-ICP as it is printed (corrected).

Pair points, weigh the pairs, solve for the pose by SVD, stop when it stands still.
"""

import numpy as np
from scipy.spatial import cKDTree

from navapp.geometry.transform import FloatArray, RigidTransform, nearest_rotation
from navapp.registration.bimcc import MIN_POINTS, Solution, solution_at
from navapp.registration.model import RegistrationModel
from navapp.registration.scene import Scene

# All chosen: the print has no rule for the kernel's width. It begins at so many median distances
# of the pairs and shrinks by a factor with each iteration, within bounds.
_FIRST_MEDIANS, _DECAY = 1.5, 0.9
_WIDEST_MM, _NARROWEST_MM = 12.0, 1.2
_MAX_ITERATIONS = 60
# A model that moves less (mean of its points) stands still.
_STEP_MM = 2e-3


def solve_icp(scene: Scene, model: RegistrationModel, start: RigidTransform) -> Solution:
    """Plain ICP: every point pairs with its nearest model point, all weigh the same.

    Arguments and result as those of `solve_bimcc`. Without a robust weight whatever is not bone
    pulls the pose.

    Source: the paper, state of the art, equation (1); Besl and McKay 1992.
    """
    return _iterate(scene, model, start, is_bimcc=False)


def solve_bimcc_literal(scene: Scene, model: RegistrationModel, start: RigidTransform) -> Solution:
    """BiMCC-ICP as printed, with the print's slips mended (docs/registration.md).

    All scene points pair forward and all model points backward, those that no camera can see too:
    on a one-sided view the far side pulls the model towards the camera.

    Source: the paper, proposed equations (4) to (9) and Algorithm 2.
    """
    return _iterate(scene, model, start, is_bimcc=True)


def kabsch(
    a_mm: FloatArray, b_mm: FloatArray, weight: FloatArray, frames: RigidTransform
) -> RigidTransform:
    """The pose that moves b (N, 3) to a (N, 3) with the least weighted squared distance.

    Never a reflection. Its frames are those of another pose, scene from bone.

    Source: Kabsch 1976.
    """
    fraction = weight / weight.sum()
    a0, b0 = fraction @ a_mm, fraction @ b_mm
    rotation = nearest_rotation((a_mm - a0).T @ ((b_mm - b0) * fraction[:, None]))
    return RigidTransform.from_parts(frames.target, frames.source, rotation, a0 - rotation @ b0)


def _iterate(
    scene: Scene, model: RegistrationModel, pose: RigidTransform, *, is_bimcc: bool
) -> Solution:
    """Pairs, weights and least squares, until the model stands still under the narrowest kernel."""
    if len(scene) < MIN_POINTS:
        return solution_at(scene, model, pose)
    tree = cKDTree(scene.points_mm) if is_bimcc else None
    sigma_mm, iterations, is_converged = _NARROWEST_MM, 0, False
    for iterations in range(1, _MAX_ITERATIONS + 1):
        forward, _ = model.nearest(pose.inverse().apply(scene.points_mm))
        a, b = scene.points_mm, model.points_mm[forward]
        weight = np.ones(len(a))
        if tree is not None:
            # Equation (4): the stacked sets a (scene) and b (model), forward then backward.
            _, backward = tree.query(pose.apply(model.points_mm), workers=2)
            a, b = np.concatenate([a, a[backward]]), np.concatenate([b, model.points_mm])
            # Equations (7) to (9) in half-quadratic form.
            distance_mm = np.linalg.norm(a - pose.apply(b), axis=1)
            first_mm = _FIRST_MEDIANS * float(np.median(distance_mm))
            wanted_mm = first_mm if iterations == 1 else _DECAY * sigma_mm
            sigma_mm = float(np.clip(wanted_mm, _NARROWEST_MM, _WIDEST_MM))
            weight = np.exp(-0.5 * (distance_mm / sigma_mm) ** 2)
            if not weight.sum() > 0.0:
                break
        stepped = kabsch(a, b, weight, pose)
        moved = stepped.apply(model.points_mm) - pose.apply(model.points_mm)
        pose = stepped
        if np.linalg.norm(moved, axis=1).mean() < _STEP_MM and sigma_mm <= _NARROWEST_MM:
            is_converged = True
            break
    return solution_at(scene, model, pose, iterations=iterations, is_converged=is_converged)
