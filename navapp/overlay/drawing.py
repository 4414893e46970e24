"""What layers ask to be drawn: surfaces, lines, dots, words and panels of one scene."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.transform import FloatArray
from navapp.overlay.colours import Colour
from navapp.overlay.labels import Image, LabelBoard

_BETWEEN = np.full((1, 3), np.nan)
_CROSS_PX = 2.0


@lru_cache(maxsize=64)
def find_middle_mm(mesh: TriangleMesh) -> FloatArray:
    """(3,) mean of a mesh's vertices, which every picture asks for; not to be changed."""
    return mesh.centroid_mm


@dataclass(frozen=True, slots=True, eq=False)
class Tint:
    """Colours over the triangles of the stage's bone, as drawn."""

    share_of_face: NDArray[np.float32]  # (F,) 0 to 1
    colour_of_face: NDArray[np.float32]  # (F, 3), or (1, 3) for all


@dataclass(frozen=True, slots=True, eq=False)
class Body:
    """Another mesh in the bone's coordinates: lightly tinted, with an outline."""

    mesh: TriangleMesh
    share_of_face: NDArray[np.float32]  # (F,) 0 to 1
    colour: Colour


@dataclass(frozen=True, slots=True, eq=False)
class Stroke:
    """Lines through points (N, 3) of the bone's frame, some mm apart; NaN parts two lines."""

    points_mm: FloatArray
    colour: Colour
    width_px: float
    # arms from one point to another: on top or beneath as their first point, as long as the one of
    # which least is seen.
    is_judged_whole: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Words:
    """A label beside the middle one of those points (N, 3) of the bone's frame that are seen."""

    text: str
    points_mm: FloatArray
    colour: Colour


@dataclass(slots=True, eq=False)
class Drawing:
    """Filled by the layers in their order, painted as a whole.

    Surfaces lie below dots, dots below lines, lines below panels and words; within each kind what
    is asked for later lies over what was asked for before.
    """

    tints: list[Tint] = field(default_factory=list)
    outline: Colour | None = None  # of the stage's bone
    bodies: list[Body] = field(default_factory=list)
    dots: list[tuple[FloatArray, Colour]] = field(default_factory=list)  # points (N, 3) on the bone
    strokes: list[Stroke] = field(default_factory=list)
    words: list[Words] = field(default_factory=list)
    # Draw into the picture where they like, and tell the board which place they took.
    panels: list[Callable[[Image, LabelBoard], None]] = field(default_factory=list)

    def lines(self, lines_mm: Iterable[FloatArray], colour: Colour, width_px: float = 2.0) -> None:
        """Ask for lines through points (N, 3) each, in one colour; none is no line."""
        parts = [part for line in lines_mm for part in (line, _BETWEEN)]
        if parts:
            self.strokes.append(Stroke(np.concatenate(parts), colour, width_px))

    def cross(self, point_mm: FloatArray, axes: FloatArray, half_mm: float, colour: Colour) -> None:
        """Ask for a cross on a point (3,) along two axes (2, 3): whole, dashed or left out."""
        arms = np.full((4, 3, 3), np.nan)  # of each: from, to, a gap
        arms[:, 0] = point_mm
        arms[:, 1] = point_mm + half_mm * np.concatenate([axes, -axes])
        self.strokes.append(Stroke(arms.reshape(-1, 3), colour, _CROSS_PX, True))

    def label(self, text: str, points_mm: FloatArray, colour: Colour) -> None:
        """Ask for words beside a point (3,), or beside one of several (N, 3)."""
        self.words.append(Words(text, points_mm.reshape(-1, 3), colour))
