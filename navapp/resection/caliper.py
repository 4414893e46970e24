"""Where a face lies by the thickness of the bone below it, read with a caliper at four points.

Of a sawn patella the cameras see the face alone; how much bone lies behind it no picture shows.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple, TypeGuard

import numpy as np

from navapp.errors import UsageError
from navapp.geometry.mesh_sections import section_lines
from navapp.geometry.transform import FloatArray
from navapp.values import BoneModel, MeasuredFace, PlannedStep, ResectionPlane, Side
from navapp.values.faces import MOST_OFF_PLAN_DEG, MOST_OFF_PLAN_MM

# All chosen. Standard deviations of a reading, and of the place at which the jaws lie.
_READING_SD_MM, _PLACE_SD_MM = 0.15, 1.0
# The points lie so far from the middle of the face towards its rim.
_TOWARDS_RIM = 0.5
# Bones of which the cameras see hardly more than a sawn face.
_TRACKED_BY_FACE = ("patella",)
# The order of the points, whatever the side and the plan's axes.
_ORDER = ("medial", "lateral", "left", "right", "distal", "proximal", "anterior", "posterior")
# Four readings of a flat face disagree by no more deviations. One alone that is off by up to six of
# its own passes: 0.9 mm where the surface below is flat.
_MOST_SIGMAS = 3.0
_REMEDY = "plan the cut anew, across the bone"


class CaliperPoint(NamedTuple):
    """A place of a planned face at which a thickness is read, along the planned normal."""

    name: str  # where it lies, from the middle of the face
    place_mm: FloatArray  # (2,) along the axes of the planned plane, from its point
    thickness_mm: float  # of the bone that stays, as planned
    sigma_mm: float  # standard deviation of a reading there


def needs_caliper(step: PlannedStep) -> TypeGuard[ResectionPlane]:
    """Whether a step is a cut after which its bone is tracked by the face."""
    return isinstance(step, ResectionPlane) and step.bone in _TRACKED_BY_FACE


def list_caliper_points(bone: BoneModel, plane: ResectionPlane) -> tuple[CaliperPoint, ...]:
    """Four points: from the middle of the planned face forth and back along both of its axes.

    Medial comes before lateral and distal before proximal.

    Args:
        bone: whole, as planned.
        plane: the planned cut.

    Raises:
        UsageError: the plane meets no bone, no bone lies below a point, or two points would have
            the same name.
    """
    lines = section_lines(bone.mesh, plane.heights_mm(bone.mesh.vertices_mm))
    lines = [line for line in lines if plane.is_over(line).any()]
    if not lines:
        raise UsageError(
            f"the planned cut does not meet the {bone.name}", subject=bone.name, remedy=_REMEDY
        )
    rim_mm = (max(lines, key=len) - plane.point_mm) @ plane.axes.T
    low, high = rim_mm.min(axis=0), rim_mm.max(axis=0)
    middle, half = 0.5 * (low + high), 0.5 * _TOWARDS_RIM * (high - low)
    ways = np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]])
    named = {_name_way(way @ plane.axes, bone.side): middle + way * half for way in ways}
    if len(named) < len(ways):
        raise UsageError(
            f"the planned cut of the {bone.name} leans too much for its thickness to be read",
            subject=bone.name,
            remedy=_REMEDY,
        )
    names = sorted(named, key=_ORDER.index)
    return tuple(_make_point(bone, plane, name, named[name]) for name in names)


def find_face(
    bone: BoneModel, plane: ResectionPlane, thickness_mm: Sequence[float]
) -> MeasuredFace:
    """The face on which readings at the caliper's points lie.

    Args:
        bone: whole, as planned.
        plane: the planned cut.
        thickness_mm: one reading for each of `list_caliper_points`.

    Raises:
        UsageError: not as many readings as points, a reading that is no length, readings that lie
            on no plane, or a face that lies too far from its plan to be tracked.
    """
    points = list_caliper_points(bone, plane)
    if len(thickness_mm) != len(points):
        raise UsageError(
            f"{len(thickness_mm)} thicknesses of the {bone.name} were given",
            subject=bone.name,
            remedy=f"give {len(points)}, in the order that the step's page shows",
        )
    if not all(0.0 < one < math.inf for one in thickness_mm):
        raise UsageError(
            f"a thickness of the {bone.name} is no length",
            subject=bone.name,
            remedy="give numbers above 0, in mm",
        )
    height_mm = np.array(thickness_mm) - [one.thickness_mm for one in points]
    sigma_mm = np.array([one.sigma_mm for one in points])
    rows = np.column_stack([[one.place_mm for one in points], np.ones(len(points))])
    weighted = rows.T / sigma_mm**2
    covariance = np.linalg.inv(weighted @ rows)
    slope_x, slope_y, offset_mm = covariance @ (weighted @ height_mm)
    misfit = (height_mm - rows @ (slope_x, slope_y, offset_mm)) / sigma_mm
    if float(np.linalg.norm(misfit)) > _MOST_SIGMAS:
        raise UsageError(
            f"the thicknesses of the {bone.name} lie on no plane",
            subject=bone.name,
            remedy="read them again, in the order that the step's page shows",
        )
    # A face that is higher towards an axis has its normal tilted away from that axis.
    leaning = np.diag([-1.0, -1.0, 1.0])
    stretch = float(np.sqrt(1.0 + slope_x**2 + slope_y**2))
    tilts_offset = np.array([-slope_x, -slope_y, offset_mm / stretch])
    face = MeasuredFace(plane, tilts_offset, leaning @ covariance @ leaning, 1.0)
    if not face.is_near_plan:
        raise UsageError(
            f"the thicknesses of the {bone.name} lie too far from the plan",
            subject=bone.name,
            remedy=f"read them again: up to {MOST_OFF_PLAN_MM:g} mm and {MOST_OFF_PLAN_DEG:g} deg "
            "are tracked",
        )
    return face


def _name_way(direction: FloatArray, side: Side | None) -> str:
    """A direction of the plan (LPS) in an anatomist's words."""
    axis = int(np.abs(direction).argmax())
    is_positive = bool(direction[axis] > 0.0)
    if axis == 0 and side is not None:
        return "medial" if is_positive == (side == "right") else "lateral"
    return (("right", "left"), ("anterior", "posterior"), ("distal", "proximal"))[axis][is_positive]


def _make_point(
    bone: BoneModel, plane: ResectionPlane, name: str, place_mm: FloatArray
) -> CaliperPoint:
    """The point at a place: thickness and slope of the opposite surface, by its lowest triangle."""
    mesh = bone.mesh
    flat_mm = (mesh.vertices_mm - plane.point_mm) @ plane.axes.T - place_mm
    first, second, third = (flat_mm[mesh.faces[:, k]] for k in range(3))
    # Twice the areas that the place spans with two corners: all of one sign where it is inside.
    spans = np.stack([_cross(second, third), _cross(third, first), _cross(first, second)], axis=1)
    area = spans.sum(axis=1)
    is_below = (spans * np.sign(area)[:, None] >= 0.0).all(axis=1) & (area != 0.0)
    if not is_below.any():
        raise UsageError(
            f"no bone of the {bone.name} lies below the planned cut at "
            f"({place_mm[0]:.0f}, {place_mm[1]:.0f}) mm",
            subject=bone.name,
            remedy=_REMEDY,
        )
    corners_mm = plane.heights_mm(mesh.vertices_mm)[mesh.faces[is_below]]
    heights_mm = (spans[is_below] * corners_mm).sum(axis=1) / area[is_below]
    lowest = int(heights_mm.argmin())
    # The slope of the triangle, by its corners' heights; that of the made face adds little to it.
    corners = mesh.faces[is_below][lowest]
    rows = np.column_stack([flat_mm[corners], np.ones(3)])
    slope = np.linalg.solve(rows, corners_mm[lowest])[:2]
    by_place_mm = _PLACE_SD_MM * float(np.linalg.norm(slope))
    sigma_mm = float(np.linalg.norm((_READING_SD_MM, by_place_mm, bone.surface_sd_mm)))
    return CaliperPoint(name, place_mm, float(-heights_mm[lowest]), sigma_mm)


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """(N,) twice the area that two sides (N, 2) span."""
    area: FloatArray = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    return area
