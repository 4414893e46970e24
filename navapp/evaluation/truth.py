"""Target registration error against a known pose."""

import numpy as np

from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.values import BoneModel


def compute_mean_tre_mm(
    estimated: RigidTransform,
    true: RigidTransform,
    bone: BoneModel,
    targets_mm: FloatArray,
    true_targets_mm: FloatArray | None = None,
) -> float | None:
    """Mean distance between estimated and true positions of the targets.

    Args:
        estimated: `left_from_bone`.
        true: the same.
        bone: whose visible vertices are taken when there are no targets (n.v < -0.2 |v|, at the
            true pose).
        targets_mm: (N, 3) in bone coordinates; may be empty.
        true_targets_mm: (N, 3) where they really are in the bone, if not where they are planned.

    Returns:
        The error in mm; None when nothing of the bone faces the camera.
    """
    points = targets_mm
    if len(points) == 0:
        points = bone.mesh.vertices_mm[bone.mesh.visible_vertices(true)]
    if len(points) == 0:
        return None
    true_points = points if true_targets_mm is None else true_targets_mm
    return float(np.linalg.norm(estimated.apply(points) - true.apply(true_points), axis=1).mean())
