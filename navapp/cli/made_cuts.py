"""Cuts that were made before a recording: `--cut PLANE`."""

from collections.abc import Sequence
from dataclasses import replace

from navapp.errors import UsageError
from navapp.resection.remaining_bone import remove_cuts
from navapp.values import Plan


def cut_plan(plan: Plan, names: Sequence[str]) -> Plan:
    """A plan whose bones are cut at some of its planes.

    Raises:
        UsageError: the plan has no such plane.
    """
    known = plan.content.planes
    for name in names:
        if name not in known:
            remedy = f"choose of {', '.join(known)}" if known else "make the plan with --contents"
            raise UsageError(f"the plan has no plane '{name}'", subject=name, remedy=remedy)
    planes = [known[name] for name in dict.fromkeys(names)]
    bones = {
        name: remove_cuts(bone, [plane for plane in planes if plane.bone == name])
        for name, bone in plan.bones.items()
    }
    return replace(plan, bones=bones, digest="") if planes else plan
