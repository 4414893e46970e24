"""`navapp plan`: makes bone models from a CT, a segmentation or surface files."""

import argparse
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from navapp.cli.diagnostics import Diagnostics
from navapp.cli.plan_options import add_cartilage, parse_by_bone
from navapp.errors import UsageError

if TYPE_CHECKING:
    from navapp.geometry.transform import FloatArray
    from navapp.preop.plan_drafts import CtSettings, Draft
    from navapp.values import AspectGraph, BoneModel

_CT_ONLY = ("series", "threshold", "seed", "region")
_NO_CARTILAGE = (
    "no cartilage is known (--cartilage); a camera sees 1 to 3 mm of it where it is not worn, and "
    "takes its surface for the bone's"
)
# The steps of a segmentation that are told, for the share of the work that is done.
_N_STEPS = 21


def make_draft(options: argparse.Namespace, diagnostics: Diagnostics) -> "Draft":
    """Bones from what the options name."""
    if options.ct is None:
        for option in _CT_ONLY:
            if getattr(options, option) not in (None, []):
                raise UsageError(f"--{option} is for a CT", remedy="give --ct PATH as well")
    if options.labels is None and options.label:
        raise UsageError("--label is for a segmentation", remedy="give --labels FILE as well")
    if options.ct is not None:
        return _from_ct(options, diagnostics)
    if options.labels is not None:
        return _from_labels(options)
    return _from_built_in(options) if options.built_in else _from_surfaces(options)


def with_cartilage(draft: "Draft", entries: list[str]) -> "Draft":
    """The draft with cartilage on its bones."""
    texts = parse_by_bone("--cartilage", entries, "FILE.ply or NAME=MEAN_MM:SD_MM", "femur=2.0:0.6")
    bones, warnings = dict(draft.bones), list(draft.origin.warnings)
    for name, text in texts.items():
        if name not in bones:
            raise UsageError(
                f"--cartilage names the {name}, which has no surface",
                remedy=f"add --surface {name}=FILE",
            )
        imported = add_cartilage(bones[name], text)
        bones[name] = imported.bone
        warnings += imported.warnings
    bare = [name for name in bones if name not in texts]
    if bare and draft.origin.kind != "surfaces":
        warnings.append(f"{', '.join(bare)}: {_NO_CARTILAGE}")
    origin = replace(draft.origin, warnings=tuple(warnings))
    return replace(draft, bones=bones, origin=origin)


def aspects_of(
    bones: "Mapping[str, BoneModel]", diagnostics: Diagnostics
) -> "dict[str, AspectGraph]":
    """The edges of each bone from all around, for a first registration without a pose."""
    from navapp.preop import build_aspects

    return {
        name: build_aspects(
            bone, on_progress=lambda share, name=name: diagnostics.progress(  # type: ignore[misc]
                f"edges of the {name}", share
            )
        )
        for name, bone in bones.items()
    }  # fmt: skip


def _from_ct(options: argparse.Namespace, diagnostics: Diagnostics) -> "Draft":
    from navapp.preop.plan_drafts import make_draft_from_ct
    from navapp.preop.volume import read_ct

    settings = _settings(options)
    read = read_ct(options.ct, options.series)
    n_told = 0

    def tell(step: str) -> None:
        nonlocal n_told
        n_told += 1
        diagnostics.detail(step)
        diagnostics.progress(f"{step:<62}", min(n_told / _N_STEPS, 0.99))

    draft = make_draft_from_ct(read, settings, tell)
    diagnostics.progress(f"{'bones of the CT':<62}", 1.0)
    return draft


def _settings(options: argparse.Namespace) -> "CtSettings":
    from navapp.preop.plan_drafts import CtSettings
    from navapp.preop.segmentation import DEFAULT_THRESHOLD_HU

    threshold = DEFAULT_THRESHOLD_HU if options.threshold is None else options.threshold
    if not 50.0 <= threshold <= 1000.0:
        raise UsageError(
            f"--threshold {threshold:g} HU is no density of bone", remedy="give 50 to 1000"
        )
    region = None
    if options.region is not None:
        region = _numbers("--region", options.region, 6, "X0,X1,Y0,Y1,Z0,Z1")
        if (region[1::2] <= region[::2]).any():
            raise UsageError(
                f"--region {options.region} is empty", remedy="X0 < X1, Y0 < Y1 and Z0 < Z1"
            )
    return CtSettings(
        threshold,
        _seeds(options.seed),
        None if region is None else tuple(region.tolist()),
        options.side,
    )


def _seeds(entries: list[str]) -> "dict[str, FloatArray]":
    from navapp.preop.segmentation import BONES

    seeds = {}
    for entry in entries:
        name, _, text = entry.partition("=")
        if name not in BONES:
            raise UsageError(
                f"--seed {entry}: '{name}' is no bone of the knee",
                remedy="use femur, tibia, patella or fibula, like femur=-70,-10,30",
            )
        if name in seeds:
            raise UsageError(f"--seed: the {name} is given twice", remedy="give one a bone")
        seeds[name] = _numbers("--seed", text, 3, f"{name}=X,Y,Z")
    return seeds


def _numbers(option: str, text: str, n: int, form: str) -> "FloatArray":
    try:
        values = np.array([float(word) for word in text.split(",")])
    except ValueError:
        values = np.empty(0)
    if values.shape != (n,) or not np.isfinite(values).all():
        raise UsageError(f"{option} {text} is not {form}", remedy=f"{n} numbers, LPS mm")
    return values


def _from_labels(options: argparse.Namespace) -> "Draft":
    from navapp.preop.plan_drafts import make_draft_from_labels
    from navapp.preop.volume import read_labels

    values = {}
    for name, text in parse_by_bone("--label", options.label, "VALUE", "femur=5").items():
        if not text.isdecimal() or int(text) == 0:
            raise UsageError(
                f"--label {name}={text} is not a value of a label", remedy="a whole number from 1"
            )
        values[name] = int(text)
    if not values:
        raise UsageError(
            "--labels needs to know which value is which bone", remedy="add --label femur=VALUE"
        )
    return make_draft_from_labels(read_labels(options.labels), values, options.side)


def _from_built_in(options: argparse.Namespace) -> "Draft":
    """The knee that `navapp run` simulates with the same configuration."""
    from navapp.config import find_file, load
    from navapp.devices.simulated_room import make_simulated_bones
    from navapp.preop import PlanOrigin
    from navapp.preop.plan_drafts import Draft
    from navapp.values import BoneModel

    simulated = load(find_file(options.config)).camera.simulated
    if options.side not in (None, simulated.side):
        raise UsageError(
            f"the built-in knee is a {simulated.side} one",
            remedy="leave --side out, or set [camera.simulated] side",
        )
    meshes = make_simulated_bones(simulated)
    bones = {name: BoneModel(name, mesh, simulated.side) for name, mesh in meshes.items()}
    return Draft(bones, PlanOrigin(), side=simulated.side)


def _from_surfaces(options: argparse.Namespace) -> "Draft":
    from navapp.preop import PlanOrigin, import_surface
    from navapp.preop.plan_drafts import Draft

    bones = {}
    warnings: list[str] = []
    for name, path in parse_by_bone(
        "--surface", options.surface, "FILE", "femur=femur.ply"
    ).items():
        imported = import_surface(name, path, options.side)
        warnings += imported.warnings
        bones[name] = imported.bone
    return Draft(bones, PlanOrigin(warnings=tuple(warnings)), side=options.side)
