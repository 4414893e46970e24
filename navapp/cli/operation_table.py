"""What was planned, made and measured in a session, step by step."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Protocol

import numpy as np

from navapp.control.recorder import measured_to_json
from navapp.control.stages import STAGES
from navapp.control.states import StepLine
from navapp.geometry.transform import FloatArray, RigidTransform, rotation_angle_deg
from navapp.values import (
    DrillAxis,
    Measured,
    MeasuredHole,
    Plan,
    PlannedStep,
    ResectionPlane,
    StageSpec,
)


class KnowsMade(Protocol):
    """Truth of a simulated room, for after the run."""

    def made_planes(self) -> Mapping[str, tuple[FloatArray, FloatArray]]:
        """Point and normal of faces, by the name of the cut."""
        ...

    def made_hole(self) -> tuple[FloatArray, FloatArray]:
        """Entry and direction of the one hole."""
        ...

    def made_parts(self) -> Mapping[str, RigidTransform]:
        """By which motion of its bone a part is off its plan, by its name."""
        ...


@dataclass(frozen=True, slots=True)
class Off:
    """How far one thing is off another: a cut along its normal, a hole across, a part's origin."""

    mm: float
    deg: float | None  # None of a hole that is measured: its axis is not


@dataclass(frozen=True, slots=True, eq=False)
class StepResult:
    """A planned step of a stage at the session's end."""

    stage: str
    line: StepLine
    off_plan: Off | None  # truly, in a simulated room; None where nobody knows
    error: Off | None  # of what was measured, against the truth


def list_steps(
    plan: Plan,
    steps_of: Callable[[StageSpec], Sequence[StepLine]],
    truth: KnowsMade | None,
) -> list[StepResult]:
    """All steps of a plan, in the order of its stages.

    Args:
        plan: of the session.
        steps_of: the session's steps of a stage.
        truth: of what was made; None when nobody knows it.
    """
    results = []
    for stage in (plan.stage(one) for one in STAGES[1:]):
        for line in steps_of(stage):
            off_plan, error = None, None
            if line.is_made and truth is not None:
                step = plan.content.steps[line.name]
                off_plan = _find_off_plan(line.name, step, truth, plan)
                if line.measured is not None and off_plan is not None:
                    error = _find_error(line.name, line.measured, truth)
            results.append(StepResult(stage.name, line, off_plan, error))
    return results


def format_steps(steps: Sequence[StepResult]) -> str:
    """A table for people; empty when nothing was made."""
    if not any(step.line.is_made for step in steps):
        return ""
    rows = [("step", "kind", "made, off its plan (truth)", "measured, off its plan (95 % bound)")]
    rows += [(s.line.name, s.line.kind, _say_made(s), _say_measured(s.line)) for s in steps]
    widths = [max(len(row[k]) for row in rows) for k in range(4)]
    lines = ["  ".join(f"{one:<{w}}" for one, w in zip(row, widths, strict=True)) for row in rows]
    return "\n".join(line.rstrip() for line in lines)


def steps_to_json(steps: Sequence[StepResult]) -> list[dict[str, Any]]:
    """The `operation` list."""
    return [
        {
            "stage": step.stage,
            "step": step.line.name,
            "kind": step.line.kind,
            "made": step.line.is_made,
            "off_plan": None if step.off_plan is None else asdict(step.off_plan),
            "measured": (
                None if step.line.measured is None else measured_to_json(step.line.measured)
            ),
            "error": None if step.error is None else asdict(step.error),
            "thickness": None if step.line.thickness is None else asdict(step.line.thickness),
        }
        for step in steps
    ]


def _say_made(step: StepResult) -> str:
    if not step.line.is_made:
        return "not made"
    off = step.off_plan
    return "made" if off is None else f"{off.mm:+.2f} mm, {off.deg:.2f} deg"


def _say_measured(line: StepLine) -> str:
    measured = line.measured
    if measured is None:
        return "not measured" if line.kind != "part" and line.is_made else ""
    if isinstance(measured, MeasuredHole):
        return (
            f"{measured.off_mm:+.2f} mm (+-{measured.bound_mm:.2f}), "
            f"{measured.diameter_mm:.1f} mm wide"
        )
    return (
        f"{measured.offset_mm:+.2f} mm (+-{measured.bound_mm:.2f}), "
        f"{measured.angle_deg:.2f} deg (+-{measured.bound_deg:.2f})"
        + ("" if line.thickness is None else f", {line.thickness.mm:.1f} mm thick")
    )


def _find_off_plan(name: str, step: PlannedStep, truth: KnowsMade, plan: Plan) -> Off | None:
    if isinstance(step, ResectionPlane):
        if name not in truth.made_planes():
            return None
        point_mm, normal = truth.made_planes()[name]
        return Off(float((point_mm - step.point_mm) @ normal), _angle_deg(normal, step.normal))
    if isinstance(step, DrillAxis):
        if len(plan.content.drills) != 1:  # the room knows of one hole, by no name
            return None
        entry_mm, direction = truth.made_hole()
        off_mm = float(np.linalg.norm(step.axes @ (entry_mm - step.entry_mm)))
        return Off(off_mm, _angle_deg(direction, step.direction))
    motion = truth.made_parts().get(name)
    if motion is None:
        return None
    origin_mm = step.bone_from_part.translation_mm
    off_mm = float(np.linalg.norm(motion.apply(origin_mm) - origin_mm))
    still = RigidTransform.identity(step.bone, step.bone)
    return Off(off_mm, rotation_angle_deg(motion, still))


def _find_error(name: str, measured: Measured, truth: KnowsMade) -> Off:
    """Of the offset at the planned point and between the normals; of the mouth across the hole."""
    if isinstance(measured, MeasuredHole):
        true_mm = measured.drill.axes @ (truth.made_hole()[0] - measured.drill.entry_mm)
        return Off(float(np.linalg.norm(measured.offset_mm - true_mm)), None)
    point_mm, normal = truth.made_planes()[name]
    true_offset_mm = float((point_mm - measured.plane.point_mm) @ normal)
    return Off(abs(measured.offset_mm - true_offset_mm), _angle_deg(measured.normal, normal))


def _angle_deg(one: FloatArray, other: FloatArray) -> float:
    return math.degrees(math.atan2(float(np.linalg.norm(np.cross(one, other))), float(one @ other)))
