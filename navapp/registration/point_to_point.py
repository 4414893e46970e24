"""The paper's two loops, for comparison: plain ICP, and BiMCC-ICP as it is printed (corrected).

Both are one skeleton: pair points, weigh the pairs, solve for the pose by SVD, stop when it rests.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.transform import FloatArray, RigidTransform, nearest_rotation
from navapp.registration.bimcc import MIN_POINTS, BimccSettings, Solution, solution_at
from navapp.registration.model import RegistrationModel
from navapp.registration.scene import Scene
from navapp.values import PoseEstimate

_MAX_ITERATIONS = 60
_STEP_MM = 2e-3


@dataclass(frozen=True, slots=True)
class LiteralSettings:
    """The printed method's kernel width, for which the print has no rule.

    Attributes:
        first_medians: to begin with, in median distances of the pairs.
        widest_mm, narrowest_mm: bounds.
        decay: factor from one iteration to the next.
    """

    first_medians: float = 1.5
    widest_mm: float = 12.0
    narrowest_mm: float = 1.2
    decay: float = 0.9


def fit_icp(
    scene: Scene, model: RegistrationModel, scene_from_bone: RigidTransform
) -> PoseEstimate:
    """As `solve_icp`, the pose only."""
    return solve_icp(scene, model, scene_from_bone).estimate


def solve_icp(scene: Scene, model: RegistrationModel, scene_from_bone: RigidTransform) -> Solution:
    """Plain ICP: every point pairs with its nearest model point, all weigh the same.

    Arguments and result as those of `fit_bimcc`. Without a robust weight whatever is not bone
    pulls the pose.

    Source: the paper, state of the art, equation (1); Besl and McKay 1992.
    """

    def pair(pose: RigidTransform) -> tuple[FloatArray, FloatArray]:
        index, _ = model.nearest(pose.inverse().apply(scene.points_mm))
        return scene.points_mm, model.points_mm[index]

    def weigh(distance_mm: FloatArray, iteration: int) -> FloatArray:
        return np.ones_like(distance_mm)

    return _iterate(scene, model, scene_from_bone, pair, weigh, lambda: True)


def fit_bimcc_literal(
    scene: Scene, model: RegistrationModel, scene_from_bone: RigidTransform
) -> PoseEstimate:
    """As `solve_bimcc_literal`, the pose only."""
    return solve_bimcc_literal(scene, model, scene_from_bone).estimate


def solve_bimcc_literal(
    scene: Scene,
    model: RegistrationModel,
    scene_from_bone: RigidTransform,
    settings: LiteralSettings | None = None,
) -> Solution:
    """BiMCC-ICP as printed, with the print's slips mended (docs/registration.md).

    All scene points pair forward and all model points backward, those that no camera can see too:
    on a one-sided view the far side pulls the model towards the camera.

    Source: the paper, proposed equations (4) to (9) and Algorithm 2.
    """
    settings = settings or LiteralSettings()
    from scipy.spatial import cKDTree

    tree = cKDTree(scene.points_mm)
    sigma_mm = 0.0

    def pair(pose: RigidTransform) -> tuple[FloatArray, FloatArray]:
        """Equation (4): the stacked sets a (scene) and b (model), forward then backward."""
        forward, _ = model.nearest(pose.inverse().apply(scene.points_mm))
        _, backward = tree.query(pose.apply(model.points_mm), workers=2)
        a = np.concatenate([scene.points_mm, scene.points_mm[backward]])
        b = np.concatenate([model.points_mm[forward], model.points_mm])
        return a, b

    def weigh(distance_mm: FloatArray, iteration: int) -> FloatArray:
        """Equations (7) to (9) in half-quadratic form; the kernel narrows by a constant factor."""
        nonlocal sigma_mm
        first_mm = settings.first_medians * float(np.median(distance_mm))
        wanted_mm = first_mm if iteration == 1 else settings.decay * sigma_mm
        sigma_mm = float(np.clip(wanted_mm, settings.narrowest_mm, settings.widest_mm))
        weight: FloatArray = np.exp(-0.5 * (distance_mm / sigma_mm) ** 2)
        return weight

    def is_narrow() -> bool:
        return sigma_mm <= settings.narrowest_mm

    return _iterate(scene, model, scene_from_bone, pair, weigh, is_narrow)


def kabsch(
    a_mm: FloatArray, b_mm: FloatArray, weight: FloatArray, frames: RigidTransform
) -> RigidTransform:
    """The pose that takes b to a with the least weighted squared distance; never a reflection.

    Args:
        a_mm: (N, 3) scene points.
        b_mm: (N, 3) their model points.
        weight: (N,) of the pairs.
        frames: whose frames the answer gets (`scene_from_bone`).

    Source: Kabsch 1976.
    """
    share = weight / weight.sum()
    a0, b0 = share @ a_mm, share @ b_mm
    rotation = nearest_rotation((a_mm - a0).T @ ((b_mm - b0) * share[:, None]))
    return RigidTransform.from_parts(frames.target, frames.source, rotation, a0 - rotation @ b0)


def _iterate(
    scene: Scene,
    model: RegistrationModel,
    pose: RigidTransform,
    pair: Callable[[RigidTransform], tuple[FloatArray, FloatArray]],
    weigh: Callable[[FloatArray, int], FloatArray],
    may_stop: Callable[[], bool],
) -> Solution:
    """The skeleton: pairs, weights, least squares, until the bone rests and the weights may."""
    if len(scene) < MIN_POINTS:
        return solution_at(scene, model, pose, BimccSettings())
    iterations, is_converged = 0, False
    for iterations in range(1, _MAX_ITERATIONS + 1):
        a, b = pair(pose)
        weight = weigh(_distances(a, pose.apply(b)), iterations)
        if not weight.sum() > 0.0:
            break
        stepped = kabsch(a, b, weight, pose)
        moved_mm = _distances(stepped.apply(model.points_mm), pose.apply(model.points_mm)).mean()
        pose = stepped
        if moved_mm < _STEP_MM and may_stop():
            is_converged = True
            break
    return solution_at(scene, model, pose, BimccSettings(), iterations, is_converged=is_converged)


def _distances(a: FloatArray, b: FloatArray) -> NDArray[np.float64]:
    """(N,) between points of the same row."""
    distance: FloatArray = np.linalg.norm(a - b, axis=1)
    return distance
