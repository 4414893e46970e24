"""Where the guides of a layer lie, as points of the bone: for these their errors are predicted."""

import numpy as np

from navapp.geometry.transform import FloatArray
from navapp.overlay.drawing import Drawing
from navapp.overlay.layers import LAYERS
from navapp.overlay.scene import Scene

# Of each kind of thing drawn, at most so many points.
_N_POINTS = 60


def sample_guides(scene: Scene, layer: str) -> FloatArray:
    """(N, 3) points of the bone's frame on what a layer draws; none for what lies on no bone.

    Ends of lines are among them; of surfaces, what faces the picture.
    """
    drawing = Drawing()
    LAYERS[layer](scene, drawing)
    mesh = scene.drawn_mesh
    faces = [mesh.faces[tint.share_of_face > 0.0] for tint in drawing.tints]
    parts = [_sample(_facing(scene, np.unique(one))) for one in faces]
    if drawing.outline is not None:
        parts.append(_sample(_facing(scene, np.arange(len(mesh.vertices_mm)))))
    parts += [_sample(body.mesh.vertices_mm) for body in drawing.bodies]
    parts += [_sample(points_mm) for points_mm, _ in drawing.dots]
    parts += [_sample(stroke.points_mm) for stroke in drawing.strokes]
    return np.concatenate([np.empty((0, 3)), *parts])


def _facing(scene: Scene, vertices: np.ndarray) -> FloatArray:
    mesh = scene.drawn_mesh
    is_faced = mesh.normals[vertices] @ scene.axis_in_bone < 0.0
    faced: FloatArray = mesh.vertices_mm[vertices[is_faced]]
    return faced


def _sample(points_mm: FloatArray) -> FloatArray:
    """At most so many of the known points, the extreme ones along each axis among them."""
    known = points_mm[np.isfinite(points_mm).all(axis=1)]
    if len(known) <= _N_POINTS:
        return known
    extreme = np.concatenate([known.argmin(axis=0), known.argmax(axis=0)])
    spread = np.linspace(0, len(known) - 1, _N_POINTS - 6).astype(int)
    chosen: FloatArray = known[np.unique(np.concatenate([extreme, spread]))]
    return chosen
