"""What a pose's own covariance says of its error, at several levels."""

import math

from navapp.evaluation.scores import LEVELS
from navapp.geometry.transform import FloatArray
from navapp.values import BoneModel, PoseEstimate

# The judge uses about so many points as well (`tracking.judging`).
_MOST_POINTS = 200


def predict_errors_mm(
    estimate: PoseEstimate, bone: BoneModel, targets_mm: FloatArray
) -> tuple[float, ...] | None:
    """Bounds of the mean error over the targets at `LEVELS`; None where the pose is not fixed.

    Args:
        estimate: of the pose.
        bone: of the plan, whose visible vertices are taken when there are no targets.
        targets_mm: (N, 3) in bone coordinates; may be empty.
    """
    if not estimate.has_finite_covariance:
        return None
    points_mm = targets_mm
    if len(points_mm) == 0:
        is_seen = bone.mesh.visible_vertices(estimate.camera_from_bone)
        points_mm = bone.mesh.vertices_mm[is_seen]
    if len(points_mm) == 0:
        return None
    some_mm = points_mm[:: max(1, len(points_mm) // _MOST_POINTS)]
    centre_mm = bone.mesh.centroid_mm
    bounds = tuple(estimate.predict_tre_mm(centre_mm, some_mm, level) for level in LEVELS)
    return bounds if all(math.isfinite(bound) for bound in bounds) else None
