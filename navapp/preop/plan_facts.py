"""Facts of a plan in words: where it comes from, and its bones."""

import numpy as np

from navapp.preop.cartilage import figures_of
from navapp.preop.plan_origin import PlanOrigin
from navapp.preop.plan_view import PlanView
from navapp.values import BoneModel


def make_origin_rows(view: PlanView) -> list[tuple[str, str]]:
    """Names and values."""
    plan, origin = view.plan, view.origin
    rows = [("digest", plan.digest), ("made from", origin.kind)]
    if origin.description:
        rows.append(("series", origin.description))
    if origin.spacing_mm:
        spacing = " x ".join(f"{step:.3g}" for step in origin.spacing_mm)
        rows.append(("voxels", f"{' x '.join(map(str, origin.size))} of {spacing} mm"))
    if origin.threshold_hu is not None:
        rows.append(("looked at as bone", f"above {origin.threshold_hu:g} HU"))
    if origin.cortex_hu is not None:
        rows.append(("density of cortex", f"{origin.cortex_hu:.0f} HU, found in this CT"))
    if origin.blur_mm:
        plane, axial = origin.blur_mm
        rows.append(
            ("blur of the scanner", f"{plane:.2f} mm in the slices, {axial:.2f} mm across (sd)")
        )
    if view.points_beyond:
        rows.append(("beyond the slices", ", ".join(view.points_beyond)))
    return rows


def make_bone_rows(bone: BoneModel, origin: PlanOrigin) -> list[tuple[str, str]]:
    """Names and values, the same names for every bone."""
    share = origin.measured.get(bone.name)
    return [
        ("side", bone.side or "unknown"),
        ("volume", f"{bone.mesh.volume_mm3() / 1000.0:.1f} cm3"),
        ("size", " x ".join(f"{extent:.0f}" for extent in bone.mesh.size_mm) + " mm"),
        ("vertices", str(len(bone.mesh.vertices_mm))),
        ("cartilage", _tell_cartilage(bone)),
        ("edge measured", "-" if share is None else f"{100.0 * share:.0f} %"),
        (
            "moves a pose (sd)",
            f"{bone.surface_sd_mm:.2f} mm" if bone.surface_sd_mm else "unknown",
        ),
        ("cut end", "yes" if np.any(bone.is_removed) else "no"),
    ]


def _tell_cartilage(bone: BoneModel) -> str:
    found = figures_of(bone)
    if found is None:
        return "none known"
    return (
        f"mean {found.mean_mm:.1f}, max {found.max_mm:.1f}, sd {found.sd_mm:.1f} mm, "
        f"on {100.0 * found.share:.0f} %"
    )
