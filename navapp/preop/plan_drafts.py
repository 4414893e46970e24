"""Makes bone models with their origin and pictures, from a CT or a segmentation."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from navapp.errors import PlanError, UsageError
from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.transform import FloatArray
from navapp.preop.ct_surface import BoneSurface, make_label_surface, make_surfaces
from navapp.preop.plan_origin import PlanOrigin
from navapp.preop.segmentation import DEFAULT_THRESHOLD_HU, NO_SEEDS, segment
from navapp.preop.slice_drawing import draw_slices
from navapp.preop.slice_volume import SliceVolume, make_slice_volume
from navapp.preop.slices import Picture
from navapp.preop.volume import CtVolume, LabelVolume, ReadCt
from navapp.values import FOLLOWED_BONES, BoneModel, Side

_LEAST_LABEL_MM3 = 1000.0


@dataclass(frozen=True, slots=True, eq=False)
class CtSettings:
    """Settings of a plan from a CT that an operator may override."""

    # what is denser may be bone; the surface does not depend on it.
    threshold_hu: float = DEFAULT_THRESHOLD_HU
    # name -> (3,) LPS point in that bone.
    seeds: Mapping[str, FloatArray] = field(default_factory=lambda: NO_SEEDS)
    # (x0, x1, y0, y1, z0, z1) LPS box to look at; None for all.
    region_mm: tuple[float, float, float, float, float, float] | None = None
    side: Side | None = None  # of the knee; None to be estimated


@dataclass(frozen=True, slots=True, eq=False)
class Draft:
    """Bone models before they become a plan."""

    bones: Mapping[str, BoneModel]  # name -> model, those that are followed
    origin: PlanOrigin  # facts for people
    # which is not followed and tells the side; None where it is not known.
    fibula: TriangleMesh | None = None
    side: Side | None = None  # as the user or the CT's laterality tag says; None to be estimated
    # bone -> (h, w, 3) BGR, three slices of the volume with the surface's contour.
    slices: Mapping[str, Picture] = field(default_factory=dict)
    volume: SliceVolume | None = None  # to scroll through; None without one


def make_draft_from_ct(
    read: ReadCt, settings: CtSettings | None = None, tell: Callable[[str], None] = lambda _: None
) -> Draft:
    """Bones of a CT of one knee, no seeds needed.

    Raises:
        PlanError: there is no bone, no knee, more than one, or a region without any.
    """
    settings = settings or CtSettings()
    ct = read.volume if settings.region_mm is None else _within(read.volume, settings.region_mm)
    found = segment(ct, settings.threshold_hu, settings.seeds, tell)
    surfaces = make_surfaces(found, tell)
    tell("drawing")
    scan = surfaces.scan
    origin = PlanOrigin(
        "CT",
        read.source.description,
        tuple(float(step) for step in read.volume.spacing_mm),
        read.volume.size,
        settings.threshold_hu,
        scan.cortex_hu,
        (scan.blur_in_plane_mm, scan.blur_axial_mm),
        {name: float(bone.is_measured.mean()) for name, bone in surfaces.bones.items()},
        (*read.warnings, *found.warnings),
    )
    side = settings.side or read.source.side
    slices = {name: draw_slices(found.ct, surface.mesh) for name, surface in surfaces.bones.items()}
    draft = _draft(surfaces.bones, side, origin, slices, surfaces.pose_sd_mm)
    return _with_volume(draft, read.volume)


def make_draft_from_labels(
    volume: LabelVolume, values: Mapping[str, int], side: Side | None = None
) -> Draft:
    """Bones of a ready segmentation, taken as it is.

    Raises:
        UsageError: a value that the segmentation does not hold.
        PlanError: a label too small for a bone.
    """
    surfaces, slices = {}, {}
    warnings: list[str] = []
    # Not the product of the spacings: axes may lean.
    voxel_mm3 = abs(float(np.linalg.det(volume.lps_from_index[:3, :3])))
    for name, value in values.items():
        mask = volume.labels == value
        if not mask.any():
            there = ", ".join(str(v) for v in np.unique(volume.labels)[:20] if v)
            raise UsageError(
                f"--label {name}={value}: the segmentation holds no such value",
                remedy=f"it holds {there}",
            )
        if mask.sum() * voxel_mm3 < _LEAST_LABEL_MM3:
            raise PlanError(
                f"label {value} for the {name} fills less than a cubic centimetre",
                remedy="give the value of the whole bone",
            )
        surfaces[name] = make_label_surface(mask, volume)
        if surfaces[name].left_out > 0.0:
            warnings.append(
                f"{name}: its label is in separate pieces; the largest is taken, without "
                f"{100.0 * surfaces[name].left_out:.2g} % of the volume"
            )
        slices[name] = draw_slices(volume, surfaces[name].mesh)
    origin = PlanOrigin(
        "labels",
        spacing_mm=tuple(float(step) for step in volume.spacing_mm),
        size=volume.size,
        warnings=tuple(warnings),
    )
    return _with_volume(_draft(surfaces, side, origin, slices), volume)


def _with_volume(draft: Draft, volume: CtVolume | LabelVolume) -> Draft:
    meshes = [bone.mesh for bone in draft.bones.values()]
    return replace(draft, volume=make_slice_volume(volume, meshes)) if meshes else draft


def _draft(
    surfaces: Mapping[str, BoneSurface],
    side: Side | None,
    origin: PlanOrigin,
    slices: Mapping[str, Picture],
    surface_sd_mm: float = 0.0,
) -> Draft:
    bones = {
        name: BoneModel(
            name,
            surfaces[name].mesh,
            side,
            is_removed=surfaces[name].is_cut,
            surface_sd_mm=surface_sd_mm,
        )
        for name in FOLLOWED_BONES
        if name in surfaces
    }
    fibula = surfaces["fibula"].mesh if "fibula" in surfaces else None
    return Draft(bones, origin, fibula, side, slices)


def _within(ct: CtVolume, region_mm: tuple[float, ...]) -> CtVolume:
    """The smallest box of voxels that holds an LPS region."""
    x0, x1, y0, y1, z0, z1 = region_mm
    corners = np.array([[x, y, z] for x in (x0, x1) for y in (y0, y1) for z in (z0, z1)])
    indices = ct.indices_of(corners)
    lower = np.clip(np.floor(indices.min(axis=0)).astype(int), 0, ct.size)
    upper = np.clip(np.ceil(indices.max(axis=0)).astype(int) + 1, 0, ct.size)
    if (upper - lower < 2).any():
        middle = ct.points_lps_mm(np.array([ct.size]) / 2.0)[0]
        raise UsageError(
            "--region lies outside the CT",
            remedy="its middle is at " + ", ".join(f"{value:.0f}" for value in middle) + " (LPS)",
        )
    return ct.crop(lower, upper)
