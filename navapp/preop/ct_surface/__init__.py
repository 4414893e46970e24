"""Sub-voxel surfaces of segmented bones, unbiased by threshold and thin cortex."""

from navapp.preop.ct_surface.bone_surfaces import (
    BoneSurface,
    CtSurfaces,
    make_label_surface,
    make_surfaces,
)

__all__ = ["BoneSurface", "CtSurfaces", "make_label_surface", "make_surfaces"]
