"""`navapp plan`: make a pre-operative plan, or show one."""

import argparse
from typing import TYPE_CHECKING, Any

from navapp.cli.diagnostics import Diagnostics, check_writable, write_json
from navapp.errors import UsageError

if TYPE_CHECKING:
    from navapp.values import Plan

_EXAMPLE = """\
examples:
  navapp plan --surface femur=femur.ply --surface tibia=tibia.ply --side right --out plans/knee
  navapp plan show plans/knee
"""


def add_parser(subparsers: Any) -> None:
    """Declare the verb."""
    parser = subparsers.add_parser(
        "plan",
        help="make a pre-operative plan from bone surfaces, or show one",
        epilog=_EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("what", nargs="?", choices=("show",), help="show: print a plan's summary")
    parser.add_argument("folder", nargs="?", metavar="P", help="plan folder to show")
    parser.add_argument(
        "--surface",
        action="append",
        default=[],
        metavar="NAME=FILE",
        help="a bone's surface (PLY, LPS, mm); may be given for several bones",
    )
    parser.add_argument("--side", choices=("left", "right"), help="of the knee")
    parser.add_argument("--out", metavar="P", help="plan folder to write")
    parser.add_argument("--json", metavar="FILE", help="result for programs (- is stdout)")


def run(options: argparse.Namespace, diagnostics: Diagnostics) -> int:
    """Do it."""
    from navapp.preop import read_plan

    check_writable(options.json)
    if options.what == "show":
        if options.folder is None or options.surface or options.out:
            raise UsageError("show takes a plan folder only", remedy="navapp plan show P")
        plan = read_plan(options.folder)
        warnings: list[str] = []
    else:
        plan, warnings = _make(options)
    for warning in warnings:
        diagnostics.warn(warning)
    write_json(options.json, "plan", _content(plan, warnings))
    if options.json != "-":
        diagnostics.say(_summary(plan))
    return 0


def _make(options: argparse.Namespace) -> "tuple[Plan, list[str]]":
    from navapp.preop import import_surface, write_plan
    from navapp.values import Plan

    if not options.surface:
        raise UsageError("no surface is given", remedy="add --surface femur=FILE")
    if options.out is None:
        raise UsageError("--out is missing", remedy="name the plan folder to write")
    bones = {}
    warnings: list[str] = []
    for entry in options.surface:
        name, equals, path = entry.partition("=")
        if not equals or not name or not path:
            raise UsageError(f"--surface {entry} is not NAME=FILE", remedy="femur=femur.ply")
        if name not in ("femur", "tibia", "patella"):
            raise UsageError(
                f"'{name}' is no bone of the knee that is followed",
                remedy="use femur, tibia or patella",
            )
        if name in bones:
            raise UsageError(f"the {name} is given twice", remedy="give one surface a bone")
        imported = import_surface(name, path, options.side)
        bones[name] = imported.bone
        warnings += imported.warnings
    plan = Plan(bones, name=str(options.out).rstrip("/").rsplit("/", 1)[-1])
    write_plan(options.out, plan)
    return plan, warnings


def _content(plan: "Plan", warnings: list[str]) -> dict[str, Any]:
    return {
        "bones": {
            name: {
                "vertices": len(bone.mesh.vertices_mm),
                "faces": len(bone.mesh.faces),
                "volume_mm3": bone.mesh.volume_mm3(),
                "side": bone.side,
            }
            for name, bone in plan.bones.items()
        },
        "ct": None,
        "warnings": warnings,
        "hash": plan.digest,
    }


def _summary(plan: "Plan") -> str:
    lines = [f"plan {plan.name} ({plan.digest})"]
    for name, bone in plan.bones.items():
        size = " x ".join(f"{extent:.0f}" for extent in bone.mesh.size_mm)
        volume_cm3 = bone.mesh.volume_mm3() / 1000.0
        lines.append(
            f"  {name}: {len(bone.mesh.vertices_mm)} vertices, {size} mm, "
            f"{volume_cm3:.0f} cm3, side {bone.side or 'unknown'}"
        )
    lines += [f"  target {name}" for name in plan.targets]
    return "\n".join(lines)
