"""The cuts that are planned for a simulated knee; the built-in plan and the saw share them."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from navapp.geometry.transform import FloatArray, rotation_from_vector
from sim_devices.anatomy import KneeAnatomy

# As much bone as the component is thick; the tibia's cut falls to the back.
RESECTION_MM = 9.0
_SLOPE_DEG = 3.0
# The anterior cut leaves the bone in front, below the shaft, which it stays clear of.
_FLANGE_DEG, _CLEAR_OF_SHAFT_MM = 5.5, 2.0
# Of the distance between the anterior and the posterior cut: what the chamfers take of the distal
# face at each end.
_ANTERIOR_CHAMFER, _POSTERIOR_CHAMFER = 0.19, 0.18

_UP, _BACK = np.array([0.0, 0.0, 1.0]), np.array([0.0, 1.0, 0.0])


@dataclass(frozen=True, slots=True, eq=False)
class Cut:
    """A plane of a bone, and the rectangle of it that the saw works in."""

    bone: str
    point_mm: FloatArray  # (3,) middle of the rectangle, bone model coordinates
    normal: FloatArray  # (3,) unit, out of the bone that stays
    extent_mm: tuple[float, float]  # of the rectangle: across the knee, and along the cut

    def heights_mm(self, points_mm: FloatArray) -> FloatArray:
        """(N,) distance of points (N, 3) from the plane, positive on the side that is removed."""
        heights_mm: FloatArray = (points_mm - self.point_mm) @ self.normal
        return heights_mm

    @property
    def axes(self) -> FloatArray:
        """(2, 3) unit directions in the plane: across the knee, and along the cut."""
        along = np.cross((1.0, 0.0, 0.0), self.normal)
        along /= np.linalg.norm(along)
        return np.stack([np.cross(self.normal, along), along])


def make_planned_cuts(knee: KneeAnatomy) -> dict[str, Cut]:
    """The seven cuts of a knee, by name, in the order in which they are made."""
    points = knee.landmarks
    plateaus = np.stack([points["tibia/medial_plateau"], points["tibia/lateral_plateau"]])
    proximal = np.append(plateaus[:, :2].mean(axis=0), plateaus[:, 2].max() - RESECTION_MM)
    slope = rotation_from_vector((-np.radians(_SLOPE_DEG), 0.0, 0.0)) @ _UP
    ridge = points["patella/ridge"]
    return {
        **_femoral_cuts(points),
        "patella": Cut("patella", ridge - RESECTION_MM * _BACK, _BACK, (45.0, 40.0)),
        "tibia_proximal": Cut("tibia", proximal, slope, (80.0, 55.0)),
    }


def _femoral_cuts(points: Mapping[str, FloatArray]) -> dict[str, Cut]:
    """Distal, anterior, posterior and two chamfers; all of them contain the direction x."""
    middle = points["femur/notch"]
    lowest = min(points["femur/medial_condyle"][2], points["femur/lateral_condyle"][2])
    rearmost = max(points[f"femur/{side}_posterior_condyle"][1] for side in ("medial", "lateral"))
    level, behind = lowest + RESECTION_MM, rearmost - RESECTION_MM
    cortex = points["femur/anterior_cortex"] - _CLEAR_OF_SHAFT_MM * _BACK
    flange = rotation_from_vector((np.radians(_FLANGE_DEG), 0.0, 0.0)) @ -_BACK
    upwards = np.cross(flange, (1.0, 0.0, 0.0))
    # Where the anterior cut meets the distal one.
    front = cortex[1] + (level - cortex[2]) * upwards[1] / upwards[2]
    depth_mm = behind - front
    anterior = _at(middle, front, level) + 0.4 * (cortex[2] - level) * upwards
    before = _chamfer(_at(middle, front, level), _BACK, upwards, _ANTERIOR_CHAMFER * depth_mm)
    after = _chamfer(_at(middle, behind, level), -_BACK, _UP, _POSTERIOR_CHAMFER * depth_mm)
    posterior = _at(middle, behind, level + 22.0)
    return {
        "femur_distal": Cut("femur", _at(middle, middle[1], level), -_UP, (80.0, 60.0)),
        "femur_anterior": Cut("femur", anterior, flange, (70.0, 0.8 * (cortex[2] - level))),
        "femur_posterior": Cut("femur", posterior, _BACK, (80.0, 44.0)),
        "femur_chamfer_anterior": before,
        "femur_chamfer_posterior": after,
    }


def _at(middle: FloatArray, y: float, z: float) -> FloatArray:
    return np.array([middle[0], y, z])


def _chamfer(corner: FloatArray, along: FloatArray, upwards: FloatArray, leg_mm: float) -> Cut:
    """Cuts off the edge of the distal and another face: equally much of both."""
    ends = corner + leg_mm * along, corner + leg_mm * upwards
    across = ends[1] - ends[0]
    outwards = -(along + upwards)
    return Cut(
        "femur",
        0.5 * (ends[0] + ends[1]),
        outwards / np.linalg.norm(outwards),
        (80.0, float(np.linalg.norm(across))),
    )
