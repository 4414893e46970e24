"""The five surgical stages: one declarative table.

Tolerances are those of the plan's targets at that stage. Layers (`navapp.overlay.layers`) are drawn
whatever the order given. `entry` and `exit` are the conditions of its gates (`control.gates`).
Source: the paper, section 4 (opening, drilling, implant, patella, spacer).
"""

from navapp.errors import UsageError
from navapp.values import Condition, ConditionKind, Plan, StageSpec

# Before the first guides of a session.
TIME_OUT: tuple[Condition, ...] = (
    Condition("patient", "this is the plan's patient"),
    Condition("side", "this is the plan's side"),
    Condition("plan", "this is the plan that was decided on"),
    Condition("rig", "the rig is calibrated", ConditionKind.RIG_VALID),
)

_BONE_OK = Condition("bone_ok", "registration accepted, pose OK", ConditionKind.BONE_OK)
# Met by a check with the pointer that passes, or by a person's word.
CHECKED_ON_PATIENT = "checked_on_patient"
_CHECKED = Condition(
    CHECKED_ON_PATIENT, "checked on the patient: known points lie where shown", is_repeated=True
)
_STEPS = Condition("steps", "made as planned", ConditionKind.STEPS_MADE)

STAGES: tuple[StageSpec, ...] = (
    StageSpec(
        number=1,
        name="opening",
        bone="femur",
        tolerance_mm=2.0,
        tolerance_deg=2.0,
        targets=("femur/medial_condyle", "femur/lateral_condyle", "femur/notch"),
        layers=("bone", "defects", "risks", "targets", "scale"),
        exit=(Condition("bone_exposed", "the bone is exposed"), _BONE_OK),
    ),
    StageSpec(
        number=2,
        name="drilling",
        bone="femur",
        tolerance_mm=1.0,
        tolerance_deg=1.0,
        targets=("femur/notch",),
        layers=("bone", "risks", "drills", "targets", "scale"),
        entry=(_CHECKED,),
        exit=(Condition("entry_point", "the entry point was checked with the tip"), _STEPS),
    ),
    StageSpec(
        number=3,
        name="implant",
        bone="femur",
        tolerance_mm=1.0,
        tolerance_deg=1.0,
        targets=("femur/medial_condyle", "femur/lateral_condyle"),
        layers=("bone", "removal", "risks", "parts", "planes", "scale"),
        entry=(_CHECKED,),
        exit=(Condition("component_size", "the component's size is confirmed"), _STEPS),
    ),
    StageSpec(
        number=4,
        name="patella",
        bone="patella",
        tolerance_mm=1.0,
        tolerance_deg=2.0,
        targets=("patella/centre",),
        layers=("bone", "removal", "parts", "planes", "scale"),
        exit=(_STEPS, Condition("thickness", "the patella's thickness was measured")),
    ),
    StageSpec(
        number=5,
        name="spacer",
        bone="tibia",
        tolerance_mm=1.0,
        tolerance_deg=1.0,
        targets=("tibia/medial_plateau", "tibia/lateral_plateau"),
        layers=("bone", "removal", "parts", "planes", "scale"),
        exit=(
            _CHECKED,
            _STEPS,
            Condition("gaps", "the gaps were measured in extension and at 90 deg"),
        ),
    ),
)


def stage_by_number(number: int) -> StageSpec:
    """The stage with that number.

    Raises:
        UsageError: there is none.
    """
    for stage in STAGES:
        if stage.number == number:
            return stage
    raise UsageError(f"there is no stage {number}", remedy=f"choose 1 to {len(STAGES)}")


def stage_of(bone: str, plan: Plan | None = None) -> StageSpec:
    """The first stage that follows a bone: its goal is the bone's, whatever stage is in force.

    A plan may give its stages bones and targets of its own.

    Raises:
        UsageError: none does.
    """
    planned = () if plan is None else tuple(plan.stage(stage) for stage in STAGES)
    for stage in (*planned, *STAGES):
        if stage.bone == bone:
            return stage
    known = ", ".join(sorted({stage.bone for stage in STAGES}))
    raise UsageError(f"no stage follows the bone '{bone}'", remedy=f"use one of {known}")


def stage_by_name(name: str) -> StageSpec:
    """The stage with that name, or with that number as text.

    Raises:
        UsageError: there is none.
    """
    for stage in STAGES:
        if name.lower() in (stage.name, str(stage.number)):
            return stage
    names = ", ".join(stage.name for stage in STAGES)
    raise UsageError(f"there is no stage '{name}'", remedy=f"choose one of {names}")
