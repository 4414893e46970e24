"""The bones of `--also`: followed beside the stage's."""

from collections.abc import Sequence

from navapp.control.beside_femur import may_start_from
from navapp.control.stages import stage_of
from navapp.errors import UsageError
from navapp.values import Plan, StageSpec


def find_stage_of(bone: str, plan: Plan) -> StageSpec:
    """The first stage that follows a bone.

    Raises:
        UsageError: the plan has no such bone.
    """
    if bone not in plan.bones:
        raise UsageError(f"the plan has no bone '{bone}'", remedy=f"it has {', '.join(plan.bones)}")
    return stage_of(bone, plan)


def check_others(
    names: Sequence[str], plan: Plan, first: StageSpec, *, is_live: bool = False
) -> tuple[str, ...]:
    """The bones of the names, each once.

    Raises:
        UsageError: the plan has no such bone, it is the first stage's own, or a live session cannot
            find it from that one.
    """
    others = tuple(find_stage_of(bone, plan).bone for bone in dict.fromkeys(names))
    if first.bone in others:
        raise UsageError(f"the {first.bone} is followed anyway", remedy="leave --also out")
    for bone in others:
        if is_live and not may_start_from(bone, first.bone):
            raise UsageError(
                f"the {bone} is not found from the {first.bone}", remedy="register it in its stage"
            )
    return others
