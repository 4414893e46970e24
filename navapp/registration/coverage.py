"""How much of what should be seen was seen: what tells a wrong pose from a right one."""

import numpy as np

from navapp.geometry.transform import RigidTransform
from navapp.registration.model import RegistrationModel
from navapp.registration.pairing_kernels import Pose, make_pairs, measure_pairs, pair_backward
from navapp.registration.scene import Scene

# All chosen. Near the outline little of a surface is seen, and its depth is uncertain.
_LEAST_COSINE = 0.45
# So many model points are asked, about.
_N_ASKED = 3000
# The scene's own points may be so far apart.
_REACH_MM = 10.0
# So many widths of the kernel are near.
_NEAR_SIGMAS = 1.5


def compute_coverage(
    scene: Scene, model: RegistrationModel, scene_from_bone: RigidTransform, sigma_mm: float
) -> float:
    """Fraction of the model points facing the camera that have the scene's surface beneath them.

    A pose can lay the model on most points and still be wrong: then much of the model that the
    camera should see has no point near it.

    Near is said by the width of a kernel. 0 when no part of the model faces the camera.

    Raises:
        ValueError: the scene has no camera.
    """
    if scene.camera_mm is None:
        raise ValueError("coverage needs a place that the scene was seen from")
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
