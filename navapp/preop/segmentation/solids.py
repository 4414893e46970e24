"""Finds solids: bone with its marrow, all that the soft tissue around does not reach."""

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.transform import FloatArray
from navapp.preop.segmentation.masks import (
    BoolArray,
    compute_depth_mm,
    find_bounds,
    label_components,
    make_image,
)
from navapp.preop.volume.hounsfield import PADDING_HU
from navapp.preop.volume.itk_package import import_simple_itk

# A channel narrower than twice this leads no tissue into a bone: pores, vessels, thin cortex.
_PORE_MM = 1.0
# Less dense than any fat or marrow: air, foam.
_AIR_HU = -400.0
# A part of a person lies in flesh; a table and its padding lie in air.
_SHELL_MM = (2.0, 6.0)
_MOST_AIR = 0.5
_LEAST_MM3 = 300.0


def find_solids(hu: NDArray[np.float32], spacing_mm: FloatArray, threshold_hu: float) -> BoolArray:
    """(D, H, W) bones with all that they enclose, and joint gaps too narrow to be reached.

    What lies below the threshold is outside when a ball of one millimetre gets there from the
    largest such part or from air; the marrow of a bone that the volume or its padding cuts is not,
    because the cortex around it is whole. Parts that lie in air (the table) and small debris are
    left out.

    Args:
        hu: (D, H, W).
        spacing_mm: (3,) of i, j, k.
        threshold_hu: what is denser may be bone (the paper's threshold segmentation).
    """
    padding = _padding(hu, spacing_mm)
    solid = ~_outside(hu, spacing_mm, (hu < threshold_hu) & ~padding) & ~padding
    parts = label_components(solid, spacing_mm, _LEAST_MM3)
    return _in_flesh(parts, hu, spacing_mm)


def _padding(hu: NDArray[np.float32], spacing_mm: FloatArray) -> BoolArray:
    """(D, H, W) where the picture ends before the volume does.

    Noise in air gets as low in single voxels; what holds no ball of a pore leads nothing anywhere.
    """
    is_lowest: BoolArray = hu <= PADDING_HU
    if not is_lowest.any():
        return is_lowest
    broad = compute_depth_mm(is_lowest, spacing_mm) > _PORE_MM
    if not broad.any():
        return broad
    around: BoolArray = compute_depth_mm(broad, spacing_mm) >= -(
        _PORE_MM + float(np.max(spacing_mm))
    )
    return around & is_lowest


def _outside(hu: NDArray[np.float32], spacing_mm: FloatArray, is_low: BoolArray) -> BoolArray:
    open_space = compute_depth_mm(is_low, spacing_mm) > _PORE_MM
    parts = label_components(open_space, spacing_mm, 0.0)
    statistics = import_simple_itk().LabelIntensityStatisticsImageFilter()
    statistics.Execute(make_image(parts, spacing_mm), make_image(hu, spacing_mm))
    reached = [
        part for part in statistics.GetLabels() if part == 1 or statistics.GetMedian(part) < _AIR_HU
    ]
    is_reached = np.isin(parts, reached)
    voxel_mm = 0.5 * float(np.max(spacing_mm))
    around: BoolArray = compute_depth_mm(is_reached, spacing_mm) >= -(_PORE_MM + voxel_mm)
    return around & is_low


def _in_flesh(
    parts: NDArray[np.int32], hu: NDArray[np.float32], spacing_mm: FloatArray
) -> BoolArray:
    """The parts around which there is more flesh than air."""
    kept = np.zeros(parts.shape, dtype=bool)
    margin = np.ceil(_SHELL_MM[1] / spacing_mm[::-1]).astype(np.intp)
    for part in range(1, int(parts.max()) + 1):
        box = find_bounds(parts == part, margin)
        inside = parts[box] == part
        outer_mm = -compute_depth_mm(inside, spacing_mm)
        shell = (outer_mm > _SHELL_MM[0]) & (outer_mm < _SHELL_MM[1]) & (parts[box] == 0)
        if not shell.any() or (hu[box][shell] < _AIR_HU).mean() <= _MOST_AIR:
            kept[box] |= inside
    return kept
