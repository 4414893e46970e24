"""Grows each core to its bone, up to the cortex or the valley between two bones."""

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.transform import FloatArray
from navapp.preop.segmentation.cores import is_ridge
from navapp.preop.segmentation.masks import (
    BoolArray,
    LabelArray,
    close_gaps,
    compute_depth_mm,
    find_bounds,
    make_image,
    select_largest,
)
from navapp.preop.segmentation.plates import Plates
from navapp.preop.volume.itk_package import import_simple_itk, voxels_of

# What the core lost by erosion and the plate's inner foot: no core is further from its plate.
_TO_PLATE_MM = 4.5
# Pores and the foot of the plates are closed with this.
_CLOSING_MM = 1.5
_OUTSIDE = 255


def grow(
    cores: LabelArray,
    hu: NDArray[np.float32],
    plates: Plates,
    solid: BoolArray,
    spacing_mm: FloatArray,
    threshold_hu: float,
) -> NDArray[np.uint8]:
    """(D, H, W) whole bones, numbered as their cores.

    Each core grows up to the plates around it; they stop it, as they part it from the joint. From
    there the rest is flooded in the order of falling density, so that two bones meet at the bottom
    of the valley between them, wherever the threshold lies.

    Source: Meyer 1991, watershed by flooding from markers.
    """
    basins = _flood(-hu, _up_to_plates(cores, plates, solid, spacing_mm), solid, spacing_mm)
    bones = np.zeros(cores.shape, dtype=np.uint8)
    for bone in range(1, int(cores.max()) + 1):
        _put_bone(bones, bone, basins, (hu > threshold_hu) | (cores == bone), spacing_mm)
    return bones


def _up_to_plates(
    cores: LabelArray, plates: Plates, solid: BoolArray, spacing_mm: FloatArray
) -> NDArray[np.uint8]:
    """The cores with what lies between them and their plates, and the first voxels of these."""
    plate = solid & is_ridge(plates)
    away_mm = -compute_depth_mm(cores > 0, spacing_mm)
    free = solid & ~plate & (away_mm < _TO_PLATE_MM)
    grown = _flood(away_mm, cores.astype(np.uint8), free, spacing_mm)
    grown[grown == _OUTSIDE] = 0
    inner = grown.copy()
    for axis in range(3):
        for step in (-1, 1):
            beside = np.roll(inner, step, axis)
            # What has come in over the volume's end.
            np.moveaxis(beside, axis, 0)[0 if step > 0 else -1] = 0
            reached = plate & (grown == 0) & (beside > 0)
            grown[reached] = beside[reached]
    # Where a plate has a hole the core reaches what is behind: that is nearer to another one.
    grown[grown != _nearest_core(cores, spacing_mm)] = 0
    return grown


def _nearest_core(cores: LabelArray, spacing_mm: FloatArray) -> NDArray[np.uint8]:
    nearest = np.zeros(cores.shape, dtype=np.uint8)
    least_mm = np.full(cores.shape, np.inf, dtype=np.float32)
    for core in range(1, int(cores.max()) + 1):
        away_mm = -compute_depth_mm(cores == core, spacing_mm)
        nearest[away_mm < least_mm] = core
        np.minimum(least_mm, away_mm, out=least_mm)
    return nearest


def _flood(
    height: NDArray[np.float32], markers: NDArray[np.uint8], free: BoolArray, spacing_mm: FloatArray
) -> NDArray[np.uint8]:
    """Basins of the markers within what is free; `_OUTSIDE` elsewhere."""
    held = np.where(free | (markers > 0), markers, _OUTSIDE).astype(np.uint8)
    basins = import_simple_itk().MorphologicalWatershedFromMarkers(
        make_image(height, spacing_mm), make_image(held, spacing_mm), False, True
    )
    return voxels_of(basins).astype(np.uint8)


def _put_bone(
    bones: NDArray[np.uint8],
    bone: int,
    basins: NDArray[np.uint8],
    is_bony: BoolArray,
    spacing_mm: FloatArray,
) -> None:
    margin = np.ceil(2.0 * _CLOSING_MM / spacing_mm[::-1]).astype(np.intp)
    box = find_bounds(basins == bone, margin)
    mine = basins[box] == bone
    whole = close_gaps(mine & is_bony[box], spacing_mm, _CLOSING_MM)
    # Closing must not reach into a neighbour.
    whole &= mine | (basins[box] == _OUTSIDE)
    bones[box][select_largest(whole, spacing_mm)] = bone
