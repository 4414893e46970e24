"""Completes a plan: side, landmarks, targets and approaches where files give none."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from navapp.errors import PlanError
from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.transform import FloatArray
from navapp.preop.default_targets import with_defaults
from navapp.preop.landmarks import estimate_landmarks
from navapp.preop.planned_content import PlannedContent
from navapp.preop.side_estimate import SideEstimate, estimate_side
from navapp.preop.usual_approaches import usual_approaches
from navapp.values import ANKLE_CENTRE, HIP_CENTRE, BoneModel, Plan, Side

# A planned point of a bone lies on it or beside it, but for the centres of the other joints.
_FAR_MM = 30.0
# How sure an estimate is, in words.
_SAID = {"certain": "certainly", "likely": "by their shapes", "unknown": "perhaps"}
_TURNED = np.array([-1.0, -1.0, 1.0])


def with_side(
    bones: Mapping[str, BoneModel],
    given: Side | None,
    fibula: TriangleMesh | None = None,
    *,
    is_sure: bool = False,
) -> tuple[dict[str, BoneModel], list[str]]:
    """The bones with the side that is given, else with the one that their shapes tell.

    Args:
        bones: of the plan.
        given: by the user.
        fibula: beside the tibia, where it is known: it makes the estimate certain.
        is_sure: the given side holds, whatever the bones look like.

    Returns:
        Bones, and what has to be said: that the side is an estimate or unknown, or that the given
        one contradicts an estimate.

    Raises:
        PlanError: the given side contradicts a certain estimate, and nobody is sure of it.
    """
    estimate = estimate_side(bones, fibula)
    if not is_sure and estimate.certainty == "certain" and given not in (None, estimate.side):
        raise PlanError(
            _contradiction(estimate, given),
            remedy="check the patient and the pictures; add --side-anyway if it is right",
        )
    side = given or estimate.side
    return {name: replace(bone, side=side) for name, bone in bones.items()}, _make_side_warnings(
        estimate, given
    )


def complete(plan: Plan, planned: PlannedContent) -> tuple[Plan, list[str]]:
    """The plan with what was planned; landmarks and targets from the surfaces where it has none.

    Given landmarks replace estimated ones of the same name.

    Returns:
        The plan, and warnings: what was assumed, what lies far from its bone, what is absent.

    Raises:
        PlanError: a stage names what nobody gave.
    """
    content = planned.content
    targets, stages = with_defaults(plan.bones, planned.targets, content.stages)
    landmarks = estimate_landmarks(plan.bones) | dict(content.landmarks)
    whole = replace(
        planned,
        content=replace(content, landmarks=landmarks, stages=stages),
        targets=targets,
    )
    warnings = [*planned.warnings, *_far_from_bones(planned, plan.bones)]
    for bone, name in (("femur", HIP_CENTRE), ("tibia", ANKLE_CENTRE)):
        if bone in plan.bones and name not in landmarks and name not in planned.absent:
            centre = name.partition("/")[2].replace("_", " ")
            warnings.append(
                f"the {centre} is not given: the mechanical axis of the {bone} is unknown "
                f"(give it in --contents, or mark it absent)"
            )
    try:
        completed = replace(whole.put_into(plan), approaches=usual_approaches(plan.bones))
        return completed, warnings
    except ValueError as error:
        raise PlanError(str(error), remedy="give it, or leave its name out") from error


def _make_side_warnings(estimate: SideEstimate, given: Side | None) -> list[str]:
    why = ", ".join(estimate.reasons)
    if given is not None:
        is_other = estimate.side is not None and estimate.side != given
        return [_contradiction(estimate, given)] if is_other else []
    if estimate.side is None:
        return [f"the side is unknown: {why} (give --side)"]
    return [
        f"the side is not given; it is taken to be {estimate.side}, which is "
        f"{estimate.certainty}: {why} (give --side)"
    ]


def _contradiction(estimate: SideEstimate, given: Side | None) -> str:
    return (
        f"--side says {given}, but the bones are {_SAID[estimate.certainty]} of a "
        f"{estimate.side} knee: {', '.join(estimate.reasons)}"
    )


def _far_from_bones(planned: PlannedContent, bones: Mapping[str, BoneModel]) -> list[str]:
    """What lies further from its bone than it can, and whether RAS would explain it."""
    from scipy.spatial import cKDTree

    trees = {name: cKDTree(bone.mesh.vertices_mm) for name, bone in bones.items()}
    warnings = []
    for what, bone, point in _points_of(planned):
        if bone not in trees:
            warnings.append(f"{what} belongs to the {bone}, which the plan does not have")
            continue
        distance_mm, turned_mm = (float(trees[bone].query(p)[0]) for p in (point, point * _TURNED))
        if distance_mm > _FAR_MM:
            hint = ": it looks like RAS, give it in LPS" if turned_mm < _FAR_MM else ""
            warnings.append(f"{what} lies {distance_mm:.0f} mm from the {bone}{hint}")
    return warnings


def _points_of(planned: PlannedContent) -> list[tuple[str, str, FloatArray]]:
    """What, its bone, and a point (3,) of it that lies on or near that bone."""
    content = planned.content
    points = [(f"plane '{name}'", one.bone, one.point_mm) for name, one in content.planes.items()]
    points += [(f"drill '{name}'", one.bone, one.entry_mm) for name, one in content.drills.items()]
    points += [
        (f"{one.kind} '{name}'", one.bone, one.bone_from_part.translation_mm)
        for name, one in content.parts.items()
    ]
    points += [
        (f"landmark '{name}'", name.partition("/")[0], one.point_mm)
        for name, one in content.landmarks.items()
        if name not in (HIP_CENTRE, ANKLE_CENTRE)
    ]
    for name, some in planned.targets.items():
        points += [(f"target '{name}'", name.partition("/")[0], point) for point in some]
    return points
