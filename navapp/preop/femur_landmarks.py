"""Landmarks of the distal femur, from its surface alone; the plan's z is the leg's long axis."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.transform import FloatArray
from navapp.preop.cut_ends import find_whole_until_mm, on_cut_borders
from navapp.preop.extreme_points import SURFACE_NOISE_MM, WORST_SD_MM, find_extreme
from navapp.values import Landmark, Side

# Levels above the lowest point of a femur, whose condyles are 75 to 95 mm wide.
_CONDYLES_MM, _EPICONDYLES_MM = 45.0, (12.0, 50.0)
_STRIP_MM = 2.0
# The notch of a knee is 10 to 25 mm deep seen from behind and below.
_LEAST_NOTCH_MM = 3.0
# A shaft is less than this share of the condyles' width, for at least this length.
_SHAFT_FRACTION, _LEAST_SHAFT_MM, _SLICE_MM = 0.55, 25.0, 2.5

DOWN, BACK = np.array([0.0, 0.0, -1.0]), np.array([0.0, 1.0, 0.0])
BEHIND_AND_BELOW = (DOWN + BACK) / np.sqrt(2.0)
ACROSS = np.array([1.0, 0.0, 0.0])


@dataclass(frozen=True, slots=True, eq=False)
class Condyles:
    """A femur's vertices, which of them belong to a condyle, and the plane between the two."""

    vertices_mm: FloatArray  # (V, 3) of the bone
    is_border: NDArray[np.bool_]  # (V,) where its surface was cut
    is_condyle: NDArray[np.bool_]  # (V,) low enough
    notch_x_mm: float  # the plane that parts them

    def of_side(self, sign: float) -> NDArray[np.bool_]:
        """(V,) the condyle towards +x or -x."""
        side: NDArray[np.bool_] = self.is_condyle & (
            sign * (self.vertices_mm[:, 0] - self.notch_x_mm) > 0.0
        )
        return side


def condyles_of(femur: TriangleMesh) -> Condyles | None:
    """The end of a femur; None when there is no notch between two condyles.

    Args:
        femur: without caps (`anatomy_of`), open where it was cut.
    """
    vertices = femur.vertices_mm
    if len(vertices) == 0:
        return None
    low = vertices[:, 2] < vertices[:, 2].min() + _CONDYLES_MM
    x, outward = vertices[low, 0], vertices[low] @ BEHIND_AND_BELOW
    edges = np.arange(x.min(), x.max() + _STRIP_MM, _STRIP_MM)
    strip = np.digitize(x, edges) - 1
    profile = np.full(len(edges), -np.inf)
    np.maximum.at(profile, strip, outward)
    share = (edges - x.min()) / max(np.ptp(x), _STRIP_MM)
    inner = np.flatnonzero((share > 0.25) & (share < 0.75))
    if len(inner) == 0:  # a slice of a bone
        return None
    notch = int(inner[np.argmin(profile[inner])])
    depth_mm = min(profile[:notch].max(), profile[notch + 1 :].max()) - profile[notch]
    if depth_mm < _LEAST_NOTCH_MM:
        return None
    return Condyles(vertices, on_cut_borders(femur), low, float(edges[notch]) + 0.5 * _STRIP_MM)


def find_shaft_top_mm(femur: TriangleMesh) -> float:
    """The height of the shaft's end, or of the lowest point of its cut."""
    height = femur.vertices_mm[:, 2]
    return find_whole_until_mm(height, on_cut_borders(femur), height.min() + _CONDYLES_MM)


def estimate_femur_landmarks(femur: TriangleMesh, side: Side | None) -> dict[str, Landmark]:
    """What its surface allows: keyed `femur/name`; medial and lateral need the side.

    Args:
        femur: without caps (`anatomy_of`), open where it was cut.
        side: None when it is not known.
    """
    found: dict[str, Landmark | None] = dict(_shaft_axis(femur))
    condyles = condyles_of(femur)
    if condyles is not None:
        vertices = condyles.vertices_mm
        middle = np.abs(vertices[:, 0] - condyles.notch_x_mm) < 2.0 * _STRIP_MM
        centre = find_extreme(vertices, condyles.is_border, middle & condyles.is_condyle, DOWN)
        if centre is not None and centre.sd_mm is not None:
            # The plane that parts the condyles is known to a strip.
            centre = replace(centre, sd_mm=float(np.hypot(centre.sd_mm, _STRIP_MM)))
        found["knee_centre"] = centre
        if side is not None:
            found |= _of_both_sides(condyles, medial=1.0 if side == "right" else -1.0)
    return {f"femur/{name}": one for name, one in found.items() if one is not None}


def _of_both_sides(condyles: Condyles, medial: float) -> dict[str, Landmark | None]:
    """Condyles and epicondyles; `medial` is the sign of x towards the middle of the body."""
    vertices = condyles.vertices_mm
    above = vertices[:, 2] - vertices[:, 2].min()
    is_broad = (above > _EPICONDYLES_MM[0]) & (above < _EPICONDYLES_MM[1])
    outermost = partial(find_extreme, vertices, condyles.is_border)
    found = {}
    for name, sign in (("medial", medial), ("lateral", -medial)):
        condyle = condyles.of_side(sign)
        found[f"{name}_condyle"] = outermost(condyle, DOWN)
        found[f"{name}_posterior_condyle"] = outermost(condyle, BACK)
        found[f"{name}_epicondyle"] = outermost(is_broad, sign * ACROSS)
    return found


def _shaft_axis(femur: TriangleMesh) -> Iterator[tuple[str, Landmark]]:
    """Both ends of the axis through the middles of the shaft's slices, where there is a shaft."""
    vertices = femur.vertices_mm
    if len(vertices) == 0:
        return
    lowest, highest = vertices[:, 2].min(), find_shaft_top_mm(femur)
    widest = np.ptp(vertices[vertices[:, 2] < lowest + _CONDYLES_MM, 0])
    middles = []
    for level in np.arange(highest - _SLICE_MM, lowest + _CONDYLES_MM, -_SLICE_MM):
        piece = vertices[np.abs(vertices[:, 2] - level) < 0.5 * _SLICE_MM]
        if len(piece) < 8 or np.ptp(piece[:, 0]) > _SHAFT_FRACTION * widest:
            break
        middles.append(0.5 * (piece.min(axis=0) + piece.max(axis=0)))
    centres = np.array(middles).reshape(-1, 3)
    if len(centres) < 2 or np.ptp(centres[:, 2]) < _LEAST_SHAFT_MM:
        return
    along = centres[:, 2] - centres[:, 2].mean()
    design = np.column_stack([np.ones_like(along), along])
    line, *_ = np.linalg.lstsq(design, centres, rcond=None)
    residual = centres - design @ line
    # Slices bow together: the fit is as good as its worst direction, not as many slices.
    sd_mm = float(2.0 * np.sqrt((residual[:, :2] ** 2).sum(axis=1).mean()) + SURFACE_NOISE_MM)
    if sd_mm > WORST_SD_MM:
        return
    for name, height in (("shaft_distal", along.min()), ("shaft_proximal", along.max())):
        yield name, Landmark(line[0] + height * line[1], sd_mm, "surface")
