"""Landmarks of the proximal tibia and of the patella, from their surfaces alone."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.transform import FloatArray
from navapp.preop.cut_ends import find_whole_until_mm, on_cut_borders
from navapp.preop.extreme_points import SURFACE_NOISE_MM, WORST_SD_MM, find_extreme
from navapp.values import Landmark, Side

# Levels below the top of the eminence at which a tibia is as broad as its plateau.
RIM_MM = (8.0, 18.0)
_SLICE_MM = 2.5
# The plateau looks up; its middle, where the eminence stands, belongs to neither side.
_LOOKS_UP, EMINENCE_HALF_MM, _PLATEAU_MM = 0.85, 9.0, 18.0
# Levels of the tubercle, which lies two to five centimetres below the plateau.
_TUBERCLE_MM = (25.0, 55.0)


@dataclass(frozen=True, slots=True, eq=False)
class TibialEnd:
    """The upper end of a tibia."""

    # vertices_mm, normals: (V, 3).
    vertices_mm: FloatArray
    normals: FloatArray
    is_border: NDArray[np.bool_]  # (V,) where its surface was cut
    middle_mm: FloatArray  # (2,) x and y of the middle of its rim
    middle_sd_mm: float  # how far the slices of the rim disagree on it

    @property
    def below_top_mm(self) -> FloatArray:
        """(V,) depth below the highest point."""
        depth: FloatArray = self.vertices_mm[:, 2].max() - self.vertices_mm[:, 2]
        return depth

    @property
    def is_plateau(self) -> NDArray[np.bool_]:
        """(V,) on the joint's surface."""
        looks_up: NDArray[np.bool_] = (self.normals[:, 2] > _LOOKS_UP) & (
            self.below_top_mm < _PLATEAU_MM
        )
        return looks_up


def find_tibial_end(tibia: TriangleMesh) -> TibialEnd | None:
    """The upper end; None when it is not there.

    Args:
        tibia: without caps (`anatomy_of`), open where it was cut.
    """
    vertices = tibia.vertices_mm
    if len(vertices) == 0:
        return None
    below = vertices[:, 2].max() - vertices[:, 2]
    middles = []
    for level in np.arange(*RIM_MM, _SLICE_MM):
        piece = vertices[np.abs(below - level) < 0.5 * _SLICE_MM, :2]
        if len(piece) < 8:
            return None
        middles.append(0.5 * (piece.min(axis=0) + piece.max(axis=0)))
    centres = np.array(middles)
    sd_mm = float(np.hypot(np.linalg.norm(centres.std(axis=0)), SURFACE_NOISE_MM))
    return TibialEnd(vertices, tibia.normals, on_cut_borders(tibia), centres.mean(axis=0), sd_mm)


def tubercle_of(end: TibialEnd) -> Landmark | None:
    """The foremost point below the plateau; None when it is foremost only where the search ends."""
    below = end.below_top_mm
    whole_mm = find_whole_until_mm(below, end.is_border, _TUBERCLE_MM[0])
    is_level = (below > _TUBERCLE_MM[0]) & (below < min(_TUBERCLE_MM[1], whole_mm))
    found = find_extreme(end.vertices_mm, end.is_border, is_level, np.array([0.0, -1.0, 0.0]))
    if found is None:
        return None
    depth_mm = float(end.vertices_mm[:, 2].max() - found.point_mm[2])
    is_at_end = min(depth_mm - _TUBERCLE_MM[0], whole_mm - depth_mm) < _SLICE_MM
    return None if is_at_end else found


def estimate_tibia_landmarks(tibia: TriangleMesh, side: Side | None) -> dict[str, Landmark]:
    """What its surface allows: keyed `tibia/name`; medial and lateral need the side.

    Args:
        tibia: without caps (`anatomy_of`), open where it was cut.
        side: None when it is not known.
    """
    end = find_tibial_end(tibia)
    if end is None or end.middle_sd_mm > WORST_SD_MM or not end.is_plateau.any():
        return {}
    found: dict[str, Landmark | None] = {"tubercle": tubercle_of(end)}
    level = float(np.median(end.vertices_mm[end.is_plateau, 2]))
    centre = np.append(end.middle_mm, level)
    halves = {sign: _plateau(end, sign) for sign in (1.0, -1.0)}
    left, right = halves[1.0], halves[-1.0]
    if left is not None and right is not None:
        # Middle of the rim or between the plateaus: what it means is no clearer than they agree.
        apart_mm = float(np.linalg.norm(0.5 * (left.point_mm + right.point_mm) - centre))
        sd_mm = float(np.hypot(end.middle_sd_mm, apart_mm))
        found["plateau_centre"] = Landmark(centre, sd_mm, "surface")
    if side is not None:
        medial = 1.0 if side == "right" else -1.0
        found["medial_plateau"], found["lateral_plateau"] = halves[medial], halves[-medial]
    return {f"tibia/{name}": one for name, one in found.items() if one is not None}


def _plateau(end: TibialEnd, sign: float) -> Landmark | None:
    """The middle of the joint's surface on one side."""
    across = sign * (end.vertices_mm[:, 0] - end.middle_mm[0])
    surface = end.vertices_mm[end.is_plateau & (across > EMINENCE_HALF_MM)]
    if len(surface) < 20:
        return None
    middle = np.median(surface, axis=0)
    point = surface[int(np.argmin(((surface - middle) ** 2).sum(axis=1)))]
    # Where the surface ends is a matter of the limit on its slope: as uncertain as the ways to take
    # its middle differ, and as the middle of the bone.
    box = 0.5 * (surface.min(axis=0) + surface.max(axis=0))
    spread = max(float(np.linalg.norm(one - middle)) for one in (surface.mean(axis=0), box))
    return Landmark(point, float(np.hypot(spread, end.middle_sd_mm)), "surface")


def estimate_patella_landmarks(patella: TriangleMesh) -> dict[str, Landmark]:
    """Its centre of volume; nothing when it was cut.

    Args:
        patella: without caps (`anatomy_of`).
    """
    if on_cut_borders(patella).any() or patella.volume_mm3() <= 0.0:
        return {}
    corners = patella.vertices_mm[patella.faces] - patella.centroid_mm
    volumes = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2]))
    centre = (volumes[:, None] * corners.mean(axis=1) * 0.75).sum(axis=0) / volumes.sum()
    return {"patella/centre": Landmark(patella.centroid_mm + centre, SURFACE_NOISE_MM, "surface")}
