"""Vessels and nerves, and the bone that lies within their safety distance."""

from functools import lru_cache

import numpy as np

from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.transform import FloatArray
from navapp.overlay.colours import SAFETY, one_colour, risk_colour
from navapp.overlay.drawing import Body, Drawing, Tint
from navapp.overlay.scene import Scene
from navapp.overlay.strokes import sample_line, thin_line
from navapp.values import Plan

_NEAR_SHARE, _SURFACE_SHARE = 0.45, 0.3
# A label is put beside one of the points so far apart.
_NAMED_STEP_MM = 4.0


def draw_risks(scene: Scene, drawing: Drawing) -> None:
    """The stage's risk structures; bone within their safety distance is coloured."""
    near = tuple((name, risk.safety_mm) for name, risk in scene.risks.items() if risk.safety_mm > 0)
    if near:
        drawing.tints.append(_near_tint(scene.drawn_mesh, scene.plan, near))
    for name, risk in scene.risks.items():
        colour = risk_colour(name)
        if risk.mesh is None:
            drawing.lines([_curve_mm(scene.plan, name)], colour)
        else:
            share = np.full(len(risk.mesh.faces), _SURFACE_SHARE, dtype=np.float32)
            drawing.bodies.append(Body(risk.mesh, share, colour))
        structure_mm = sample_structure(scene.plan, name, _NAMED_STEP_MM)
        drawing.label(name.replace("_", " "), structure_mm, colour)


@lru_cache(maxsize=64)
def _curve_mm(plan: Plan, name: str) -> FloatArray:
    """(N, 3) points of the line to be drawn."""
    return sample_line(thin_line(plan.curves[name]))


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


@lru_cache(maxsize=16)
def _near_tint(mesh: TriangleMesh, plan: Plan, structures: tuple[tuple[str, float], ...]) -> Tint:
    """Of triangles that lie within the safety distance of a structure: names and mm."""
    from scipy.spatial import cKDTree

    is_near = np.zeros(len(mesh.vertices_mm), dtype=np.bool_)
    for name, safety_mm in structures:
        distance_mm, _ = cKDTree(sample_structure(plan, name, 1.0)).query(
            mesh.vertices_mm, distance_upper_bound=safety_mm
        )
        is_near |= np.isfinite(distance_mm)
    share = np.where(is_near[mesh.faces].any(axis=1), _NEAR_SHARE, 0.0)
    return Tint(share.astype(np.float32), one_colour(SAFETY))
