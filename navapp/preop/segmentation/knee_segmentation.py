"""Segments a CT of the knee: solids, plates, cores, names, growth."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from navapp.errors import PlanError
from navapp.geometry.transform import FloatArray
from navapp.preop.segmentation.bone_naming import BONES, NamedParts, parts_of
from navapp.preop.segmentation.cores import find_cores
from navapp.preop.segmentation.growth import grow
from navapp.preop.segmentation.masks import LabelArray, compute_depth_mm, find_bounds
from navapp.preop.segmentation.plates import Plates, find_plates
from navapp.preop.segmentation.seeds import with_seeds
from navapp.preop.segmentation.solids import find_solids
from navapp.preop.volume import CtVolume
from navapp.preop.volume.hounsfield import PADDING_HU

DEFAULT_THRESHOLD_HU = 200.0
NO_SEEDS: Mapping[str, FloatArray] = MappingProxyType({})
# Around the bones: what the curvature of plates and the profiles need to see.
_MARGIN_MM = 8.0
# Padding this near is where a bone was cut; single dark voxels are noise, or beside metal.
_BESIDE_VOXELS, _LEAST_PADDING = 1.5, 20


@dataclass(frozen=True, slots=True, eq=False)
class Segmentation:
    """Bones in a CT, cut to the box around them."""

    ct: CtVolume  # the box
    # (D, H, W) number of the bone that each voxel of the box is part of; 0 for none.
    bones: NDArray[np.uint8]
    names: Mapping[str, int]  # name -> number; parts without a name are bones as well (a fabella)
    warnings: tuple[str, ...] = ()  # what was not found, and what is not whole


def segment(
    ct: CtVolume,
    threshold_hu: float = DEFAULT_THRESHOLD_HU,
    seeds: Mapping[str, FloatArray] = NO_SEEDS,
    tell: Callable[[str], None] = lambda step: None,
) -> Segmentation:
    """Femur, tibia, patella and fibula, told apart however narrow the joint is.

    Args:
        ct: of one knee.
        threshold_hu: what is denser may be bone. The surface does not depend on it.
        seeds: name -> (3,) LPS point in that bone; what has no seed is named by its place.
        tell: is told of each step.

    Raises:
        PlanError: there is no bone, no knee, more than one, or a seed that lies in no bone.
    """
    tell("finding bone in flesh")
    ct, hu, solid = _around_solids(ct, threshold_hu)
    tell("finding plates of cortex")
    plates = find_plates(hu, ct.spacing_mm, solid)
    tell("telling bones apart")
    cores, named = _find_named_cores(plates, solid, ct, seeds)
    tell("growing bones up to the joint")
    bones = grow(cores, hu, plates, solid, ct.spacing_mm, threshold_hu)
    missing = [name for name in BONES if name not in named.bones]
    warnings = [f"{name}: not found in the CT" for name in missing]
    warnings += [
        f"{name}: cut off at the side of the picture: what lies beyond is missing in its surface"
        for name, number in named.bones.items()
        if _is_cut_at_side(bones == number, ct)
    ]
    warnings += [
        f"{name}: cut off by padding in the picture: what lies beyond is missing in its surface"
        for name, number in named.bones.items()
        if _is_cut_by_padding(bones == number, ct)
    ]
    return Segmentation(ct, bones, named.bones, tuple(warnings))


def _is_cut_at_side(bone: NDArray[np.bool_], ct: CtVolume) -> bool:
    """Whether a bone reaches an end of the volume other than its top and bottom.

    The first and last slice cut any shaft; which axis that is depends on how a file was written.
    """
    upright = 2 - int(np.abs(ct.lps_from_index[2, :3] / ct.spacing_mm).argmax())
    sides = (np.moveaxis(bone, axis, 0)[[0, -1]] for axis in range(3) if axis != upright)
    return any(bool(side.any()) for side in sides)


def _is_cut_by_padding(bone: NDArray[np.bool_], ct: CtVolume) -> bool:
    """Whether the picture ends beside a bone: skin and flesh lie between any bone and air."""
    box = find_bounds(bone, np.full(3, 2, dtype=np.intp))
    is_padding = ct.hu[box] <= PADDING_HU
    if not is_padding.any():
        return False
    beside = compute_depth_mm(bone[box], ct.spacing_mm) > -_BESIDE_VOXELS * float(
        ct.spacing_mm.max()
    )
    return int((beside & is_padding).sum()) > _LEAST_PADDING


def _around_solids(
    ct: CtVolume, threshold_hu: float
) -> tuple[CtVolume, NDArray[np.float32], NDArray[np.bool_]]:
    hu = ct.hu.astype(np.float32)
    solid = find_solids(hu, ct.spacing_mm, threshold_hu)
    if not solid.any():
        raise PlanError(
            f"there is no bone in the CT: nothing in flesh is denser than {threshold_hu:g} HU",
            remedy="lower --threshold, or give another series",
        )
    box = find_bounds(solid, np.ceil(_MARGIN_MM / ct.spacing_mm[::-1]).astype(np.intp))
    cut = ct.crop([edge.start for edge in box[::-1]], [edge.stop for edge in box[::-1]])
    return cut, np.ascontiguousarray(hu[box]), np.ascontiguousarray(solid[box])


def _find_named_cores(
    plates: Plates, solid: NDArray[np.bool_], ct: CtVolume, seeds: Mapping[str, FloatArray]
) -> tuple[LabelArray, NamedParts]:
    """The coarsest cores among which all three bones of the joint are found, else the best."""
    best: tuple[LabelArray, NamedParts] | None = None
    for cores in find_cores(plates, solid, ct.spacing_mm):
        named = with_seeds(parts_of(cores, ct.lps_from_index), cores, ct, seeds)
        if best is None or len(named.bones) > len(best[1].bones):
            best = cores, named
        if named.is_whole and set(seeds) <= set(named.bones):
            break
    cores, named = best if best is not None else (np.zeros(solid.shape, np.int32), NamedParts({}))
    for name in seeds:
        if name not in named.bones:
            raise PlanError(
                f"--seed {name}: there is no bone of its own at this point",
                remedy="give a point inside the bone, LPS mm, or another --threshold",
            )
    if not named.bones:
        raise PlanError(
            f"there is no knee in the CT: no two of its {int(cores.max())} bones stand one on the "
            "other like femur and tibia",
            remedy="name a point in each with --seed femur=X,Y,Z, or give another series",
        )
    if named.has_two_knees and not seeds:
        raise PlanError(
            "there are two knees in the CT",
            remedy="choose one with --region X0,X1,Y0,Y1,Z0,Z1 (LPS mm), or with --seed",
        )
    return cores, named
