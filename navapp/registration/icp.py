"""The paper's baseline: iterative closest point, equation (1)."""

import numpy as np

from navapp.geometry.transform import RigidTransform, nearest_rotation
from navapp.registration.model import RegistrationModel
from navapp.registration.point_to_plane import MIN_POINTS, estimate_at
from navapp.values import PoseEstimate, SurfaceCloud

_MAX_ITERATIONS = 60
_STEP_MM = 2e-3


def fit_icp(
    cloud: SurfaceCloud,
    model: RegistrationModel,
    rectified_from_bone: RigidTransform,
) -> PoseEstimate:
    """Plain ICP: every point pairs with its nearest model point, all weigh the same.

    Arguments as those of `fit_point_to_plane`; too few points are left to the reasons as there.
    Kept for comparison: without a robust weight whatever is not bone pulls the pose.

    Source: the paper, state of the art, equation (1); Besl and McKay 1992; SVD step by Kabsch.
    """
    pose = rectified_from_bone
    iterations, is_converged = 0, False
    if len(cloud) < MIN_POINTS:
        return estimate_at(cloud, model, pose, iterations, is_converged)
    for iterations in range(1, _MAX_ITERATIONS + 1):  # noqa: B007 (reported)
        moved = pose.inverse().apply(cloud.points_mm)
        index, _ = model.nearest(moved, np.inf)
        step = kabsch(cloud.points_mm, model.points_mm[index], pose)
        shift = np.linalg.norm(step.apply(model.centre_mm) - pose.apply(model.centre_mm))
        turn = np.linalg.norm(step.rotation - pose.rotation) * 30.0
        pose = step
        if shift + turn < _STEP_MM:
            is_converged = True
            break
    return estimate_at(cloud, model, pose, iterations, is_converged)


def kabsch(scene_mm: np.ndarray, model_mm: np.ndarray, frames: RigidTransform) -> RigidTransform:
    """`scene_from_model` that minimises the squared distances of the pairs; never a reflection."""
    scene_centre, model_centre = scene_mm.mean(axis=0), model_mm.mean(axis=0)
    correlation = (scene_mm - scene_centre).T @ (model_mm - model_centre)
    rotation = nearest_rotation(correlation)
    return RigidTransform.from_parts(
        frames.target, frames.source, rotation, scene_centre - rotation @ model_centre
    )
