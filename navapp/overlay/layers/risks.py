"""Vessels and nerves, and the bone that lies within their safety distance."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.transform import FloatArray
from navapp.overlay.colours import SAFETY, risk_colour
from navapp.overlay.labels import Image, LabelBoard
from navapp.overlay.scene import Scene
from navapp.overlay.shading import one_colour, outline, outline_box, tint
from navapp.overlay.strokes import draw_line, sample_line

_NEAR_SHARE, _SURFACE_SHARE = 0.45, 0.3


def draw_risks(image: Image, scene: Scene, labels: LabelBoard) -> None:
    """The stage's risk structures; bone within their safety distance is coloured."""
    for name, risk in scene.risks.items():
        colour, mesh = risk_colour(name), risk.mesh
        structure_mm = scene.plan.curves[name] if mesh is None else mesh.vertices_mm
        if not scene.view.box.is_empty:
            share = _near_shares(scene.drawn_mesh, structure_mm, risk.safety_mm)
            if share.any():
                weight = scene.weight_over(scene.view.box)
                tint(image, scene.view, share, one_colour(SAFETY), weight)
        if mesh is None:
            draw_line(image, scene, sample_line(structure_mm), colour, 2)
        else:
            _draw_surface(image, scene, mesh, colour)
        pixels = scene.camera.project(scene.to_camera(structure_mm))
        labels.add(name.replace("_", " "), _visible_middle(pixels, image), colour)


def _draw_surface(
    image: Image, scene: Scene, mesh: TriangleMesh, colour: tuple[int, int, int]
) -> None:
    view = scene.render(mesh)
    if view.box.is_empty:
        return
    share = np.full(len(mesh.faces), _SURFACE_SHARE, dtype=np.float32)
    tint(image, view, share, one_colour(colour), scene.weight_over(view.box))
    outline(image, scene, view, scene.weight_over(outline_box(view, scene)), colour)


def _near_shares(
    mesh: TriangleMesh, structure_mm: FloatArray, safety_mm: float
) -> NDArray[np.float32]:
    """(F,) share of the colour of triangles that lie within a distance of a structure."""
    # Plans keep their arrays: the same one is the same structure.
    return _near_shares_of(mesh, _Same(structure_mm), safety_mm)


class _Same:
    """An array that equals itself alone."""

    def __init__(self, points_mm: FloatArray) -> None:
        self.points_mm = points_mm

    def __hash__(self) -> int:
        return id(self.points_mm)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Same) and other.points_mm is self.points_mm


@lru_cache(maxsize=32)
def _near_shares_of(mesh: TriangleMesh, structure: _Same, safety_mm: float) -> NDArray[np.float32]:
    from scipy.spatial import cKDTree

    distance_mm, _ = cKDTree(sample_line(structure.points_mm, 1.0)).query(
        mesh.vertices_mm, distance_upper_bound=safety_mm
    )
    is_near = np.isfinite(distance_mm)[mesh.faces].any(axis=1)
    return np.where(is_near, _NEAR_SHARE, 0.0).astype(np.float32)


def _visible_middle(pixels: FloatArray, image: Image) -> FloatArray:
    """The middle one of the pixels inside the picture; NaN without any."""
    height, width = image.shape[:2]
    with np.errstate(invalid="ignore"):
        inside = pixels[((pixels >= 0) & (pixels < (width, height))).all(axis=1)]
    return inside[len(inside) // 2] if len(inside) else np.full(2, np.nan)
