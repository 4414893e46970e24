"""`navapp plan`: make a pre-operative plan, or show one."""

import argparse
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from navapp.cli.diagnostics import Diagnostics, check_writable, write_json
from navapp.cli.plan_content_options import add_arguments, complete_plan, content_of, lines_of
from navapp.cli.plan_draft import aspects_of, make_draft, with_cartilage
from navapp.errors import UsageError

if TYPE_CHECKING:
    from navapp.preop import PlanOrigin
    from navapp.values import BoneModel, Plan

_EXAMPLE = """\
examples:
  navapp plan --ct CT_FOLDER --out plans/knee
  navapp plan --ct ct.nii.gz --seed femur=-70,-10,30 --out plans/knee
  navapp plan --ct ct.nii.gz --region=-130,-20,-70,60,-60,60 --out plans/knee
  navapp plan --labels labels.nrrd --label femur=5 --label tibia=6 --side right --out plans/knee
  navapp plan --surface femur=femur.ply --surface tibia=tibia.ply --side right --out plans/knee
  navapp plan --surface femur=femur.ply --cartilage femur=2.0:0.6 --out plans/knee
  navapp plan --surface femur=femur.ply --contents contents.toml --out plans/knee
  navapp plan --surface femur=femur.ply --markups "drill femur 8mm.mrk.json" --out plans/knee
  navapp plan --built-in --contents docs/contents.toml --out plans/built_in
  navapp plan show plans/knee
points are LPS in mm; look at summary.html in the plan's folder before it is used
"""

_CARTILAGE_HELP = """\
what the camera sees above a bone: the outer surface of its cartilage (PLY, same coordinates; 0
where it lies on the bone or further than 6 mm from it), or one mean thickness and its standard
deviation for the whole bone but its flat or open ends, each 0 to 10 mm. A surface's thickness is
taken to be good to 0.4 mm: an assumption, about one voxel of the pictures it is segmented in"""


def add_parser(subparsers: Any) -> None:
    """Declare the verb."""
    parser = subparsers.add_parser(
        "plan",
        help="make a pre-operative plan from a CT, a segmentation or surfaces, or show one",
        epilog=_EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("what", nargs="?", choices=("show",), help="show: print a plan's summary")
    parser.add_argument("folder", nargs="?", metavar="P", help="plan folder to show")
    _add_sources(parser)
    parser.add_argument(
        "--cartilage",
        action="append",
        default=[],
        metavar="NAME=FILE.ply|MEAN_MM:SD_MM",
        help=_CARTILAGE_HELP,
    )
    add_arguments(parser)
    parser.add_argument("--side", choices=("left", "right"), help="of the knee")
    parser.add_argument(
        "--side-anyway",
        action="store_true",
        help="write --side, although the bones are certainly of the other one",
    )
    parser.add_argument("--out", metavar="P", help="plan folder to write")
    parser.add_argument("--replace", action="store_true", help="replace the plan that is there")
    parser.add_argument("--json", metavar="FILE", help="result for programs (- is stdout)")


def _add_sources(parser: argparse.ArgumentParser) -> None:
    source = parser.add_argument_group("what the plan is made from (one of these)")
    source.add_argument(
        "--ct", metavar="PATH", help="CT of one knee: a DICOM folder, or NIfTI, NRRD, MHA"
    )
    source.add_argument(
        "--labels", metavar="FILE", help="ready segmentation (NIfTI, NRRD, MHA), with --label"
    )
    source.add_argument(
        "--surface",
        action="append",
        default=[],
        metavar="NAME=FILE",
        help="a bone's surface (PLY, LPS, mm); may be given for several bones",
    )
    source.add_argument(
        "--built-in", action="store_true", help="the knee of the simulated rig, its surfaces alone"
    )
    ct = parser.add_argument_group("with --ct")
    ct.add_argument("--series", metavar="UID", help="which of several series in the folder")
    ct.add_argument(
        "--threshold",
        type=float,
        metavar="HU",
        help="what is denser may be bone (200); the surface does not depend on it",
    )
    ct.add_argument(
        "--seed", action="append", default=[], metavar="NAME=X,Y,Z", help="a point in that bone"
    )
    ct.add_argument("--region", metavar="X0,X1,Y0,Y1,Z0,Z1", help="box to look at")
    labels = parser.add_argument_group("with --labels")
    labels.add_argument(
        "--label", action="append", default=[], metavar="NAME=VALUE", help="value of a bone"
    )


def run(options: argparse.Namespace, diagnostics: Diagnostics) -> int:
    """Do it."""
    from navapp.preop import read_origin, read_plan

    check_writable(options.json)
    if options.what == "show":
        given = (
            options.surface, options.cartilage, options.ct, options.labels, options.out,
            options.contents, options.markups, options.side, options.series, options.threshold,
            options.seed, options.region, options.label, options.built_in or None,
        )  # fmt: skip
        if options.folder is None or any(one not in (None, []) for one in given):
            raise UsageError("show takes a plan folder only", remedy="navapp plan show P")
        plan, origin = read_plan(options.folder), read_origin(options.folder)
    else:
        plan, origin = _make_plan(options, diagnostics)
        for warning in origin.warnings:
            diagnostics.warn(warning)
    write_json(options.json, "plan", _content(plan, origin))
    if options.json != "-":
        diagnostics.say(_summary(plan, origin))
    return 0


def _make_plan(options: argparse.Namespace, diagnostics: Diagnostics) -> "tuple[Plan, PlanOrigin]":
    """The plan, written."""
    from navapp.preop import check_place, with_side, write_plan
    from navapp.values import Plan

    sources = [
        options.ct is not None,
        options.labels is not None,
        bool(options.surface),
        options.built_in,
    ]
    if sum(sources) != 1:
        raise UsageError(
            "nothing to plan from" if not any(sources) else "more than one thing to plan from",
            remedy="give one of --ct PATH, --labels FILE, --surface NAME=FILE, --built-in",
        )
    if options.out is None:
        raise UsageError("--out is missing", remedy="name the plan folder to write")
    check_place(options.out, may_replace=options.replace)
    draft = with_cartilage(make_draft(options, diagnostics), options.cartilage)
    bones, about_side = with_side(
        draft.bones, draft.side, draft.fibula, is_sure=options.side_anyway
    )
    name = str(options.out).rstrip("/").rsplit("/", 1)[-1]
    plan, about_content = complete_plan(Plan(bones, name=name), options)
    plan = replace(plan, aspects=aspects_of(bones, diagnostics))
    warnings = (*draft.origin.warnings, *about_side, *about_content)
    origin = replace(draft.origin, warnings=warnings)
    write_plan(options.out, plan, origin, draft.slices, draft.volume)
    return plan, origin


def _content(plan: "Plan", origin: "PlanOrigin") -> dict[str, Any]:
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
        "ct": origin.ct,
        "warnings": list(origin.warnings),
        "hash": plan.digest,
    }


def _cartilage(bone: "BoneModel") -> dict[str, float] | None:
    from navapp.preop import figures_of

    found = figures_of(bone)
    if found is None:
        return None
    return {"mean": found.mean_mm, "max": found.max_mm, "sd": found.sd_mm}


def _summary(plan: "Plan", origin: "PlanOrigin") -> str:
    from navapp.preop import figures_of

    lines = [f"plan {plan.name} ({plan.digest})"]
    if origin.spacing_mm:
        spacing = " x ".join(f"{step:.3g}" for step in origin.spacing_mm)
        lines.append(f"  from {origin.kind}, voxels of {spacing} mm")
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
