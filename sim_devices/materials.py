"""Table of materials: reflectance and gloss of the simulated surfaces."""

from dataclasses import dataclass, replace
from enum import IntEnum, unique

import numpy as np
from numpy.typing import NDArray

Colour = tuple[float, float, float]

# Area under a normal density beyond the threshold: 0 is nothing, 1 is everything.
_NO_BLOOD = 99.0


@unique
class MaterialId(IntEnum):
    """Rows of the table that the shading kernel reads."""

    BONE = 0
    CARTILAGE = 1
    SPONGY_BONE = 2
    TISSUE = 3
    DRAPE = 4
    STEEL = 5
    GLOVE = 6
    HANDLE = 7
    SAWN_BONE = 8
    METAL = 9
    PLASTIC = 10


@dataclass(frozen=True, slots=True)
class Material:
    """One surface; colours are linear BGR reflectances.

    The noise mixes `colour` with `second`; a vertex's mark (0 to 1) mixes in `marked`.
    """

    colour: Colour
    second: Colour
    marked: Colour
    # mix_at, mix_width: noise level (in deviations) where the second colour starts, and how soft.
    mix_at: float = 9.0
    mix_width: float = 1.0
    # contrast_fine, contrast_coarse: deviation of the texture relative to its mean.
    contrast_fine: float = 0.05
    contrast_coarse: float = 0.05
    pores: float = 0.0  # darkening in small pits
    bump: float = 0.0  # slope of the fine relief per deviation of the noise
    mark_noise: float = 0.0  # how much the noise frays the border of the mark
    # specular, shininess: strength and narrowness of the wet highlight.
    specular: float = 0.0
    shininess: float = 60.0
    marked_specular: float = 1.0  # the highlight's factor where the mark is 1
    blood_at: float = _NO_BLOOD  # noise level above which blood lies
    wrap: float = 0.15  # how far light creeps round an edge (0 hard, 0.5 soft)
    # mirror: share of the light of lamps and room that is reflected as by a mirror.
    mirror: float = 0.0
    roughness: float = 0.2  # of a mirror: over so much (rad) the edge of a mirrored lamp fades

    def row(self) -> list[float]:
        """In the order that the kernel reads."""
        return [
            *self.colour,
            *self.second,
            *self.marked,
            self.mix_at,
            1.0 / self.mix_width,
            self.contrast_fine,
            self.contrast_coarse,
            self.pores,
            self.bump,
            self.mark_noise,
            self.specular,
            self.shininess,
            self.marked_specular,
            self.blood_at,
            self.wrap,
            self.mirror,
            self.roughness,
        ]


_BONE = Material(
    colour=(0.52, 0.68, 0.76),
    second=(0.46, 0.61, 0.73),
    marked=(0.27, 0.38, 0.60),
    mix_at=0.4,
    mix_width=1.6,
    mark_noise=0.16,
    bump=0.05,
    specular=1.7,
    shininess=170.0,
    marked_specular=0.5,
)

_TABLE: dict[MaterialId, Material] = {
    MaterialId.BONE: _BONE,
    MaterialId.CARTILAGE: replace(
        _BONE,
        colour=(0.66, 0.76, 0.79),
        second=(0.60, 0.72, 0.78),
        marked=(0.42, 0.56, 0.70),
        specular=2.2,
        shininess=240.0,
    ),
    MaterialId.SPONGY_BONE: Material(
        colour=(0.16, 0.22, 0.46),
        second=(0.05, 0.05, 0.26),
        marked=(0.03, 0.03, 0.15),
        mix_at=-0.3,
        contrast_fine=0.25,
        contrast_coarse=0.1,
        pores=0.5,
        bump=0.25,
        specular=0.3,
    ),
    MaterialId.TISSUE: Material(
        colour=(0.05, 0.045, 0.24),
        second=(0.10, 0.33, 0.56),
        marked=(0.24, 0.34, 0.54),
        mix_at=0.25,
        mix_width=0.8,
        contrast_fine=0.12,
        contrast_coarse=0.10,
        bump=0.24,
        mark_noise=0.22,
        specular=1.7,
        shininess=45.0,
        marked_specular=0.06,
    ),
    MaterialId.DRAPE: Material(
        colour=(0.26, 0.19, 0.035),
        second=(0.21, 0.155, 0.03),
        marked=(0.05, 0.02, 0.13),
        mix_at=0.0,
        mix_width=2.0,
        contrast_fine=0.05,
        contrast_coarse=0.05,
        bump=0.04,
        specular=0.02,
        shininess=12.0,
        mark_noise=0.1,
        wrap=0.3,
    ),
    MaterialId.STEEL: Material(
        colour=(0.30, 0.29, 0.28),
        second=(0.24, 0.24, 0.23),
        marked=(0.04, 0.03, 0.16),
        contrast_fine=0.06,
        contrast_coarse=0.06,
        mix_at=0.5,
        bump=0.02,
        specular=3.5,
        shininess=45.0,
    ),
    MaterialId.GLOVE: Material(
        colour=(0.60, 0.66, 0.68),
        second=(0.54, 0.60, 0.63),
        marked=(0.10, 0.09, 0.38),
        mix_at=0.0,
        mix_width=2.0,
        contrast_fine=0.02,
        contrast_coarse=0.03,
        bump=0.05,
        specular=0.22,
        shininess=40.0,
        mark_noise=0.3,
        wrap=0.3,
    ),
    MaterialId.HANDLE: Material(
        colour=(0.05, 0.05, 0.05),
        second=(0.04, 0.04, 0.04),
        marked=(0.03, 0.02, 0.12),
        contrast_fine=0.08,
        specular=0.3,
        shininess=30.0,
    ),
    # A sawn face: spongy, and marked where the rim of hard bone is.
    MaterialId.SAWN_BONE: Material(
        colour=(0.30, 0.45, 0.62),
        second=(0.17, 0.24, 0.50),
        marked=(0.56, 0.70, 0.77),
        mix_at=0.3,
        mix_width=1.2,
        contrast_fine=0.16,
        contrast_coarse=0.08,
        pores=0.45,
        bump=0.12,
        mark_noise=0.25,
        specular=0.8,
        shininess=70.0,
    ),
    MaterialId.METAL: Material(
        colour=(0.10, 0.10, 0.10),
        second=(0.09, 0.09, 0.09),
        marked=(0.04, 0.03, 0.16),
        contrast_fine=0.03,
        contrast_coarse=0.03,
        mirror=0.6,
        roughness=0.1,
    ),
    MaterialId.PLASTIC: Material(
        colour=(0.70, 0.74, 0.75),
        second=(0.67, 0.71, 0.72),
        marked=(0.10, 0.09, 0.38),
        mix_width=2.0,
        contrast_fine=0.012,
        contrast_coarse=0.015,
        specular=0.6,
        shininess=90.0,
        wrap=0.35,
    ),
}

# What is as wet as the site is.
_WET = (
    MaterialId.BONE,
    MaterialId.CARTILAGE,
    MaterialId.SPONGY_BONE,
    MaterialId.TISSUE,
    MaterialId.SAWN_BONE,
)

# Which surfaces blood runs on, and how much more readily than on bone.
_BLOODY = {
    MaterialId.BONE: 0.30,
    MaterialId.CARTILAGE: 0.22,
    MaterialId.SPONGY_BONE: 0.5,
    MaterialId.TISSUE: 0.55,
    MaterialId.STEEL: 0.2,
    MaterialId.GLOVE: 0.4,
    MaterialId.SAWN_BONE: 0.4,
    MaterialId.METAL: 0.12,
    MaterialId.PLASTIC: 0.15,
}


def make_material_table(
    contrast: float, blood: float, highlights: float = 1.0
) -> NDArray[np.float32]:
    """(materials, columns) float32 for the shading kernel.

    Args:
        contrast: RMS over mean of the grey levels on bone in the finished picture.
        blood: 0 dry to 1 very bloody.
        highlights: area of the wet highlights of bone and tissue, times the usual one; 0: none.
    """
    from scipy.special import ndtri

    rows = []
    for name in MaterialId:
        material = _TABLE[name]
        if name in (MaterialId.BONE, MaterialId.CARTILAGE):
            # A camera's tone curve halves relative differences, its lens blurs the finest ones.
            material = replace(
                material,
                contrast_fine=1.72 * contrast,
                contrast_coarse=1.22 * contrast,
                pores=2.7 * contrast,
            )
        if name in _WET:
            # The area of a highlight goes with one over its narrowness.
            material = replace(
                material,
                specular=material.specular if highlights > 0.0 else 0.0,
                shininess=material.shininess / max(highlights, 1.0 / 16.0),
            )
        covered = blood * _BLOODY.get(name, 0.0)
        if covered > 1e-4:
            material = replace(material, blood_at=float(-ndtri(min(0.95, covered))))
        rows.append(material.row())
    table = np.array(rows, dtype=np.float32)
    table.setflags(write=False)
    return table
