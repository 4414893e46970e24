"""Checks of a CT's size and values: refusals and warnings."""

import numpy as np

from navapp.preop.volume.ct_volume import CtVolume
from navapp.preop.volume.hounsfield import PADDING_HU

# Half-way from air (-1000 HU) to fat (-100 HU); and a leg fills far more of any picture than this.
_TISSUE_HU, _LEAST_TISSUE = -550, 1e-3
# All soft tissue, fat included, lies above this: no value below it, and no air was recorded.
_AIR_AROUND_HU = -200
# The top of the 12-bit scale; dense cortex stays below 2500 HU, only metal reaches it.
_CEILING_HU = 3071
# A distal femur is 60 to 100 mm wide, and a knee's plan needs the tibia's end beside it.
_KNEE_MM = 80.0
# Assumed limits, both stated with the warning: what lies between two slices was not seen, so the
# surface there is only as good as its interpolation.
_COARSE_MM, _ANISOTROPIC = 1.5, 3.0
# No CT is finer or coarser: a length in another unit.
_FINEST_MM, _COARSEST_MM = 0.02, 20.0


def refusal_of(volume: CtVolume) -> tuple[str, str] | None:
    """Problem and remedy when no plan can come from this volume; None when one may."""
    spacing = " x ".join(f"{step:.3g}" for step in volume.spacing_mm)
    if volume.spacing_mm.min() < _FINEST_MM or volume.spacing_mm.max() > _COARSEST_MM:
        return f"has voxels of {spacing} mm, which no CT has", "export it with lengths in mm"
    if float((volume.hu > _TISSUE_HU).mean()) < _LEAST_TISSUE:
        highest = float(volume.hu.max())
        what = "padding" if highest <= PADDING_HU else "air"
        return (
            f"shows {what} only: its highest value is {highest:.0f} HU",
            "choose the series that shows the knee",
        )
    return None


def make_content_warnings(volume: CtVolume) -> list[str]:
    """What a person must know who has to trust a plan from this volume."""
    return [*_resolution(volume), *_field(volume), *_values(volume)]


def _resolution(volume: CtVolume) -> list[str]:
    finest, coarsest = float(volume.spacing_mm.min()), float(volume.spacing_mm.max())
    if coarsest <= _COARSE_MM and coarsest <= _ANISOTROPIC * finest:
        return []
    spacing = " x ".join(f"{step:.3g}" for step in volume.spacing_mm)
    return [
        f"voxels are {spacing} mm: a plan wants at most {_COARSE_MM:g} mm, and none "
        f"{_ANISOTROPIC:g} times longer than wide"
    ]


def _field(volume: CtVolume) -> list[str]:
    extent = np.array(volume.size) * volume.spacing_mm
    if extent.min() >= _KNEE_MM:
        return []
    size = " x ".join(f"{length:.0f}" for length in extent)
    return [f"the field of view is {size} mm, too small for a whole knee ({_KNEE_MM:g} mm)"]


def _values(volume: CtVolume) -> list[str]:
    warnings = []
    voxel_cm3 = abs(float(np.linalg.det(volume.lps_from_index[:3, :3]))) / 1000.0
    n_ceiling = int((volume.hu >= _CEILING_HU).sum())
    if n_ceiling:
        warnings.append(
            f"metal: {n_ceiling * voxel_cm3:.2g} cm3 reach {_CEILING_HU} HU or more; bone near it "
            "is distorted by streaks"
        )
    if float(volume.hu.min()) > _AIR_AROUND_HU:
        warnings.append("no air in the volume: its values may not be Hounsfield units")
    return warnings
