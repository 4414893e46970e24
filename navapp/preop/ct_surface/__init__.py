"""From segmented bones to their surfaces, unbiased by threshold and thin cortex."""

from navapp.preop.ct_surface.bone_surfaces import (
    BoneSurface,
    CtSurfaces,
    surface_of_labels,
    surfaces_of,
)

__all__ = ["BoneSurface", "CtSurfaces", "surface_of_labels", "surfaces_of"]
