"""How much of what should be seen was seen: what tells a wrong pose from a right one."""

import numpy as np

from navapp.geometry.transform import RigidTransform
from navapp.registration.model import RegistrationModel
from navapp.registration.pairing_kernels import (
    count_visible,
    make_pairs,
    measure_pairs,
    pair_backward,
)
from navapp.registration.scene import Scene

# Near the outline little of a surface is seen, and its depth is uncertain.
_LEAST_COSINE = 0.45
_ASKED = 1500
# The scene's own points may be so far apart.
_REACH_MM = 10.0


def coverage(
    scene: Scene, model: RegistrationModel, scene_from_bone: RigidTransform, sigma_mm: float
) -> float:
    """Share of the model points that face the camera and have the scene's surface beneath them.

    A pose can lay the model on most points and still be wrong: then much of the model that the
    camera should see has no point near it.

    Args:
        scene: with a camera.
        model: prepared bone.
        scene_from_bone: pose.
        sigma_mm: width of the kernel that says how near is near.

    Returns:
        0 to 1; 0 when no part of the model faces the camera.

    Raises:
        ValueError: the scene has no camera.
    """
    if scene.camera_mm is None:
        raise ValueError("coverage needs a place that the scene was seen from")
    rotation, shift = scene_from_bone.inverse_parts()
    camera = rotation @ scene.camera_mm + shift
    every = max(1, len(model.points_mm) // (2 * _ASKED))
    n_asked = count_visible(model.arrays, camera, every, _LEAST_COSINE)
    if n_asked == 0:
        return 0.0
    pairs = make_pairs(n_asked)
    n = pair_backward(
        scene.arrays, scene.grid, model.arrays, rotation, shift, camera, every, _REACH_MM,
        _LEAST_COSINE, pairs, 0,
    )  # fmt: skip
    measure_pairs(scene.arrays, model.arrays, rotation, shift, camera, pairs, 0, n)
    is_near = np.abs(pairs.residual[:n]) < 1.5 * sigma_mm
    return float(is_near.sum() / n_asked)
