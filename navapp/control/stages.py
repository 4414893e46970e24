"""The five surgical stages: one declarative table.

Tolerances are those of the plan's targets at that stage. Layers (`navapp.overlay.layers`) are drawn
whatever the order given. Gates are what the operator confirms by entering the next stage.
Source: the paper, section 4 (opening, drilling, implant, patella, spacer).
"""

from navapp.errors import UsageError
from navapp.values import Plan, StageSpec

STAGES: tuple[StageSpec, ...] = (
    StageSpec(
        number=1,
        name="opening",
        bone="femur",
        tolerance_mm=2.0,
        tolerance_deg=2.0,
        targets=("femur/medial_condyle", "femur/lateral_condyle", "femur/notch"),
        layers=("bone", "defects", "risks", "targets", "scale"),
        gates=("bone exposed", "registration accepted"),
    ),
    StageSpec(
        number=2,
        name="drilling",
        bone="femur",
        tolerance_mm=1.0,
        tolerance_deg=1.0,
        targets=("femur/notch",),
        layers=("bone", "risks", "drills", "targets", "scale"),
        gates=("entry point checked with the tip",),
        measurements=("drill angle", "drill offset", "drill depth"),
    ),
    StageSpec(
        number=3,
        name="implant",
        bone="femur",
        tolerance_mm=1.0,
        tolerance_deg=1.0,
        targets=("femur/medial_condyle", "femur/lateral_condyle"),
        layers=("bone", "removal", "risks", "parts", "planes", "scale"),
        gates=("cuts checked", "component size confirmed"),
        measurements=("varus or valgus", "flexion", "rotation", "resection"),
    ),
    StageSpec(
        number=4,
        name="patella",
        bone="patella",
        tolerance_mm=1.0,
        tolerance_deg=2.0,
        targets=("patella/centre",),
        layers=("bone", "removal", "parts", "planes", "scale"),
        gates=("thickness measured",),
        measurements=("thickness", "tilt"),
    ),
    StageSpec(
        number=5,
        name="spacer",
        bone="tibia",
        tolerance_mm=1.0,
        tolerance_deg=1.0,
        targets=("tibia/medial_plateau", "tibia/lateral_plateau"),
        layers=("bone", "removal", "parts", "planes", "scale"),
        gates=("gaps measured",),
        measurements=("medial gap", "lateral gap", "slope"),
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
