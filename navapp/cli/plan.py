"""`navapp plan`: make a pre-operative plan, or show one."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from navapp.cli.diagnostics import Diagnostics, check_writable, write_json
from navapp.cli.plan_contents import add_arguments, completed, content_of, lines_of
from navapp.errors import UsageError

if TYPE_CHECKING:
    from navapp.preop import ImportedSurface
    from navapp.values import BoneModel, Plan

_EXAMPLE = """\
examples:
  navapp plan --surface femur=femur.ply --surface tibia=tibia.ply --side right --out plans/knee
  navapp plan --surface femur=femur.ply --cartilage femur=cartilage.ply --out plans/knee
  navapp plan --surface femur=femur.ply --cartilage femur=2.0:0.6 --out plans/knee
  navapp plan --surface femur=femur.ply --contents contents.toml --out plans/knee
  navapp plan --surface femur=femur.ply --markups "drill femur 8mm.mrk.json" --out plans/knee
  navapp plan show plans/knee
"""

_CARTILAGE_HELP = """\
what the camera sees above a bone: the outer surface of its cartilage (PLY, same coordinates; 0
where it lies on the bone or further than 6 mm from it), or one mean thickness and its standard
deviation for the whole bone but its flat or open ends, each 0 to 10 mm. A surface's thickness is
taken to be good to 0.4 mm: an assumption, about one voxel of the pictures it is segmented in"""

_BONES = ("femur", "tibia", "patella")


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
    parser.add_argument(
        "--cartilage",
        action="append",
        default=[],
        metavar="NAME=FILE.ply|MEAN_MM:SD_MM",
        help=_CARTILAGE_HELP,
    )
    add_arguments(parser)
    parser.add_argument("--side", choices=("left", "right"), help="of the knee")
    parser.add_argument("--out", metavar="P", help="plan folder to write")
    parser.add_argument("--json", metavar="FILE", help="result for programs (- is stdout)")


def run(options: argparse.Namespace, diagnostics: Diagnostics) -> int:
    """Do it."""
    from navapp.preop import read_plan

    check_writable(options.json)
    if options.what == "show":
        given = (options.surface, options.cartilage, options.out, options.contents, options.markups)
        if options.folder is None or any(given):
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
    from navapp.preop import import_surface, with_side, write_plan
    from navapp.values import Plan

    if not options.surface:
        raise UsageError("no surface is given", remedy="add --surface femur=FILE")
    if options.out is None:
        raise UsageError("--out is missing", remedy="name the plan folder to write")
    surfaces = _by_bone("--surface", options.surface, "FILE", "femur=femur.ply")
    cartilages = _by_bone(
        "--cartilage", options.cartilage, "FILE.ply or NAME=MEAN_MM:SD_MM", "femur=2.0:0.6"
    )
    for name in cartilages:
        if name not in surfaces:
            raise UsageError(
                f"--cartilage names the {name}, which has no surface",
                remedy=f"add --surface {name}=FILE",
            )
    bones = {}
    warnings: list[str] = []
    for name, path in surfaces.items():
        imported = import_surface(name, path, options.side)
        warnings += imported.warnings
        if name in cartilages:
            imported = _covered(imported.bone, cartilages[name])
            warnings += imported.warnings
        bones[name] = imported.bone
    bones, about_side = with_side(bones, options.side)
    plan = Plan(bones, name=str(options.out).rstrip("/").rsplit("/", 1)[-1])
    plan, about_content = completed(plan, options)
    write_plan(options.out, plan)
    return plan, [*warnings, *about_side, *about_content]


def _by_bone(option: str, entries: list[str], value: str, example: str) -> dict[str, str]:
    """Values of an option that is given once a bone, in the order given."""
    found: dict[str, str] = {}
    for entry in entries:
        name, equals, text = entry.partition("=")
        if not equals or not name or not text:
            raise UsageError(f"{option} {entry} is not NAME={value}", remedy=example)
        if name not in _BONES:
            raise UsageError(
                f"{option}: '{name}' is no bone of the knee that is followed",
                remedy="use femur, tibia or patella",
            )
        if name in found:
            raise UsageError(
                f"{option}: the {name} is given twice", remedy=f"give one {option} a bone"
            )
        found[name] = text
    return found


def _covered(bone: "BoneModel", text: str) -> "ImportedSurface":
    """The bone with the cartilage of a file, or of MEAN_MM:SD_MM."""
    from navapp.preop import ImportedSurface, even_cartilage, import_cartilage
    from navapp.preop.cartilage import LARGEST_MM

    if text.lower().endswith(".ply") or Path(text).is_file():
        return import_cartilage(bone, text)
    try:
        mean_mm, sd_mm = (float(word) for word in text.split(":"))
    except ValueError as error:
        raise UsageError(
            f"--cartilage {bone.name}={text} is neither a PLY file nor MEAN_MM:SD_MM",
            remedy=f"{bone.name}=cartilage.ply or {bone.name}=2.0:0.6",
        ) from error
    for what, value_mm in (("mean", mean_mm), ("standard deviation", sd_mm)):
        if not 0.0 <= value_mm <= LARGEST_MM:
            raise UsageError(
                f"--cartilage {bone.name}={text}: a {what} of {value_mm:g} mm is not possible",
                remedy=f"give 0 to {LARGEST_MM:g} mm",
            )
    return ImportedSurface(even_cartilage(bone, mean_mm, sd_mm), ())


def _content(plan: "Plan", warnings: list[str]) -> dict[str, Any]:
    return {
        "bones": {
            name: {
                "vertices": len(bone.mesh.vertices_mm),
                "faces": len(bone.mesh.faces),
                "volume_mm3": bone.mesh.volume_mm3(),
                "side": bone.side,
                "cartilage_mm": _cartilage(bone),
            }
            for name, bone in plan.bones.items()
        },
        "content": content_of(plan),
        "ct": None,
        "warnings": warnings,
        "hash": plan.digest,
    }


def _cartilage(bone: "BoneModel") -> dict[str, float] | None:
    from navapp.preop import figures_of

    found = figures_of(bone)
    if found is None:
        return None
    return {"mean": found.mean_mm, "max": found.max_mm, "sd": found.sd_mm}


def _summary(plan: "Plan") -> str:
    from navapp.preop import figures_of

    lines = [f"plan {plan.name} ({plan.digest})"]
    for name, bone in plan.bones.items():
        size = " x ".join(f"{extent:.0f}" for extent in bone.mesh.size_mm)
        volume_cm3 = bone.mesh.volume_mm3() / 1000.0
        lines.append(
            f"  {name}: {len(bone.mesh.vertices_mm)} vertices, {size} mm, "
            f"{volume_cm3:.0f} cm3, side {bone.side or 'unknown'}"
        )
        found = figures_of(bone)
        if found is not None:
            lines.append(
                f"    cartilage: mean {found.mean_mm:.1f} mm, at most {found.max_mm:.1f} mm, "
                f"sd {found.sd_mm:.1f} mm, on {100.0 * found.share:.0f} % of the vertices"
            )
    lines += lines_of(plan)
    return "\n".join(lines)
