"""The errors of one estimated pose against the true one."""

from dataclasses import dataclass

from navapp.evaluation.overlay_error import measure_overlay_error
from navapp.evaluation.truth import compute_mean_tre_mm
from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.rectification import RectifiedGeometry
from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.values import BoneModel


@dataclass(frozen=True, slots=True)
class PoseErrors:
    """Errors of one pose, mm; None where unknown."""

    tre_mm: float | None = None  # mean over the stage's targets (`compute_mean_tre_mm`)
    # Of the drawn bone (`OverlayError`).
    displacement_mm: float | None = None
    outline_mm: float | None = None


def measure_pose(
    pose: RigidTransform,
    true: RigidTransform,
    bone: BoneModel,
    targets_mm: FloatArray,
    surface: TriangleMesh,
    geometry: RectifiedGeometry,
    true_targets_mm: FloatArray | None = None,
) -> PoseErrors:
    """Target registration error, displacement and outline distance of the drawn bone.

    Args:
        pose: estimated, left camera from bone.
        true: the same.
        bone: of the plan.
        targets_mm: (N, 3) of the stage; may be empty (`compute_mean_tre_mm`).
        surface: of the bone as it is drawn.
        geometry: of the rectified pair.
        true_targets_mm: (N, 3) where the targets really are in the bone; None: as planned.
    """
    tre_mm = compute_mean_tre_mm(pose, true, bone, targets_mm, true_targets_mm)
    drawn = measure_overlay_error(pose, true, surface, geometry)
    if drawn is None:
        return PoseErrors(tre_mm)
    return PoseErrors(tre_mm, drawn.displacement_mm, drawn.outline_mm)
