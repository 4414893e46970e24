"""Masks of voxels: distances, components, closing; SimpleITK underneath, which uses every core.

Masks are (D, H, W) bool arrays with axes k, j, i; spacings are (3,) mm of i, j, k. Distances are
those of a lattice at right angles: in a stack that leans they are off by what it leans.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.transform import FloatArray
from navapp.preop.volume.itk_package import import_simple_itk, voxels_of

BoolArray = NDArray[np.bool_]
LabelArray = NDArray[np.int32]


def make_image(voxels: NDArray[Any], spacing_mm: FloatArray) -> Any:
    """The voxels as a SimpleITK image; a mask as bytes."""
    values = voxels.astype(np.uint8) if voxels.dtype == np.bool_ else voxels
    image = import_simple_itk().GetImageFromArray(values)
    image.SetSpacing([float(step) for step in spacing_mm])
    return image


def compute_depth_mm(mask: BoolArray, spacing_mm: FloatArray) -> NDArray[np.float32]:
    """How far each voxel lies inside a mask: positive inside, negative outside, 0 at its rim."""
    image = import_simple_itk().SignedMaurerDistanceMap(
        make_image(mask, spacing_mm), True, False, True
    )
    depth: NDArray[np.float32] = voxels_of(image)
    return depth


def label_components(mask: BoolArray, spacing_mm: FloatArray, least_mm3: float) -> LabelArray:
    """Connected parts (by faces) of at least a volume, 1 for the largest and so on, 0 for none."""
    itk = import_simple_itk()
    least = max(1, int(np.ceil(least_mm3 / float(np.prod(spacing_mm)))))
    parts = itk.ConnectedComponent(make_image(mask, spacing_mm), False)
    sorted_parts = itk.RelabelComponent(parts, minimumObjectSize=least)
    return voxels_of(sorted_parts).astype(np.int32)


def select_largest(mask: BoolArray, spacing_mm: FloatArray) -> BoolArray:
    """The largest connected part."""
    part: BoolArray = label_components(mask, spacing_mm, 0.0) == 1
    return part


def close_gaps(mask: BoolArray, spacing_mm: FloatArray, radius_mm: float) -> BoolArray:
    """The mask with gaps closed that are narrower than twice a radius, and its holes filled.

    Where the mask ends at the volume's end, as a cut shaft does, what it encloses there in that
    plane is a hole as well.
    """
    margin = np.ceil(radius_mm / spacing_mm).astype(int) + 2
    room = [(int(n), int(n)) for n in margin[::-1]]
    grown = compute_depth_mm(np.pad(mask, room), spacing_mm) >= -radius_mm
    shut = compute_depth_mm(grown, spacing_mm) > radius_mm
    shut |= np.pad(mask, room)
    inner = shut[tuple(slice(n, -n) for n, _ in room)]
    for axis in range(3):
        for end in (0, -1):
            plane = np.moveaxis(inner, axis, 0)[end]
            plane[:] = _without_holes(plane)
    return _without_holes(inner)


def _without_holes(mask: BoolArray) -> BoolArray:
    """A mask of two or three axes; a hole is what cannot be left but through the mask."""
    room = np.pad(mask, 1)
    filled = import_simple_itk().BinaryFillhole(
        import_simple_itk().GetImageFromArray(room.astype(np.uint8))
    )
    result: BoolArray = voxels_of(filled).astype(bool)[(slice(1, -1),) * mask.ndim]
    return result


def find_bounds(mask: BoolArray, margin: NDArray[np.intp]) -> tuple[slice, slice, slice]:
    """The box (k, j, i) of what is set, widened by margins in voxels (k, j, i)."""
    slices = []
    for axis in range(3):
        others = tuple(other for other in range(3) if other != axis)
        set_at = np.flatnonzero(mask.any(axis=others))
        first, last = int(set_at[0]), int(set_at[-1])
        slices.append(
            slice(
                max(first - int(margin[axis]), 0),
                min(last + int(margin[axis]) + 1, mask.shape[axis]),
            )
        )
    return slices[0], slices[1], slices[2]
