"""`navapp plan --contents --markups`: reads the surgical content of a plan and reports it."""

import argparse
from typing import TYPE_CHECKING, Any

from navapp.values import ANKLE_CENTRE, HIP_CENTRE

if TYPE_CHECKING:
    from navapp.geometry.transform import FloatArray
    from navapp.values import Landmark, Plan


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.add_argument(
        "--contents",
        metavar="FILE.toml",
        help="planes, drills, implants, spacers, risks, landmarks, targets, defects and stages "
        "(docs/contents.toml is one to start from)",
    )
    parser.add_argument(
        "--markups",
        action="append",
        default=[],
        metavar="FILE.mrk.json",
        help="planes, lines, curves and points from 3D Slicer; may be given several times",
    )


def complete_plan(plan: "Plan", options: argparse.Namespace) -> "tuple[Plan, list[str]]":
    """The plan with its surgical content, and what there is to warn of.

    Raises:
        PlanError: a file that cannot be used.
    """
    from navapp.preop.contents_file import read_contents
    from navapp.preop.markups import read_markups
    from navapp.preop.plan_completion import complete
    from navapp.preop.planned_content import PlannedContent

    planned = PlannedContent()
    if options.contents is not None:
        planned = planned.union(read_contents(options.contents, plan.bones))
    for path in options.markups:
        planned = planned.union(read_markups(path, plan.bones))
    return complete(plan, planned)


def content_of(plan: "Plan") -> dict[str, Any]:
    """What programs are told of it."""
    content = plan.content
    return {
        "planes": {name: one.bone for name, one in content.planes.items()},
        "drills": {
            name: {"bone": one.bone, "depth_mm": one.depth_mm, "diameter_mm": one.diameter_mm}
            for name, one in content.drills.items()
        },
        "parts": {name: {"kind": p.kind, "bone": p.bone} for name, p in content.parts.items()},
        "risks": {
            name: {"bone": one.bone, "safety_mm": one.safety_mm}
            for name, one in content.risks.items()
        },
        "landmarks": {
            name: {"point_mm": one.point_mm.tolist(), "sd_mm": one.sd_mm, "source": one.source}
            for name, one in content.landmarks.items()
        },
        "absent": [name for name in (HIP_CENTRE, ANKLE_CENTRE) if name not in content.landmarks],
        "defects": {name: len(one.vertices) for name, one in content.defects.items()},
        "targets": {name: len(p.reshape(-1, 3)) for name, p in plan.targets.items()},
        "stages": {
            name: {"bone": one.bone, "targets": list(one.targets)}
            for name, one in content.stages.items()
        },
    }


def lines_of(plan: "Plan") -> list[str]:
    """What people are told of it, a line a thing."""
    content = plan.content
    return [
        *(f"  target {name}: {_points(points)}" for name, points in plan.targets.items()),
        *(f"  plane {name}: of the {one.bone}" for name, one in content.planes.items()),
        *(
            f"  drill {name}: {one.diameter_mm:g} x {one.depth_mm:g} mm, into the {one.bone}"
            for name, one in content.drills.items()
        ),
        *(f"  {one.kind} {name}: on the {one.bone}" for name, one in content.parts.items()),
        *(
            f"  risk {name}: moves with the {one.bone}, keep {one.safety_mm:g} mm away"
            for name, one in content.risks.items()
        ),
        *(
            f"  defect {name}: {len(one.vertices)} vertices of the {one.bone}"
            for name, one in content.defects.items()
        ),
        *(
            f"  stage {name}: {one.bone}, {len(one.targets) or 'its usual'} targets"
            for name, one in content.stages.items()
        ),
        *(f"  landmark {name}: {_place(one)}" for name, one in content.landmarks.items()),
        *(
            f"  landmark {name}: absent"
            for name in (HIP_CENTRE, ANKLE_CENTRE)
            if name not in content.landmarks
        ),
    ]


def _place(landmark: "Landmark") -> str:
    point = ", ".join(f"{value:.1f}" for value in landmark.point_mm)
    sd = "" if landmark.sd_mm is None else f" +- {landmark.sd_mm:.1f}"
    return f"{point}{sd} mm ({landmark.source})"


def _points(points_mm: "FloatArray") -> str:
    n = len(points_mm.reshape(-1, 3))
    return "1 point" if n == 1 else f"{n} points"
