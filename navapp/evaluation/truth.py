"""Target registration error against a known pose."""

import numpy as np

from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.values import BoneModel


def compute_mean_tre_mm(
    estimated: RigidTransform, true: RigidTransform, bone: BoneModel, targets_mm: FloatArray
) -> float | None:
    """Mean distance between estimated and true positions of the targets.

    Args:
        estimated: `left_from_bone`.
        true: the same.
        bone: whose visible vertices are taken when there are no targets (n.v < -0.2 |v|, at the
            true pose).
        targets_mm: (N, 3) in bone coordinates; may be empty.

    Returns:
        The error in mm; None when nothing of the bone faces the camera.
    """
    points = targets_mm
    if len(points) == 0:
        points = bone.mesh.vertices_mm[bone.mesh.visible_vertices(true)]
    if len(points) == 0:
        return None
    return float(np.linalg.norm(estimated.apply(points) - true.apply(points), axis=1).mean())
