"""How thick the piece is that a cut took off, where it is thickest: what a caliper would read."""

from dataclasses import dataclass

import numpy as np

from navapp.resection.remaining_bone import Cut, heights_over
from navapp.values import BoneModel, MeasuredFace
from navapp.values.faces import SIZE_95


@dataclass(frozen=True, slots=True)
class Thickness:
    """Of the bone that a cut takes off; cartilage and what the blade takes are no part of it."""

    planned_mm: float
    mm: float  # as the face was measured
    bound_mm: float  # 95 %, of the measured one: by the face, its pose in it, and by the surface


def measure_thickness(bone: BoneModel, face: MeasuredFace) -> Thickness | None:
    """The largest height of the piece over the face, against the plan.

    None when the plan takes nothing off.

    Args:
        bone: whole, as planned.
        face: that the saw left.
    """
    mesh = bone.mesh
    planned_mm = float(heights_over(mesh, Cut(face.plane, 0.0)).max(initial=0.0))
    heights_mm = heights_over(mesh, Cut(face.as_plane, 0.0))
    if planned_mm <= 0.0 or heights_mm.max(initial=0.0) <= 0.0:
        return None
    highest = int(np.argmax(heights_mm))
    away_mm = face.plane.axes @ (mesh.vertices_mm[highest] - face.point_mm)
    # h = (p - point) . normal: a tilt moves the face below p by its arm, an offset by itself.
    jacobian = np.array([*away_mm, -1.0])
    variance = jacobian @ face.covariance @ jacobian + bone.surface_sd_mm**2
    deviation_mm = float(np.sqrt(variance))
    return Thickness(planned_mm, float(heights_mm[highest]), SIZE_95 * deviation_mm)
