"""What two poses of one pair of pictures say of the limb: angles and gaps, or why not."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from navapp.geometry.mesh import TriangleMesh
from navapp.limb.angles import LimbAngles, measure_angles
from navapp.limb.axes import find_limb_axes, find_missing
from navapp.limb.flexion import Hinge
from navapp.limb.gaps import Gap, GapMeter
from navapp.values import Plan, PoseEstimate
from navapp.values.faces import SIZE_95

FEMUR, TIBIA = "femur", "tibia"


@dataclass(frozen=True, slots=True, eq=False)
class BoneSurface:
    """What is left of a bone, as far as that is known."""

    mesh: TriangleMesh
    bound_mm: float = 0.0  # 95 %, of the faces of its cuts, across them
    unknown: str | None = None  # why no gap can be told from it, in words


@dataclass(frozen=True, slots=True, eq=False)
class LimbMeasurement:
    """Of one pair of pictures."""

    angles: LimbAngles | None  # None when an axis is not known
    gaps: Mapping[str, Gap] = field(default_factory=dict)  # `medial`, `lateral`, where found
    missing: str | None = None  # which axis is not known, or why there are no gaps, in words


class LimbMeter:
    """Measures a limb; keeps only what the plan says of it, and the bones as they are.

    Args:
        plan: with a femur, a tibia and its side.
    """

    def __init__(self, plan: Plan) -> None:
        femur, tibia = plan.bones[FEMUR], plan.bones[TIBIA]
        self._side = femur.side or tibia.side
        landmarks = plan.content.landmarks
        self._axes, self._missing = find_limb_axes(landmarks), find_missing(landmarks)
        if self._side is None:
            self._axes, self._missing = None, "no side in the plan"
        self._centres_mm = femur.mesh.centroid_mm, tibia.mesh.centroid_mm
        hinge = Hinge.of(femur.mesh)
        self._middle_x_mm = None if hinge is None else float(hinge.centre_mm[0])
        self._surfaces: tuple[TriangleMesh, TriangleMesh] | None = None
        self._gaps: GapMeter | None = None

    def measure(
        self,
        femur: PoseEstimate,
        tibia: PoseEstimate,
        surfaces: tuple[BoneSurface, BoneSurface],
    ) -> LimbMeasurement:
        """Angles and gaps.

        Args:
            femur: its pose.
            tibia: its pose in the same pair.
            surfaces: of femur and tibia; without gaps where one is not known.
        """
        angles = None
        if self._axes is not None and self._side is not None:
            angles = measure_angles(self._axes, femur, tibia, self._side)
        unknown = next((one.unknown for one in surfaces if one.unknown is not None), None)
        missing = "; ".join(why for why in (self._missing, unknown) if why) or None
        meter = None if unknown else self._gap_meter((surfaces[0].mesh, surfaces[1].mesh))
        if meter is None:
            return LimbMeasurement(angles, {}, missing)
        surface_sd_mm = math.hypot(*(one.bound_mm for one in surfaces)) / SIZE_95
        gaps = meter.measure(femur, tibia, self._centres_mm, surface_sd_mm)
        return LimbMeasurement(angles, gaps, missing)

    def _gap_meter(self, surfaces: tuple[TriangleMesh, TriangleMesh]) -> GapMeter | None:
        """Made anew when a cut has changed a bone."""
        if self._side is None or self._middle_x_mm is None:
            return None
        is_known = self._surfaces is not None and all(
            one is other for one, other in zip(self._surfaces, surfaces, strict=True)
        )
        if self._gaps is None or not is_known:
            self._surfaces = surfaces
            self._gaps = GapMeter(*surfaces, self._middle_x_mm, self._side)
        return self._gaps
