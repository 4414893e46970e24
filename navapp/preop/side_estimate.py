"""Estimates left or right from the shapes of the bones, with a certainty; may be unknown."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from navapp.geometry.mesh import TriangleMesh
from navapp.preop.cut_ends import anatomy_of
from navapp.preop.femur_landmarks import BACK, DOWN, condyles_of, find_shaft_top_mm
from navapp.preop.tibia_landmarks import RIM_MM, find_tibial_end, tubercle_of
from navapp.values import BoneModel, Side

Certainty = Literal["certain", "likely", "unknown"]

# What a surface that is good to 0.3 mm can tell, three times over: a line over two condyles 50 mm
# apart to 0.5 deg, the top of a round ridge (radius 5 mm) to 0.5 mm, of the tubercle to 0.7 mm.
_CLEAR_LEAN_DEG, _CLEAR_RIDGE_MM, _CLEAR_TUBERCLE_MM = 1.5, 1.5, 2.0
# The head of the fibula lies 25 to 35 mm beside the middle of the tibia.
_CLEAR_FIBULA_MM = 15.0
# The shaft's lean is looked at above the condyles.
_SHAFT_FROM_MM, _SLICE_MM = 50.0, 2.5
# Fewer vertices than this are no slice.
_LEAST_POINTS = 8


@dataclass(frozen=True, slots=True)
class SideEstimate:
    """An estimated side with its certainty and reasons."""

    side: Side | None
    certainty: Certainty
    reasons: tuple[str, ...]


def estimate_side(
    bones: Mapping[str, BoneModel], fibula: TriangleMesh | None = None
) -> SideEstimate:
    """From what there is of femur, tibia, patella and fibula.

    Certain is only what the fibula says, where the other bones show that the knee is upright and
    faces forward (a knee turned round looks like the other one), and none of them disagrees. What
    shapes alone say is likely at best; when they disagree it is unknown.
    """
    own = {name: anatomy_of(bone) for name, bone in bones.items()}
    own = {name: mesh for name, mesh in own.items() if len(mesh.faces)}
    if fibula is not None:
        own["fibula"] = fibula
    if not _is_upright(own):
        return SideEstimate(None, "unknown", ("the bones are not upright in the plan's axes",))
    votes = [(cue, value) for cue, value, least in _cues(own) if abs(value) > least]
    reasons = tuple(f"{cue} ({_side(value)})" for cue, value in votes)
    sides = {_side(value) for _, value in votes}
    if len(sides) != 1:
        why = "the bones' shapes disagree" if sides else "no shape is clear enough"
        return SideEstimate(None, "unknown", (why, *reasons))
    is_certain = any(cue == "fibula" for cue, _ in votes) and _faces_forward(own)
    return SideEstimate(sides.pop(), "certain" if is_certain else "likely", reasons)


def _side(lateral_x: float) -> Side:
    """Lateral towards -x (the patient's right) is a right knee."""
    return "right" if lateral_x < 0.0 else "left"


def _cues(bones: Mapping[str, TriangleMesh]) -> Iterator[tuple[str, float, float]]:
    """What, how far towards +x lateral seems to be, and from where on that is clear."""
    if "fibula" in bones and "tibia" in bones:
        offset_mm = bones["fibula"].centroid_mm[0] - bones["tibia"].centroid_mm[0]
        yield "fibula", float(offset_mm), _CLEAR_FIBULA_MM
    if "femur" in bones:
        yield "lean of the femur", _femur_lean_deg(bones["femur"]), _CLEAR_LEAN_DEG
    if "tibia" in bones:
        yield "tubercle of the tibia", _tubercle_mm(bones["tibia"]), _CLEAR_TUBERCLE_MM
    if "patella" in bones:
        yield "ridge of the patella", -_ridge_mm(bones["patella"]), _CLEAR_RIDGE_MM


def _femur_lean_deg(femur: TriangleMesh) -> float:
    """How far the shaft leans to +x of the normal to the line below both condyles.

    A shaft leans outward by 5 to 7 deg; measured against its own condyles, it does not matter how
    the leg lay. 0 when there is too little of a shaft.
    """
    condyles = condyles_of(femur)
    if condyles is None:
        return 0.0
    vertices = condyles.vertices_mm
    left, right = (
        vertices[condyles.of_side(sign)][np.argmax(vertices[condyles.of_side(sign)] @ DOWN)]
        for sign in (1.0, -1.0)
    )
    top = find_shaft_top_mm(femur)
    if top - vertices[:, 2].min() < _SHAFT_FROM_MM + 2.0 * _SLICE_MM:
        return 0.0
    slice_x = vertices[np.abs(vertices[:, 2] - top + _SLICE_MM) < _SLICE_MM, 0]
    middle = 0.5 * (left + right)
    if len(slice_x) < _LEAST_POINTS:
        return 0.0
    rise = top - _SLICE_MM - middle[2]
    lean = np.arctan2(0.5 * (slice_x.min() + slice_x.max()) - middle[0], rise)
    return float(np.degrees(lean + np.arctan2(left[2] - right[2], left[0] - right[0])))


def _tubercle_mm(tibia: TriangleMesh) -> float:
    """How far the tubercle, which stands outward of the middle, lies to +x of it.

    Across the line behind both plateaus, so that it does not matter how the leg was turned.
    """
    end = find_tibial_end(tibia)
    tubercle = None if end is None else tubercle_of(end)
    if end is None or tubercle is None:
        return 0.0
    is_rim = (end.below_top_mm > RIM_MM[0]) & (end.below_top_mm < RIM_MM[1])
    behind = []
    for sign in (1.0, -1.0):
        half = end.vertices_mm[is_rim & (sign * (end.vertices_mm[:, 0] - end.middle_mm[0]) > 5.0)]
        if len(half) == 0:
            return 0.0
        behind.append(half[np.argmax(half @ BACK), :2])
    across = (behind[0] - behind[1]) / np.linalg.norm(behind[0] - behind[1])
    return float((tubercle.point_mm[:2] - end.middle_mm) @ across)


def _ridge_mm(patella: TriangleMesh) -> float:
    """How far the ridge on the back lies to +x of the middle: it is nearer to the inner edge.

    Across the line through both edges, so that it does not matter how the patella is tilted.
    """
    level = np.abs(patella.vertices_mm[:, 2] - patella.centroid_mm[2]) < 6.0
    slab = patella.vertices_mm[level, :2]
    if len(slab) < _LEAST_POINTS:
        return 0.0
    low, high = slab[np.argmin(slab[:, 0])], slab[np.argmax(slab[:, 0])]
    across = (high - low) / np.linalg.norm(high - low)
    behind = np.array([-across[1], across[0]])
    ridge = slab[np.argmax(slab @ behind)]
    return float((ridge - 0.5 * (low + high)) @ across)


def _is_upright(bones: Mapping[str, TriangleMesh]) -> bool:
    """Whether nothing speaks against z pointing to the head."""
    heights = [float(bones[name].centroid_mm[2]) for name in ("femur", "tibia") if name in bones]
    if len(heights) == 2:
        return heights[0] > heights[1]
    return all(_is_broader_at(bones[name], sign) for name, sign in _ENDS if name in bones)


# Where a bone is broad: the femur below, the tibia above.
_ENDS = (("femur", -1.0), ("tibia", 1.0))


def _is_broader_at(bone: TriangleMesh, sign: float) -> bool:
    level = sign * bone.vertices_mm[:, 2]
    span = np.ptp(level)
    if span == 0.0:
        return False
    ends = (level > level.max() - 0.3 * span, level < level.min() + 0.3 * span)
    near, far = (float(np.ptp(bone.vertices_mm[end, 0])) for end in ends)
    return near > far


def _faces_forward(bones: Mapping[str, TriangleMesh]) -> bool:
    """Whether the front is where it should be: the patella says so, and nothing else can."""
    if "patella" not in bones or "femur" not in bones:
        return False
    offset = bones["patella"].centroid_mm - bones["femur"].centroid_mm
    return bool(offset[1] < -abs(offset[0]))
