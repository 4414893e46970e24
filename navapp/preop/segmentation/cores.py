"""Finds cores: the inside of each bone, separate from all others."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.transform import FloatArray
from navapp.preop.segmentation.masks import (
    BoolArray,
    LabelArray,
    compute_depth_mm,
    label_components,
)
from navapp.preop.segmentation.plates import Plates

# How curved a valley must be to part two bones, HU per mm2: the first that tells bones apart
# serves. A plate of cortex (1,000 HU over soft tissue, 1 mm) has about 200 at its feet.
_VALLEYS = (150.0, 100.0, 70.0, 50.0, 35.0)
# A ridge is a plate; valleys count beside one only, because marrow ends without a gap as well.
_RIDGE, _BESIDE_MM = -150.0, 2.5
# What is left of a bone's inside is eroded by this, so that no thread connects two of them.
_THREAD_MM = 1.5
_LEAST_MM3 = 500.0
# The smallest of more are left out: voxels are numbered by bytes.
_MOST_CORES = 200


def find_cores(plates: Plates, solid: BoolArray, spacing_mm: FloatArray) -> Iterator[LabelArray]:
    """Insides of bones, 1 for the largest and so on; ever finer, until whoever asks has enough.

    Two bones one or two millimetres apart are one part at any threshold that keeps their spongy
    inside. But their plates of cortex have valleys at their feet, inside and in the gap: without
    these the insides hang together no more.
    """
    near_plate = compute_depth_mm(is_ridge(plates), spacing_mm) >= -_BESIDE_MM
    for valley in _VALLEYS:
        inside = solid & ~(near_plate & (plates.valley > valley))
        deep = compute_depth_mm(inside, spacing_mm) > _THREAD_MM
        cores = label_components(deep, spacing_mm, _LEAST_MM3)
        cores[cores > _MOST_CORES] = 0
        yield cores


def is_ridge(plates: Plates) -> NDArray[np.bool_]:
    """(D, H, W) where a plate of cortex is."""
    ridge: NDArray[np.bool_] = plates.ridge < _RIDGE
    return ridge
