"""What was planned, made and measured in a session, step by step."""

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Protocol

import numpy as np

from navapp.control.recorder import measured_to_json
from navapp.control.stages import STAGES
from navapp.geometry.transform import FloatArray, RigidTransform, rotation_angle_deg
from navapp.resection import Thickness, measure_thickness
from navapp.values import (
    DrillAxis,
    Measured,
    MeasuredFace,
    MeasuredHole,
    Plan,
    PlannedStep,
    ResectionPlane,
    join_measured,
)


class KnowsMade(Protocol):
    """Truth of a simulated room, for after the run."""

    def made_planes(self) -> Mapping[str, tuple[FloatArray, FloatArray]]:
        """Point and normal of faces."""
        ...

    def made_hole(self) -> tuple[FloatArray, FloatArray]:
        """Entry and direction."""
        ...

    def made_parts(self) -> Mapping[str, RigidTransform]:
        """By which motion of its bone a part is off its plan."""
        ...


@dataclass(frozen=True, slots=True)
class Miss:
    """How far something is off its plan: a cut along its normal, a hole across, a part's origin."""

    mm: float
    deg: float


@dataclass(frozen=True, slots=True, eq=False)
class StepResult:
    """A planned step of a stage."""

    stage: str
    name: str
    kind: str
    is_made: bool  # an operator has confirmed it
    miss: Miss | None  # true, of a simulated room; None where nobody knows, or of what is not made
    measured: Measured | None  # a cut or a hole, all measurements together
    thickness: Thickness | None = None  # of what a measured cut took off


def list_steps(
    plan: Plan,
    made: Collection[str],
    measured: Sequence[Mapping[str, Measured]],
    truth: KnowsMade | None,
) -> list[StepResult]:
    """All steps of a plan, in the order of its stages.

    Args:
        plan: of the session.
        made: names of steps that are confirmed at its end.
        measured: as each frame has it.
        truth: of what was made; None when nobody knows it.
    """
    results = []
    for stage in (plan.stage(one) for one in STAGES[1:]):
        for name, step in plan.steps_of(stage).items():
            seen = [frame[name] for frame in measured if name in frame]
            is_made = name in made
            miss = _miss(name, step, truth) if is_made and truth is not None else None
            one = join_measured(seen) if is_made and seen else None
            results.append(
                StepResult(
                    stage.name, name, _kind(step), is_made, miss, one, _thickness(plan, step, one)
                )
            )
    return results


def format_steps(steps: Sequence[StepResult]) -> str:
    """A table for people; empty when nothing was made."""
    if not any(step.is_made for step in steps):
        return ""
    rows = [("step", "kind", "made, off its plan (truth)", "measured, off its plan (95 % bound)")]
    rows += [(step.name, step.kind, _say_made(step), _say_measured(step)) for step in steps]
    widths = [max(len(row[k]) for row in rows) for k in range(4)]
    lines = ["  ".join(f"{one:<{w}}" for one, w in zip(row, widths, strict=True)) for row in rows]
    return "\n".join(line.rstrip() for line in lines)


def steps_to_json(steps: Sequence[StepResult]) -> list[dict[str, Any]]:
    """The `operation` list."""
    return [
        {
            "stage": step.stage,
            "step": step.name,
            "kind": step.kind,
            "made": step.is_made,
            "off_plan": None if step.miss is None else {"mm": step.miss.mm, "deg": step.miss.deg},
            "measured": None if step.measured is None else measured_to_json(step.measured),
            "thickness": None if step.thickness is None else asdict(step.thickness),
        }
        for step in steps
    ]


def _thickness(plan: Plan, step: PlannedStep, measured: Measured | None) -> Thickness | None:
    if not isinstance(measured, MeasuredFace):
        return None
    return measure_thickness(plan.bones[step.bone].mesh, measured)


def _say_made(step: StepResult) -> str:
    if not step.is_made:
        return "not made"
    return "made" if step.miss is None else f"{step.miss.mm:+.2f} mm, {step.miss.deg:.2f} deg"


def _say_measured(step: StepResult) -> str:
    measured = step.measured
    if measured is None:
        return "not measured" if step.kind != "part" and step.is_made else ""
    if isinstance(measured, MeasuredHole):
        return (
            f"{measured.off_mm:+.2f} mm (+-{measured.bound_mm:.2f}), "
            f"{measured.diameter_mm:.1f} mm wide"
        )
    return (
        f"{measured.offset_mm:+.2f} mm (+-{measured.bound_mm:.2f}), "
        f"{measured.angle_deg:.2f} deg (+-{measured.bound_deg:.2f})"
        + ("" if step.thickness is None else f", {step.thickness.mm:.1f} mm thick")
    )


def _kind(step: PlannedStep) -> str:
    if isinstance(step, ResectionPlane):
        return "cut"
    return "hole" if isinstance(step, DrillAxis) else "part"


def _miss(name: str, step: PlannedStep, truth: KnowsMade) -> Miss | None:
    if isinstance(step, ResectionPlane):
        if name not in truth.made_planes():
            return None
        point_mm, normal = truth.made_planes()[name]
        return Miss(float((point_mm - step.point_mm) @ normal), _angle_deg(normal, step.normal))
    if isinstance(step, DrillAxis):
        entry_mm, direction = truth.made_hole()
        off_mm = float(np.linalg.norm(step.axes @ (entry_mm - step.entry_mm)))
        return Miss(off_mm, _angle_deg(direction, step.direction))
    motion = truth.made_parts().get(name)
    if motion is None:
        return None
    origin_mm = step.bone_from_part.translation_mm
    off_mm = float(np.linalg.norm(motion.apply(origin_mm) - origin_mm))
    still = RigidTransform.identity(step.bone, step.bone)
    return Miss(off_mm, rotation_angle_deg(motion, still))


def _angle_deg(one: FloatArray, other: FloatArray) -> float:
    return math.degrees(math.atan2(float(np.linalg.norm(np.cross(one, other))), float(one @ other)))
