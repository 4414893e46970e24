"""Vessels and nerves, and the bone that lies within their safety distance."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.transform import FloatArray
from navapp.overlay.colours import SAFETY, Colour, risk_colour
from navapp.overlay.labels import Image, LabelBoard
from navapp.overlay.scene import Scene
from navapp.overlay.shading import draw_surface, one_colour, outline_box, tint
from navapp.overlay.strokes import draw_line, sample_line
from navapp.values import Plan

_NEAR_SHARE, _SURFACE_SHARE = 0.45, 0.3
_CURVE_STEP_MM = 2.0


def draw_risks(image: Image, scene: Scene, labels: LabelBoard) -> None:
    """The stage's risk structures; bone within their safety distance is coloured."""
    for name, risk in scene.risks.items():
        colour = risk_colour(name)
        structure_mm = sample_structure(scene.plan, name, _CURVE_STEP_MM)
        if risk.safety_mm > 0.0 and not scene.view.box.is_empty:
            share = _near_shares(scene.drawn_mesh, scene.plan, name, risk.safety_mm)
            weight = scene.weight_over(scene.view.box)
            tint(image, scene.view, share, one_colour(SAFETY), weight)
        if risk.mesh is None:
            draw_line(image, scene, structure_mm, colour, 2)
        else:
            _draw_mesh(image, scene, risk.mesh, colour)
        pixels = scene.camera.project(scene.to_camera(structure_mm))
        labels.add(name.replace("_", " "), _visible_middle(pixels, image), colour)


@lru_cache(maxsize=64)
def sample_structure(plan: Plan, name: str, step_mm: float) -> FloatArray:
    """(N, 3) points of a risk structure: corners and edges of its surface, or of its curve."""
    risk = plan.content.risks.get(name)
    if risk is None or risk.mesh is None:
        return sample_line(plan.curves[name], step_mm)
    mesh = risk.mesh
    edges = np.sort(mesh.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    start, end = mesh.vertices_mm[np.unique(edges, axis=0)].transpose(1, 0, 2)
    n = np.maximum(np.ceil(np.linalg.norm(end - start, axis=1) / step_mm), 1.0).astype(np.intp)
    edge = np.repeat(np.arange(len(n)), n)
    share = (np.arange(len(edge)) - np.repeat(np.cumsum(n) - n, n)) / n[edge]
    return np.concatenate([mesh.vertices_mm, start[edge] + share[:, None] * (end - start)[edge]])


def _draw_mesh(image: Image, scene: Scene, mesh: TriangleMesh, colour: Colour) -> None:
    view = scene.render(mesh)
    if view.box.is_empty:
        return
    share = np.full(len(mesh.faces), _SURFACE_SHARE, dtype=np.float32)
    weight = scene.weight_of(view, outline_box(view, scene))
    draw_surface(image, scene, view, share, colour, weight)


@lru_cache(maxsize=32)
def _near_shares(
    mesh: TriangleMesh, plan: Plan, name: str, safety_mm: float
) -> NDArray[np.float32]:
    """(F,) share of the colour of triangles that lie within a distance of a structure."""
    from scipy.spatial import cKDTree

    distance_mm, _ = cKDTree(sample_structure(plan, name, 1.0)).query(
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
